"""Options that the commands on keypoints share. Needs typer, so import it only where commands are made."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

import memo
from memo.given import InputError, point_in_frame, two_sides
from memo.keypoints import OptionError

_PLACE_WITHOUT_FRAME = re.compile(r"[-+.\d\s]+,[-+.\d\s]+")

KeypointsPath = Annotated[
    Path,
    typer.Argument(
        metavar="KEYPOINTS",
        help="JSON of MediaPipe, RTMPose (MMPose), YOLO, OpenPose, COCO, AlphaPose; CSV or H5 of DeepLabCut "
        "or SLEAP, Sports2D's TRC in pixels, a table (CSV, Parquet), or a folder with track.csv.",
    ),
]
Fps = Annotated[
    float | None,
    typer.Option(help="Frame rate; needed if there are no times, and used in place of time_s."),
]
LayoutName = Annotated[
    str | None, typer.Option(help="Order of the points, such as BODY_25B, if detected wrongly.")
]
ImageSize = Annotated[
    str | None,
    typer.Option(
        help="Width and height of the picture, pixels: for coordinates that are fractions of it, and for "
        "`memo posture` without --camera.",
        metavar="WxH",
    ),
]
Person = Annotated[
    str | None,
    typer.Option(
        help="Which of several people: the number, 0 being the most prominent; the name, or number of a "
        "track, if the file has these; or a place as in 320,240@50, pixels and frame. Default: 0.",
        metavar="NUMBER|NAME|X,Y@F",
    ),
]


def reading_of(
    fps: float | None, layout: str | None, person: str | None, image_size: str | None
) -> dict[str, Any]:
    """The options of `memo.read_keypoints`."""
    return {"fps": fps, "layout": layout, "person": person_of(person), "image_size": size_of(image_size)}


def keypoints_of(path: Path, reading: Mapping[str, Any], size_option: str = "--image-size") -> memo.Keypoints:
    """`memo.read_keypoints`, whose errors name the options of the command line."""
    try:
        return memo.read_keypoints(path, **reading)
    except OptionError as error:
        option = size_option if error.option == "image_size" else f"--{error.option}"
        raise InputError(f"{error.message} ({option})") from None


def person_of(text: str | None) -> int | str | tuple[float, float, int] | None:
    """A person chosen by number, name or place."""
    if text is None:
        return None
    if "@" in text:
        return point_in_frame(text, "--person")
    if _PLACE_WITHOUT_FRAME.fullmatch(text):
        raise InputError(f"--person {text}: a place needs its frame: X,Y@F in pixels, such as {text}@50")
    return int(text) if text.isascii() and text.isdecimal() else text


def size_of(text: str | None) -> tuple[int, int] | None:
    """Width and height from `640x480`."""
    return None if text is None else two_sides(text, "--image-size", "1920x1080")
