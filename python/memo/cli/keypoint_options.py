"""What commands on keypoints ask alike. Needs typer, so that it is imported where commands are made."""

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
    typer.Option(help="Frame rate; needed where no times are given, and taken instead of time_s."),
]
LayoutName = Annotated[
    str | None, typer.Option(help="Order of the points, such as BODY_25B, if it is seen wrongly.")
]
Person = Annotated[
    int | None, typer.Option(help="Place of the person in each frame's list; else followed.", min=0)
]
