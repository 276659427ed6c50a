"""`memo planar`: finds limbs in unnamed tracks.

(Typer evaluates annotations in their module, so `from __future__ import annotations` is not used here.)
"""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import memo
from memo.cli.delivery import Delivery, guarded, with_count
from memo.cli.unswap import one_of_several
from memo.exits import Exit
from memo.given import InputError, check_apart, check_writable, default_out
from memo.wording import counted

if TYPE_CHECKING:
    import typer

EPILOG = """Examples:
  memo planar dots.csv
  memo planar joints.csv --fps 60 --noise-px 1 --names
  memo planar walk_json --fps 30 --noise-px 2 --names
  memo planar mediapipe.json --image-size 1280x720 --noise-px 2 --names --person 1

Exit codes: 0 a linkage was found; 1 the input cannot be used; 2 wrong usage; \
3 no window shows a body; 4 the app extra is not installed."""

_DRAWN = ("linkage.png", "turned.mp4", "turned.png")


def add_planar(app: "typer.Typer") -> None:
    import typer

    from memo.cli.keypoint_options import Fps, ImageSize, LayoutName, Person, reading_of

    usual = memo._memo.defaults("planar")

    @app.command(epilog=EPILOG)
    def planar(
        tracks: Annotated[
            Path,
            typer.Argument(
                metavar="TRACKS",
                help="CSV of NAME_u_px, NAME_v_px and time_s (or --fps), or keypoints as for memo posture.",
            ),
        ],
        noise_px: Annotated[float, typer.Option(help="Standard deviation of a coordinate, pixels.")] = usual[
            "noise_px"
        ],
        window: Annotated[float, typer.Option(help="Length of the windows in time, seconds.")] = usual[
            "window_s"
        ],
        fps: Fps = None,
        layout: LayoutName = None,
        person: Person = None,
        image_size: ImageSize = None,
        carry: Annotated[
            bool, typer.Option("--carry", help="Keep lengths from window to window where no plane fits.")
        ] = False,
        names: Annotated[
            bool,
            typer.Option(
                "--names",
                help="Use the joint names of the columns (RKN or right_knee): limbs bend only as joints can.",
            ),
        ] = False,
        focal_px: Annotated[
            float | None, typer.Option(help="Focal length, pixels: reports the error due to perspective.")
        ] = None,
        turn_deg: Annotated[
            float, typer.Option(help="Viewpoint of turned.mp4 and turned.png, degrees.")
        ] = 50.0,
        out: Annotated[
            Path | None, typer.Option(help="Folder for the results; default: memo-out/TRACKS.")
        ] = None,
        video: Annotated[
            bool, typer.Option(help="Write turned.mp4, the limbs from another viewpoint.")
        ] = True,
        as_json: Annotated[bool, typer.Option("--json", help="Print the summary as JSON.")] = False,
        quiet: Annotated[bool, typer.Option("--quiet", help="Print nothing but errors.")] = False,
    ) -> None:
        """Links unnamed points into limbs that swing in planes, with lengths and depths."""
        options = {"window_s": window, "carry": carry, "focal_px": focal_px}
        delivery = Delivery(out or default_out(tracks), overlay=video, as_json=as_json, quiet=quiet)

        def work() -> Exit:
            reading = reading_of(fps, layout, person, image_size)
            return _planar(tracks, noise_px, reading, names, turn_deg, options, delivery)

        raise typer.Exit(guarded(work))


def _planar(
    tracks: Path,
    noise_px: float,
    reading: dict[str, Any],
    names: bool,
    turn_deg: float,
    options: dict[str, Any],
    delivery: Delivery,
) -> Exit:
    from memo.linkage import JOINT_NAMES, WRITTEN, write_figure_csv
    from memo.linkage_plot import write_linkage_png, write_turned_png, write_turned_video

    _check(options["focal_px"], turn_deg)
    out = delivery.out
    check_apart([tracks], [out / name for name in (*WRITTEN, *_DRAWN)])
    points, who = _read(tracks, reading)
    if names and not any(name in JOINT_NAMES for name in points.names):
        raise InputError(f"{tracks}: no column names a joint (RKN or right_knee): leave --names out")
    check_writable(out)
    if names:
        options = options | {"names": points.names}
    with with_count("looking for limbs", delivery) as progress:
        figure = memo.planar(points.positions, points.times_s, noise_px, progress=progress, **options)
    written = write_figure_csv(out, figure, points)
    for stale in _DRAWN:  # of an earlier run
        (out / stale).unlink(missing_ok=True)
    if figure.windows:
        write_linkage_png(out / "linkage.png", points, figure)
        written.append(out / "linkage.png")
    if figure.interpreted:
        write_turned_png(out / "turned.png", points, figure, turn_deg=turn_deg)
        written.append(out / "turned.png")
    if figure.interpreted and delivery.overlay:
        with with_count("drawing", delivery) as progress:
            write_turned_video(out / "turned.mp4", points, figure, turn_deg=turn_deg, progress=progress)
        written.append(out / "turned.mp4")
    verdicts = figure.verdicts()
    links = [
        link._asdict()
        | {"a": points.names[link.a], "b": points.names[link.b], "verdicts": verdicts[link.a, link.b]}
        for link in figure.links()
    ]
    summary = {
        "body": figure.is_body,
        "windows": [window.status for window in figure.windows],
        "links": links,
        "perspective_px": figure.perspective_px,
    }
    delivery.tell(summary, [*who, *_about_figure(figure, points, noise_px)], written)
    return Exit.DONE if figure.interpreted else Exit.NOBODY


