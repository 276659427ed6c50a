"""Units of the columns of tables; results as pandas tables, where pandas is installed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import pandas

__all__ = ["column_unit", "data_frame"]

_UNITS = {
    "_mps": "m/s",
    "_per_min": "1/min",
    "_percent": "%",
    "_deg": "deg",
    "_rad": "rad",
    "_nats": "nat",
    "_px": "px",
    "_hz": "Hz",
    "_m": "m",
    "_s": "s",
    "phase": "cycle",
    "p_swapped": "1",
    "p_mirrored": "1",
    "probability": "1",
    "similarity": "1",
}


def column_unit(name: str) -> str | None:
    """The unit that the end of a column's name says, None for counts, names and numbers of frames."""
    return next((unit for end, unit in _UNITS.items() if name.endswith(end)), None)


def data_frame(columns: Mapping[str, Any]) -> pandas.DataFrame:
    """Columns of one length as a `pandas.DataFrame`; `attrs["units"]` has the units of those that have one.

    Raises ImportError, with what to install, where there is no pandas.
    """
    try:
        import pandas
    except ImportError:
        raise ImportError("to_pandas() needs pandas: pip install pandas") from None
    frame = pandas.DataFrame({name: np.asarray(values) for name, values in columns.items()})
    units = {name: column_unit(str(name)) for name in columns}
    frame.attrs["units"] = {name: unit for name, unit in units.items() if unit is not None}
    return frame
