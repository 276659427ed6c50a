"""`memo calibrate`: a camera from measured points, a walker or a checkerboard.

(Typer evaluates annotations in their module, so `from __future__ import annotations` is not used here.)
"""

import math
import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

import memo
from memo.cli.delivery import Delivery, guarded, with_count, with_elapsed, with_progress
from memo.exits import Exit
from memo.given import (
    InputError,
    check_apart,
    check_writable,
    checked_fov,
    checked_height,
    load_camera,
    nothing_at,
    two_sides,
)
from memo.unfinished import write_complete
from memo.wording import counted

if TYPE_CHECKING:
    import typer

EXIT_CODES = """Exit codes: 0 the calibration was written; 1 the input cannot be used; \
2 wrong usage; 4 the app extra is not installed; 130 interrupted (nothing is written)."""
POINTS_EPILOG = f"""Examples:
  memo calibrate points points.csv --size 1280x720
  memo calibrate points points.csv --picture floor.png --out camera

{EXIT_CODES}"""
WALKER_EPILOG = f"""Examples:
  memo calibrate walker to_and_fro.mp4 --height 1.68
  memo calibrate walker walk_json --height 1.68 --fps 30 --size 1280x720

{EXIT_CODES}"""
CHECKERBOARD_EPILOG = f"""Examples:
  memo calibrate checkerboard boards --squares 9x6 --square-mm 30
  memo calibrate checkerboard boards --squares 9x6 --square-mm 30 --floor floor.png

{EXIT_CODES}"""

_KEYPOINT_SUFFIXES = (".json", ".csv", ".trc", ".parquet")
_LARGE_ERROR = 0.01  # of the longer side: points are pointed at to a few pixels
_FAR_OFF = 0.2  # of the longer side, for a principal point: few pictures are cut out so far off their centre
_WIDEST_M = 500.0  # largest plausible spread of the points of one camera
_MOST_FRAMES = 150  # enough for a background; all are in memory at once


def add_calibrate(app: "typer.Typer") -> None:
    import typer

    from memo.cli.camera_options import FovDeg, Lens, Picture, Size
    from memo.cli.keypoint_options import LayoutName, Person, person_of

    ways = typer.Typer(
        no_args_is_help=True, help="Finds the position, the orientation and the lens of a camera."
    )
    app.add_typer(ways, name="calibrate")
    out_option = typer.Option(help="Folder for the results; default: memo-out/NAME.")
    json_option = typer.Option("--json", help="Print the summary as JSON.")
    quiet_option = typer.Option("--quiet", help="Print nothing but errors.")

    @ways.command(epilog=POINTS_EPILOG)
    def points(
        table: Annotated[Path, typer.Argument(metavar="POINTS", help="CSV: x_m,y_m,z_m,u_px,v_px.")],
        size: Size = None,
        picture: Picture = None,
        fov_deg: FovDeg = None,
        lens: Lens = None,
        out: Annotated[Path | None, out_option] = None,
        as_json: Annotated[bool, json_option] = False,
        quiet: Annotated[bool, quiet_option] = False,
    ) -> None:
        """From at least six measured points, or four on the floor: positions in metres and in the picture."""
        delivery = Delivery(out or Path("memo-out") / table.stem, as_json=as_json, quiet=quiet)

        def work() -> Exit:
            check_apart([table, picture, lens], _written(delivery))
            return _points(table, _view(size, picture, fov_deg, lens), delivery)

        raise typer.Exit(guarded(work))

    @ways.command(epilog=WALKER_EPILOG)
    def walker(
        source: Annotated[
            Path,
            typer.Argument(
                metavar="SOURCE",
                help="A video, or keypoints (folder, JSON, CSV, TRC, Parquet), of a person walking about.",
            ),
        ],
        height: Annotated[float, typer.Option(help="Height of the person, metres.")],
        size: Size = None,
        picture: Picture = None,
        fov_deg: FovDeg = None,
        lens: Lens = None,
        fps: Annotated[float | None, typer.Option(help="Frame rate, if the source has none.")] = None,
        layout: LayoutName = None,
        person: Person = None,
        out: Annotated[Path | None, out_option] = None,
        as_json: Annotated[bool, json_option] = False,
        quiet: Annotated[bool, quiet_option] = False,
    ) -> None:
        """From a person of known height who walks towards the camera and away from it."""
        delivery = Delivery(out or Path("memo-out") / source.resolve().stem, as_json=as_json, quiet=quiet)

        def work() -> Exit:
            checked_height(height)
            check_apart([source, picture, lens], _written(delivery))
            reading = {"fps": fps, "layout": layout, "person": person_of(person)}
            return _walker(source, height, reading, (size, picture, fov_deg, lens), delivery)

        raise typer.Exit(guarded(work))

    @ways.command(epilog=CHECKERBOARD_EPILOG)
    def checkerboard(
        folder: Annotated[
            Path,
            typer.Argument(metavar="FOLDER", help="Folder of pictures of the board at different tilts."),
        ],
        squares: Annotated[str, typer.Option(help="Squares along both sides.", metavar="9x6")],
        square_mm: Annotated[float, typer.Option(help="Side of a square, millimetres.")],
        floor: Annotated[
            Path | None, typer.Option(help="A picture of the board lying on the ground, where z is 0.")
        ] = None,
        out: Annotated[Path | None, out_option] = None,
        as_json: Annotated[bool, json_option] = False,
        quiet: Annotated[bool, quiet_option] = False,
    ) -> None:
        """From pictures of a checkerboard; with --floor also the position and orientation of the camera."""
        delivery = Delivery(out or Path("memo-out") / folder.resolve().name, as_json=as_json, quiet=quiet)

        def work() -> Exit:
            check_apart([folder, floor], _written(delivery))
            return _checkerboard(folder, two_sides(squares, "--squares", "9x6"), square_mm, floor, delivery)

        raise typer.Exit(guarded(work))


