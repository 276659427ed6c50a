"""`memo track`: tracks everybody who walks through a video.

(Typer reads annotations where they stand, hence no `from __future__ import annotations` here.)
"""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from memo.cli.delivery import Delivery, Interrupt, complain, guarded, with_steps
from memo.exits import Exit
from memo.given import check_default_out, default_out, frame_range, heights, place_in_frame, tracker_options
from memo.recording import Recorded, Recording, track_recording

if TYPE_CHECKING:
    import typer

EPILOG = """Examples:
  memo track walk.mp4 --height 1.68
  memo track walk.mp4 --height 1.68 --camera camera.toml --report
  memo track slow.mp4 --height 1.68 --fps 240 --frames 100:900

Exit codes: 0 a walker was tracked; 1 the input cannot be used; 2 wrong usage; \
3 the video was read but no walker was tracked, or none at the place of --follow; \
4 the app extra is not installed; 130 interrupted (results up to then are written)."""


def add_track(app: "typer.Typer") -> None:
    import typer

    from memo.cli.camera_options import CAMERA_HELP, CameraName, CameraSize, CameraUnit, CameraVUp

    @app.command(epilog=EPILOG)
    def track(
        video: Annotated[
            Path,
            typer.Argument(metavar="VIDEO", help="A video file, or a folder of images (then --fps too)."),
        ],
        camera: Annotated[Path | None, typer.Option(help=CAMERA_HELP)] = None,
        camera_name: CameraName = None,
        camera_unit: CameraUnit = None,
        camera_size: CameraSize = None,
        camera_v_up: CameraVUp = None,
        height: Annotated[
            str | None,
            typer.Option(
                help="Height of the walker, metres, or of several people in order of appearance: 1.80,1.65. "
                "Given --camera, heights that differ clearly may be in any order. Without it, heights are "
                "measured with --camera, and assumed to be 1.70 m, with a standard deviation of 0.10 m, "
                "otherwise.",
                metavar="METRES",
            ),
        ] = None,
        fov_deg: Annotated[
            float | None,
            typer.Option(
                help="Horizontal field of view without --camera, degrees; default: 62 across the longer side."
            ),
        ] = None,
        steady: Annotated[
            bool,
            typer.Option(
                help="Turn frames back to the view of the first one, for a camera in the hand. Frames "
                "of a camera at rest are not changed."
            ),
        ] = True,
        treadmill: Annotated[
            bool | None,
            typer.Option(
                "--treadmill/--no-treadmill",
                help="Whether the person walks on a treadmill; by default, memo finds out.",
            ),
        ] = None,
        frames: Annotated[str, typer.Option(help="Frames A up to, not including, B.", metavar="A:B")] = ":",
        fps: Annotated[
            float | None, typer.Option(help="True frame rate, in place of the time stamps, for slow motion.")
        ] = None,
        shrink: Annotated[
            int | None,
            typer.Option(
                help="Average N by N pixels to one; by default the smallest N that brings the longer side "
                "to 1280 pixels or less. Results are in pixels of the video.",
                metavar="N",
                min=1,
            ),
        ] = None,
        follow: Annotated[
            str | None,
            typer.Option(
                help="Of several people, keep only the one who is at pixel X,Y in frame F, or whose outline "
                "overlaps most with a box in that frame: left, top, width and height.",
                metavar="X,Y@F|L,T,W,H@F",
            ),
        ] = None,
        boxes: Annotated[
            Path | None,
            typer.Option(
                help="Boxes around people from a detector or another tracker, as MOTChallenge rows, in place "
                "of looking for what moves.",
                metavar="FILE",
            ),
        ] = None,
        out: Annotated[
            Path | None, typer.Option(help="Folder for the results; default: memo-out/VIDEO.")
        ] = None,
        overlay: Annotated[bool, typer.Option(help="Write overlay.mp4.")] = True,
        plots: Annotated[bool, typer.Option(help="Write plots.")] = True,
        page: Annotated[
            bool, typer.Option("--report/--no-report", help="Write report.html (memo report).")
        ] = False,
        as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")] = False,
        quiet: Annotated[bool, typer.Option("--quiet", help="Print nothing but errors.")] = False,
    ) -> None:
        """Tracks everybody who walks through VIDEO."""
        delivery = Delivery(out or default_out(video), overlay, plots, as_json, quiet)

        def work() -> Exit:
            if out is None:
                check_default_out(delivery.out, video)
            reading = {"name": camera_name, "unit": camera_unit, "size": camera_size, "v_up": camera_v_up}
            options = tracker_options(heights(height), camera, reading, fov_deg, steady, treadmill)
            asked = frame_range(frames)
            place = None if follow is None else place_in_frame(follow)
            drawn = (overlay, plots, page)
            recording = Recording(video, options, asked, fps, shrink, *drawn, place, boxes, camera)
            return _track(recording, delivery)

        raise typer.Exit(guarded(work))


def _track(recording: Recording, delivery: Delivery) -> Exit:
    in_tables: list[Recorded] = []
    try:
        with with_steps(delivery) as progress:
            recorded = track_recording(
                recording,
                delivery.out,
                progress=progress,
                remark=complain,
                stop=Interrupt(),
                tracked=in_tables.append,
            )
    except (ValueError, OSError, KeyboardInterrupt):
        for found in in_tables:  # what was found is known, though not drawn
            report(found, delivery)
        raise
    if recorded.interrupted:
        return deliver_interrupted(recorded, delivery)
    report(recorded, delivery)
    source, tracked = recorded.source, recorded.exit is Exit.TRACKED
    if source.shrink > 1 and delivery.talks:
        width, height = source.size or (0, 0)
        small = f"{width // source.shrink}x{height // source.shrink}"
        print(f"Tracked at {small} of the {width}x{height} pixels of the video (--shrink).")
    if not source.camera_given and delivery.talks and tracked:
        known = "measured" if recorded.camera_motion.field_of_view else "assumed"
        print(
            f"No --camera: depths depend on the {known} field of view; heights and sideways positions do not."
        )
    return recorded.exit


# What is printed.


def report(recorded: Recorded, delivery: Delivery, more: Mapping[str, Any] | None = None) -> None:
    """Reports the findings; the JSON has the figures of the longest walk, `each_walk`, and `more`."""
    delivery.tell({**recorded.document, **(more or {})}, recorded.sentences, recorded.written)


def deliver_interrupted(recorded: Recorded, delivery: Delivery) -> Exit:
    if not recorded.written:
        complain(
            f"interrupted before anybody was tracked; {delivery.out} holds the results of an earlier run"
        )
        return Exit.INTERRUPTED
    report(recorded, delivery)
    complain("interrupted: the tables hold what was tracked until then; no overlay, no plots")
    return Exit.INTERRUPTED
