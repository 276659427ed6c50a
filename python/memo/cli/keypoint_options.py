"""Options that the commands on keypoints share. Needs typer, so import it only where commands are made."""

from pathlib import Path
from typing import Annotated

import typer

KeypointsPath = Annotated[
    Path,
    typer.Argument(
        metavar="KEYPOINTS",
        help="OpenPose folder, COCO or AlphaPose JSON, Sports2D's TRC in pixels, a table (CSV or "
        "Parquet), or a folder with track.csv.",
    ),
]
Fps = Annotated[
    float | None,
    typer.Option(help="Frame rate; needed if there are no times, and used in place of time_s."),
]
LayoutName = Annotated[
    str | None, typer.Option(help="Order of the points, such as BODY_25B, if detected wrongly.")
]
Person = Annotated[
    int | None,
    typer.Option(help="Index of the person in each frame's list; default: one is followed.", min=0),
]