def _read(tracks: Path, reading: dict[str, Any]) -> tuple[Any, list[str]]:
    """The points, and sentences on whose they are, if the file is of keypoints."""
    from memo.cli.keypoint_options import keypoints_of
    from memo.linkage import holds_keypoints, limb_points, read_tracks

    if tracks.exists() and holds_keypoints(tracks):
        keypoints = keypoints_of(tracks, reading)
        who = one_of_several(keypoints, reading["person"] is None).strip()
        warned = [f"Warning: {doubt}." for doubt in keypoints.doubts]
        return limb_points(keypoints), [who] * bool(who) + warned
    unused = [
        f"--{name.replace('_', '-')}" for name in reading if name != "fps" and reading[name] is not None
    ]
    if unused:
        raise InputError(
            f"{tracks}: is a table of points and not of keypoints: leave {', '.join(unused)} out"
        )
    return read_tracks(tracks, reading["fps"]).at_one_scale(), []


def _check(focal_px: float | None, turn_deg: float) -> None:
    if focal_px is not None and not (focal_px > 0 and math.isfinite(focal_px)):
        raise InputError(f"--focal-px {focal_px:g} must be positive and finite")
    if not math.isfinite(turn_deg):
        raise InputError(f"--turn-deg {turn_deg:g} must be finite")


def _about_figure(figure: Any, points: Any, noise_px: float) -> list[str]:
    """Reports the findings in sentences."""
    if not figure.windows:
        return ["No window: no stretch between pauses is long enough. Nothing is claimed."]
    states = [window.status for window in figure.windows]
    told = [f"{states.count(state)} {state}" for state in dict.fromkeys(states)]
    lines = [f"Windows: {', '.join(told)}."]
    if any(window.method == "forest" and window.chains for window in figure.windows):
        lines.append(
            f"{len(points.names)} are too many points to compare all links (at most 16): a spanning tree "
            "links them, without evidence that they are a body. Leave out what is no joint of a limb."
        )
    if not figure.interpreted:
        guess = " The best guess is in links.csv." if any(w.chains for w in figure.windows) else ""
        return [*lines, f"memo found no limb: {_why_not(figure)}.{guess}"]
    lines += _about_links(figure, points.names)
    if figure.perspective_px is not None and figure.perspective_px > max(noise_px, 0.5):
        lines.append(
            f"Perspective moves points by up to {figure.perspective_px:.1f} px, more than the noise: "
            "lengths and depths are off by more than their standard deviations."
        )
    chains = [chain for window in figure.interpreted for chain in window.chains]
    fixed = sum(chain.reflection_margin_deg is not None for chain in chains)
    if fixed:
        lines.append(f"Front and back decided by joint limits in {fixed} of {counted(len(chains), 'chain')}.")
    if fixed < len(chains):
        lines.append(
            "Every other chain may also be its mirror image in depth."
            if fixed
            else "Every chain may also be its mirror image in depth."
        )
    return [*lines, "The depth of one chain relative to another is undetermined."]


def _why_not(figure: Any) -> str:
    """Why no window is interpreted."""
    lost = [window for window in figure.windows if window.status == "lost"]
    if lost and all(window.method == "forest" for window in lost):
        return "too many points for a verdict"
    if lost:
        return "the points do not move like the joints of one body whose limbs swing in planes"
    return "no stretch of frames shows motion in planes"


def _about_links(figure: Any, names: list[str]) -> list[str]:
    """One line for each link."""
    verdicts, windows, lines = figure.verdicts(), len(figure.interpreted), []
    for link in figure.links():
        sure = "" if math.isnan(link.confidence) else f", confidence {link.confidence:.0%}"
        counts = verdicts[link.a, link.b]
        if link.windows == windows and len(counts) == 1:
            judged = link.verdict
        else:
            judged = ", ".join(f"{verdict} in {number}" for verdict, number in counts.items())
            judged += f" of {counted(windows, 'window')}"
        lines.append(f"  {names[link.a]} - {names[link.b]}: {link.length_px:.0f} px long{sure}, {judged}")
    if any("not planar" in counts for counts in verdicts.values()):
        lines.append('"not planar": the limb leaves its plane; its length and depth are less exact.')
    return lines
