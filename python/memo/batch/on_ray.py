"""Ray as an executor: `memo.batch.run(manifest, out, executor=RayExecutor())`.

Each video is a task with one processor. If a worker is lost, only its video goes to another worker.
"""

from __future__ import annotations

import socket
from collections.abc import Callable
from concurrent.futures import Executor, Future
from typing import Any

from memo.batch.folder import BatchError
from memo.extras import install

__all__ = ["RayExecutor"]


class RayExecutor(Executor):
    """Submits to a Ray cluster: the one at `address`, the one already connected to, or a new local one."""

    def __init__(self, address: str | None = None, *, processors_per_video: float = 1) -> None:
        try:
            import ray
        except ImportError:
            raise ModuleNotFoundError(f"Ray is not installed: {install('ray', 'ray')}") from None
        self._ray = ray
        self._processors = processors_per_video
        self._connected_here = not ray.is_initialized()
        if self._connected_here:
            _check_reachable(address)
            try:
                ray.init(address=address, log_to_driver=False, configure_logging=False)
            except Exception as error:
                raise BatchError(f"Ray cannot be reached: {' '.join(str(error).split())[:200]}") from None
        self._references: dict[Future[Any], Any] = {}

    def submit(self, work: Callable[..., Any], /, *arguments: Any, **named: Any) -> Future[Any]:
        """Starts a task; its future ends with `WorkerCrashedError` if the worker is lost."""
        remote = self._ray.remote(num_cpus=self._processors, max_retries=0)(work)
        reference = remote.remote(*arguments, **named)
        future: Future[Any] = reference.future()
        self._references[future] = reference  # Ray drops tasks without a reference
        future.add_done_callback(lambda ended: self._references.pop(ended, None))
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Cancels tasks that have not started, if requested; closes the connection if it was made here."""
        if cancel_futures:
            for reference in list(self._references.values()):
                self._ray.cancel(reference)
        if wait:
            from concurrent.futures import wait as wait_for

            wait_for(list(self._references))
        if self._connected_here:
            self._ray.shutdown()


def _check_reachable(address: str | None) -> None:
    """Checks the address: Ray itself waits for a missing cluster and then ends the process."""
    host, colon, port = (address or "").removeprefix("ray://").rpartition(":")
    if colon and port.isdecimal():
        try:
            socket.create_connection((host.strip("[]"), int(port)), timeout=10).close()
        except (OSError, OverflowError) as error:
            raise BatchError(f"no Ray cluster at {address}: {error}") from None
