"""Options that the commands with a camera share. Needs typer, so import it only where commands are made."""

from pathlib import Path
from typing import Annotated

import typer

CAMERA_HELP = "Calibration: TOML, YAML, JSON, XML (OpenCV, Tsai), or DLT coefficients."

CameraName = Annotated[str | None, typer.Option(help="Which camera of a file with several.")]
CameraUnit = Annotated[str | None, typer.Option(help="Unit of length in the calibration: m, cm or mm.")]
CameraSize = Annotated[
    str | None, typer.Option(help="Size of the picture, if the calibration has none.", metavar="WxH")
]
CameraVUp = Annotated[
    bool | None,
    typer.Option("--camera-v-up/--camera-v-down", help="Whether v of DLT coefficients grows upwards."),
]
Lens = Annotated[Path | None, typer.Option(help="Known lens: a calibration, of which only the lens is used.")]
Picture = Annotated[
    Path | None, typer.Option(help="Picture or video of this camera; ground.png is drawn over it.")
]
Size = Annotated[
    str | None, typer.Option(help="Size of the picture, if --picture is not given.", metavar="WxH")
]
FovDeg = Annotated[float | None, typer.Option(help="Horizontal field of view, degrees, if known.")]
