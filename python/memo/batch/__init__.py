"""Tracks many videos: from a manifest to one folder of results per video and two tables over all videos.

Every video is tracked in its own process (`task`, `leash`), so a crash does not affect the other videos.
Results are renamed into place when complete and recorded in small files (`folder`), so a run can be
killed at any moment and resumed. An executor runs the processes (`engine`): threads on this machine, or
the workers of a cluster (`on_ray`, or any other).
"""

from memo.batch.engine import BatchResult, Progress, run
from memo.batch.folder import STATES, BatchError, Record
from memo.batch.manifest import OPTIONS, ManifestError, read_manifest
from memo.batch.on_ray import RayExecutor

__all__ = [
    "OPTIONS",
    "STATES",
    "BatchError",
    "BatchResult",
    "ManifestError",
    "Progress",
    "RayExecutor",
    "Record",
    "read_manifest",
    "run",
]
