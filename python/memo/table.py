"""Results as pandas tables, where pandas is installed; memo itself does not need it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import pandas

__all__ = ["data_frame"]

#: Unit of a column by the end of its name.
_UNITS = {
    "_m": "m",
    "_mps": "m/s",
    "_px": "px",
    "_deg": "deg",
    "_rad": "rad",
    "_s": "s",
    "_nats": "nats",
    "phase": "cycles",
}


def data_frame(columns: Mapping[str, Any]) -> pandas.DataFrame:
    """Columns of one length as a `pandas.DataFrame`; `attrs["units"]` has the units of those that have one.

    Raises ImportError, with what to install, where there is no pandas.
    """
    try:
        import pandas
    except ImportError:
        raise ImportError("to_pandas() needs pandas: pip install pandas") from None
    frame = pandas.DataFrame({name: np.asarray(values) for name, values in columns.items()})
    frame.attrs["units"] = {
        name: unit for name in columns for end, unit in _UNITS.items() if str(name).endswith(end)
    }
    return frame