def _written(delivery: Delivery) -> list[Path]:
    return [delivery.out / name for name in ("camera.toml", "lens.toml", "ground.png")]


def _view(
    size: str | None,
    picture: Path | None,
    fov_deg: float | None,
    lens: Path | None,
    source_size: tuple[int, int] | None = None,
) -> dict[str, Any]:
    """Size, luma and known lens parameters, from the options and the size of the source."""
    from memo.calibration import read_picture

    if fov_deg is not None and lens is not None:
        raise InputError("--lens already holds the field of view: leave --fov-deg out")
    sides = None if size is None else two_sides(size, "--size")
    luma = None if picture is None else read_picture(picture)
    known = None if lens is None else load_camera(lens, None, size=size, lens_only=True)
    for other in (
        source_size,
        None if luma is None else luma.shape[::-1],
        None if known is None else known.size,
    ):
        if sides is not None and other is not None and tuple(other) != tuple(sides):
            raise InputError(
                f"pictures of different sizes: {sides[0]}x{sides[1]} and {other[0]}x{other[1]} pixels"
            )
        sides = sides or (None if other is None else (int(other[0]), int(other[1])))
    if sides is None:
        raise InputError("the size of the picture is needed: give --size WxH or --picture")
    view: dict[str, Any] = {"size": sides, "luma": luma, "lens": known, "focal_px": None}
    if fov_deg is not None:
        view["focal_px"] = sides[0] / 2 / math.tan(math.radians(checked_fov(fov_deg)) / 2)
    return view


def _check_inside(source: Path, pixels: Any, size: tuple[int, int]) -> None:
    """Refuses a size if more than a tenth of the points lie outside it."""
    outside = ((pixels < 0) | (pixels >= size)).any(axis=1)
    if outside.mean() > 0.1:
        u, v = pixels[outside][0]
        raise InputError(
            f"{source}: {outside.sum()} of {counted(len(pixels), 'point')} outside a picture of"
            f" {size[0]}x{size[1]} pixels, the first at ({u:.0f}, {v:.0f}): is the size right?"
        )


