"""A stand-in for PsychoPy that records what is drawn, and refuses what PsychoPy refuses or shows wrongly.

Its rules are those of PsychoPy 2026.2 (`visual/image.py`, `visual/basevisual.py`): an array for an image
has values from -1 to 1, its first row is the lowest on the screen, and its size on the screen must be
given.
"""

from types import ModuleType, SimpleNamespace

import numpy as np

__all__ = ["SCREENS", "stand_in"]

SCREENS: list[np.ndarray] = []
"""What each refresh of the screen showed, (H, W, 3) from 0 to 255, the uppermost row first."""


class Window:
    def __init__(self, size, units, color, colorSpace):
        assert units == "pix" and colorSpace == "rgb255"
        self.size, self.colour, self.drawn = size, color, []
        SCREENS.clear()

    def flip(self):
        width, height = self.size
        screen = np.tile(np.array(self.colour, np.uint8), (height, width, 1))
        for picture in self.drawn:
            rows, columns = picture.shape[:2]
            top, left = (height - rows) // 2, (width - columns) // 2
            screen[top : top + rows, left : left + columns] = picture
        SCREENS.append(screen)
        self.drawn = []

    def close(self):
        self.size = None


class ImageStim:
    def __init__(self, win, size):
        self.win, self.size, self.image = win, size, None

    def draw(self):
        assert isinstance(self.image, np.ndarray) and self.image.dtype == np.float32
        assert self.image.min() >= -1 and self.image.max() <= 1
        rows, columns, channels = self.image.shape
        assert (columns, rows) == tuple(self.size) and channels == 3
        self.win.drawn.append(np.round((self.image[::-1] + 1) * 127.5).astype(np.uint8))


def stand_in():
    """A module `psychopy` with the part of it that the documentation uses."""
    module = ModuleType("psychopy")
    module.core = SimpleNamespace(wait=lambda seconds: None)
    module.visual = SimpleNamespace(Window=Window, ImageStim=ImageStim)
    return module
