"""Which frames go into a page."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Choice"]


@dataclass(frozen=True)
class Choice:
    """The frames from `first` up to, not including, `stop`, and how many of them are shown."""

    first: int = 0
    stop: int | None = None
    every: int | None = None
    """Every n-th frame; None for as many as keep the file small."""
    why: bool = True
    """Whether frames of a walk are explained."""

    @property
    def chosen(self) -> bool:
        """Whether only some frames were requested."""
        return bool(self.first) or self.stop is not None

    def takes(self, frame: int) -> bool:
        """Whether a frame is among those requested."""
        return frame >= self.first and (self.stop is None or frame < self.stop)

    def told(self, every: int) -> list[str]:
        """Notes for a page without all frames, with every n-th in it."""
        sentences = []
        if every > 1:
            reason = "as requested" if self.every else "to keep it small"
            more = "" if self.every else "; --frames A:B shows a part in more detail"
            sentences.append(f"Every {ordinal(every)} frame is in this page, {reason}{more}.")
        if self.chosen:
            stop = "the end" if self.stop is None else str(self.stop - 1)
            sentences.append(f"Only frames {self.first} to {stop} were requested.")
        return sentences


def ordinal(count: int) -> str:
    """2nd, 3rd, 11th, ..."""
    ending = {1: "st", 2: "nd", 3: "rd"}.get(count % 10 if count % 100 not in (11, 12, 13) else 0, "th")
    return f"{count}{ending}"