def _points(path: Path, view: dict[str, Any], delivery: Delivery) -> Exit:
    from memo.calibration import read_points_csv

    check_writable(delivery.out)
    table = read_points_csv(path)
    if len(table.lines):
        _check_inside(path, table.pixels, view["size"])
        spread_m = float(np.ptp(table.places, axis=0).max())
        if spread_m > _WIDEST_M:
            raise InputError(
                f"{path}: x_m, y_m and z_m are spread over {spread_m:g} m: are they millimetres?"
                " divide them by 1000"
            )
    with with_elapsed("fitting", delivery):
        try:
            found = memo.calibrate_points(
                table.places, table.pixels, view["size"], focal_px=view["focal_px"], lens=view["lens"]
            )
        except ValueError as error:
            from_0 = " (point numbers start at 0)" if re.search(r"points? \d", str(error)) else ""
            raise InputError(f"{path}: {error}{from_0}") from None
    off = np.hypot(*found.residuals_px.T)
    kept = len(off) - len(found.outliers)
    lines = [f"Reprojection error {found.rms_px:.2f} px RMS over {counted(kept, 'point')}."]
    if found.outliers:
        left_out = ", ".join(f"line {table.lines[i]} ({off[i]:.0f} px off)" for i in found.outliers)
        lines.append(f"Left out as outliers: {left_out}.")
    if found.is_planar and view["lens"] is None:
        lines.append("All points lie in a plane: square pixels were assumed.")
    if "centre_u_px" not in found.estimates and view["lens"] is None:
        contradicted = "" if view["focal_px"] is not None else "; the points do not contradict it"
        lines.append(f"The principal point is the picture's centre{contradicted}.")
    if found.rms_px > _LARGE_ERROR * max(view["size"]):
        lines.append("This error is large: check the points, their axes and units, --size and --fov-deg.")
    if (share := _centre_off(found, view["size"])) > _FAR_OFF:
        lines.append(f"The principal point is {share:.0%} of the picture off its centre: check --size.")
    marks = np.stack([table.pixels, table.pixels + found.residuals_px], axis=1)
    summary = {"points": len(off), "left_out_lines": [table.lines[i] for i in found.outliers]}
    return _deliver(found, view, lines, summary, marks, delivery)


def _centre_off(found: Any, size: tuple[int, int]) -> float:
    """How far a fitted principal point is off the picture's centre, as a share of the longer side."""
    fitted = [found.estimates.get(f"centre_{axis}_px") for axis in "uv"]
    offs = [0.0 if one is None else one[0] - (side - 1) / 2 for one, side in zip(fitted, size, strict=True)]
    return math.hypot(*offs) / max(size)


def _walker(
    source: Path,
    height_m: float,
    reading: dict[str, Any],
    options: tuple[str | None, Path | None, float | None, Path | None],
    delivery: Delivery,
) -> Exit:
    from memo.cli.keypoint_options import keypoints_of

    check_writable(delivery.out)
    if not source.exists():
        raise InputError(nothing_at(source, "file or folder"))
    is_keypoints = source.suffix.lower() in _KEYPOINT_SUFFIXES or (
        source.is_dir() and any(source.glob("*.json"))
    )
    shares: dict[str, Any] = {}
    if is_keypoints:
        # The fit uses no times; a rate is only needed to read a source without times.
        sides = None if options[0] is None else two_sides(options[0], "--size")
        reading = {**reading, "fps": reading["fps"] or 25.0, "image_size": sides}
        keypoints = keypoints_of(source, reading, "--size")
        view = _view(*options, keypoints.image_size)
        points = np.where(keypoints.scores[..., None] > 0, keypoints.points, np.nan)
        feet, heads, shares["foot_share"], shares["head_share"] = memo.walker_sightings(
            keypoints.names, points
        )
        if not len(feet):
            raise InputError(f"{source}: no frame has both ankles and the head (or ears, eyes, nose, neck)")
        _check_inside(source, np.concatenate([feet, heads]), view["size"])
    else:
        unused = [f"--{name}" for name in ("layout", "person") if reading[name] is not None]
        if unused:
            raise InputError(f"{', '.join(unused)}: has no meaning for a video")
        feet, heads, luma = _video_sightings(source, reading["fps"], delivery)
        view = _view(*options, (luma.shape[1], luma.shape[0]))
        view["luma"] = luma if view["luma"] is None else view["luma"]
    with with_elapsed("fitting", delivery):
        try:
            found = memo.calibrate_walker(
                feet, heads, view["size"], height_m, focal_px=view["focal_px"], lens=view["lens"], **shares
            )
        except ValueError as error:
            raise InputError(f"{source}: {error}") from None
    kept = len(feet) - len(found.outliers)
    lines = [
        f"Reprojection error of the head {found.rms_px:.1f} px RMS,"
        f" {found.rms_px / found.person_px:.1%}"
        f" of the person's height, over {kept} of {counted(len(feet), 'sighting')}.",
        f"All lengths are based on the person's height of {height_m:g} m.",
    ]
    if view["focal_px"] is not None:
        lines.append("The focal length was given by --fov-deg.")
    marks = np.stack([heads, heads + found.residuals_px], axis=1)
    summary = {"sightings": len(feet), "left_out": len(found.outliers), "person_px": found.person_px}
    return _deliver(found, view, lines, summary, marks, delivery)


