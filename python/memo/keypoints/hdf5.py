"""HDF5 files, which need the extra `h5` (h5py)."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any

from memo.extras import install
from memo.keypoints.points import KeypointsError

__all__ = ["ENDINGS", "opened"]

ENDINGS = (".h5", ".hdf5")


@contextmanager
def opened(path: Path) -> Iterator[Any]:
    """The file, open for reading; damage is a `KeypointsError`."""
    try:
        h5py = import_module("h5py")
    except ImportError:
        raise KeypointsError(f"{path}: HDF5 needs h5py: {install('h5', 'h5py')}") from None
    try:
        with h5py.File(path, "r") as file:
            yield file
    except KeypointsError:
        raise
    except (OSError, RuntimeError, KeyError, TypeError, ValueError) as error:
        raise KeypointsError(
            f"{path}: not an HDF5 file that can be read: {' '.join(str(error).split())}"
        ) from None
