"""Many videos: a manifest in, a folder of results a video and two tables out, and none is lost on the way.

Every video is tracked by a process of its own (`task`, `leash`), so what kills one costs that one alone.
Results are renamed into place when complete and remembered in small records (`folder`), so a run can be
killed at any moment and resumed. Who runs the processes is an executor (`engine`): threads here, or the
workers of a cluster (`on_ray`, or any other).
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
