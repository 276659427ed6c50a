"""What commands with a camera ask alike. Needs typer, so that it is imported where commands are made."""

from pathlib import Path
from typing import Annotated

import typer

CAMERA_HELP = "Calibration: TOML, YAML, JSON, XML (OpenCV, Tsai), or DLT coefficients."

CameraName = Annotated[str | None, typer.Option(help="Which camera of a file with several.")]
CameraUnit = Annotated[str | None, typer.Option(help="Unit of lengths in the calibration: m, cm or mm.")]
CameraSize = Annotated[
    str | None, typer.Option(help="Size of the picture, if the calibration does not say.", metavar="WxH")
]
CameraVUp = Annotated[
    bool | None,
    typer.Option("--camera-v-up/--camera-v-down", help="Whether v of DLT coefficients grows upwards."),
]
Lens = Annotated[
    Path | None, typer.Option(help="Known lens: a calibration, of which the lens alone is taken.")
]
Picture = Annotated[
    Path | None, typer.Option(help="Picture or video of that camera; ground.png is drawn over it.")
]
Size = Annotated[str | None, typer.Option(help="Size of the picture, without --picture.", metavar="WxH")]
FovDeg = Annotated[float | None, typer.Option(help="Horizontal field of view, degrees, where it is known.")]
