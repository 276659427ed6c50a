"""3D human motion from one fixed camera by explicit geometry."""

from memo._memo import __version__

__all__ = ["__version__"]