def _video_sightings(source: Path, fps: float | None, delivery: Delivery) -> tuple[Any, Any, Any]:
    from memo.calibration import rectangles
    from memo.video import VideoReader

    with VideoReader(source, rate_hz=fps) as reader:
        count = reader.frame_count
        step = max(1, math.ceil((count or 500) / _MOST_FRAMES))
        frames: list[Any] = []
        for frame in with_progress(reader, "reading", count, delivery):
            if frame.index % step == 0 and len(frames) < 2 * _MOST_FRAMES:
                frames.append(np.ascontiguousarray(frame.luma))
    with with_elapsed("looking for the walker", delivery):
        feet, heads = rectangles(frames)
    if not len(feet):
        raise InputError(f"{source}: nobody is visible from head to feet and away from the border")
    return feet, heads, frames[len(frames) // 2]


def _checkerboard(
    folder: Path, squares: tuple[int, int], square_mm: float, floor: Path | None, delivery: Delivery
) -> Exit:
    from memo.calibration import board_places, find_boards, lens_from_boards, read_picture

    check_writable(delivery.out)
    if not folder.is_dir():
        raise InputError(nothing_at(folder, "folder of pictures"))
    if not (math.isfinite(square_mm) and 1 <= square_mm <= 1000):
        raise InputError(f"--square-mm {square_mm:g} is not the side of a square in millimetres (1 to 1000)")
    suffixes = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")
    paths = sorted(path for path in folder.iterdir() if path.suffix.lower() in suffixes)
    if not paths:
        raise InputError(f"{folder}: holds no pictures ({', '.join(suffixes)})")

    with with_count("looking for boards", delivery) as progress:
        boards = find_boards(paths, squares, progress)
    lens = lens_from_boards(boards, square_mm / 1000)
    columns, rows = boards.corners
    lines = [
        f"Board of {columns + 1}x{rows + 1} squares ({columns}x{rows} inner corners)"
        f" in {len(boards.found)} of {counted(len(paths), 'picture')};"
        f" reprojection error {lens.rms_px:.2f} px RMS."
    ]
    if not boards.are_squares:
        lines.append(
            f"--squares {squares[0]}x{squares[1]} counts the inner corners, not the squares, of this board."
        )
    lines += [f"Not used: {path.name}: {why}." for path, why in boards.without.items()]
    lines.append(f"Focal length {lens.focal_px[0]:.1f} ± {lens.focal_sd_px[0]:.1f} px.")
    summary = {
        "pictures": len(paths),
        "used": {path.name: error for path, error in lens.error_px.items()},
        "not_used": {path.name: why for path, why in boards.without.items()},
        "rms_px": lens.rms_px,
        "focal_px": lens.focal_px,
        "focal_sd_px": lens.focal_sd_px,
    }
    lens_file = delivery.out / "lens.toml"
    write_complete(lens_file, lens.text)
    known = memo.Camera.from_file(lens_file, lens_only=True)
    if floor is None:
        lines.append("Without --floor the camera's position is unknown: give lens.toml as --lens.")
        delivery.tell(summary, lines, [lens_file])
        return Exit.DONE
    board = find_boards([floor], (columns + 1, rows + 1)).found.get(floor)
    if board is None:
        raise InputError(f"{floor}: no board of {columns + 1}x{rows + 1} squares was found")
    places = board_places(boards.corners, square_mm / 1000)
    try:
        found = memo.calibrate_points(places, board, boards.size, lens=known)
    except ValueError:  # seen from below: the corners are in the opposite order
        places = places * np.array([1.0, -1.0, 1.0])
        found = memo.calibrate_points(places, board, boards.size, lens=known)
    lines.append(f"On the floor: reprojection error {found.rms_px:.2f} px RMS.")
    view = {"size": boards.size, "luma": read_picture(floor), "lens": known, "focal_px": None}
    marks = np.stack([board, board + found.residuals_px], axis=1)
    return _deliver(
        found, view, lines, {**summary, "floor_rms_px": found.rms_px}, marks, delivery, [lens_file]
    )


# What is written and printed.


def _deliver(
    found: memo._memo.PointCalibration | memo._memo.WalkerCalibration,
    view: dict[str, Any],
    lines: list[str],
    summary: dict[str, Any],
    marks: Any,
    delivery: Delivery,
    written: list[Path] | None = None,
) -> Exit:
    from memo.calibration import PERSON_M, draw_ground, standing_place, write_picture

    camera = found.camera
    toml, picture = delivery.out / "camera.toml", delivery.out / "ground.png"
    luma = view["luma"]
    if luma is None:
        luma = np.full(view["size"][::-1], 90, np.uint8)
    drawn = draw_ground(luma, camera, marks)
    camera.to_toml(toml)
    write_picture(picture, drawn)
    place = standing_place(camera)
    person_px = None if place is None else camera.pixel_height(place[0], PERSON_M)
    estimates = {name: {"value": value, "sd": sd} for name, (value, sd) in found.estimates.items()}
    pitch_deg = _pitch_deg(camera)
    x, y, z = camera.position
    where = (
        f"The camera is {z:.2f} m above the ground at ({x:.2f}, {y:.2f}) m and looks {abs(pitch_deg):.1f}°"
    )
    fitted = ", ".join(f"{name} {_rounded(entry['value'], entry['sd'])}" for name, entry in estimates.items())
    size = (
        f"A {PERSON_M} m person is {person_px:.0f} px high at {place[1]}."
        if place and person_px
        else ("The picture shows no ground on which a person could stand: are the axes right?")
    )
    said = [f"{where} {'down' if pitch_deg >= 0 else 'up'}.", f"Fitted: {fitted}.", size]
    if z < 0:
        said.insert(1, "That is below the ground: z_m must point upwards, from 0 at the floor.")
    summary = {
        **summary,
        "estimates": estimates,
        "rms_px": found.rms_px,
        "person_px_at": None if place is None else {"place_m": place[0], "height_px": person_px},
        "position_m": camera.position,
        "pitch_deg": pitch_deg,
    }
    delivery.tell(summary, [*lines, *said], [*(written or []), toml, picture])
    return Exit.DONE


def _pitch_deg(camera: Any) -> float:
    """How far the camera looks down, degrees."""
    up = camera.camera_from_world(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]))
    return math.degrees(math.asin(max(-1.0, min(1.0, -(up[1] - up[0])[2]))))


def _rounded(value: float, sd: float) -> str:
    if not math.isfinite(sd) or sd <= 0:
        return f"{value:.6g} (standard deviation unknown)"
    digits = max(0, 1 - math.floor(math.log10(sd)))
    return f"{value:.{min(digits, 9)}f} ± {sd:.{min(digits, 9)}f}"
