"""Missing numbers in arrays that users pass: NaN, or the mask of a masked array."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

__all__ = ["real_numbers"]


def real_numbers(values: Any) -> npt.NDArray[np.float64]:
    """A new array of numbers, with NaN where a masked array, or one in a list, is masked.

    Raises TypeError for complex numbers, whose imaginary part would be lost.
    """
    of_masked = isinstance(values, list | tuple) and any(np.ma.isMaskedArray(value) for value in values)
    given = np.ma.array(values) if of_masked or np.ma.isMaskedArray(values) else np.asarray(values)
    if np.iscomplexobj(given):
        raise TypeError("wanted real numbers, got complex ones")
    return np.array(np.ma.filled(given.astype(np.float64), np.nan))
