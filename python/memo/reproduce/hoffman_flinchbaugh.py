"""Hoffman and Flinchbaugh (1982): both propositions as counts over random problems, the scheme on a point-
light walker, and the figures.

The paper has no data: its numbers are numbers of views, equations and solutions. So nearly every row is a
statement, counted here over problems drawn from a seed.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from memo import _memo
from memo.linkage import PlanarFigure, planar
from memo.linkage_plot import COLOURS
from memo.plot import LEFT, NEUTRAL, RIGHT
from memo.reproduce.result import (
    EQUAL,
    Drawing,
    Progress,
    Reproduction,
    Row,
    Table,
    Verdict,
    cannot,
    compared,
    in_kind,
    unseen,
)
from memo.wording import counted

__all__ = ["hoffman_flinchbaugh"]

TRIALS = 20_000
SEARCHED = 500
SEED = 1982

NOTE = f"""The paper prints statements and equations, no data. They are counted here over {TRIALS} rods seen
three times and {TRIALS} hinges seen twice, drawn from a seed: the tilt of the plane between 5 and 85
degrees, all angles uniform. "In kind" rows use a synthetic point-light walker, since Johansson's films
are not published. Counts hold for the problems drawn; they are not proofs."""

# Arms and legs, in the names of point-light displays.
LINKS = {frozenset(f"{side}{joint}" for joint in pair) for side in "RL" for pair in
         (("SH", "EL"), ("EL", "WR"), ("HP", "KN"), ("KN", "AN"))}  # fmt: skip
AZIMUTH_DEG = 60.0
PX_PER_M = 200.0

NEAR = "are so near a degenerate case that double precision does not reach 1e-6"

Array = npt.NDArray[np.float64]


def hoffman_flinchbaugh(progress: Progress = unseen) -> Reproduction:
    """Every statement and figure of Hoffman and Flinchbaugh (1982) that can be computed."""
    progress("hoffman-flinchbaugh: rods", 0, 3)
    rods = _memo.hoffman_flinchbaugh_rods(TRIALS, SEED)
    progress("hoffman-flinchbaugh: hinges", 1, 3)
    hinges = _memo.hoffman_flinchbaugh_hinges(TRIALS, SEARCHED, SEED)
    false_rods, false_hinges = _memo.hoffman_flinchbaugh_false_targets(TRIALS, SEED)
    degenerate = _memo.hoffman_flinchbaugh_degenerate(1000, SEED)
    progress("hoffman-flinchbaugh: point-light walker", 2, 3)
    walker = _Walker()
    rows = [
        *_proposition_1(rods),
        *_proposition_2(hinges),
        *_false_targets(false_rods, false_hinges),
        *_degenerate_rows(rods, degenerate),
        *_linking_rows(hinges),
        *walker.rows(),
        *_cannot_rows(),
    ]
    return Reproduction(
        "hoffman-flinchbaugh",
        "Hoffman and Flinchbaugh 1982, The Interpretation of Biological Motion",
        NOTE,
        rows,
        _figures(walker),
        [walker.table()],
    )


def _share(count: int, of: int) -> str:
    return f"{count} of {of} ({100 * count / of:.2f} %)"


def _counted(
    item: str,
    quantity: str,
    printed: str,
    count: int,
    of: int,
    why: str,
    *,
    rest: str = "",
    least: float = 0.99,
) -> Row:
    """A claim of the paper about every problem: "same" if it holds for `least` of those drawn."""
    verdict = Verdict.SAME if count >= least * of else Verdict.DIFFERS
    bound = "holds for all drawn" if count == of else f"holds for at least {100 * least:g} % of those drawn"
    said = f"{bound}; {why}" if verdict is Verdict.SAME else why
    if rest and count < of:
        said = f"{said}; the rest {rest}"
    return Row(item, quantity, printed, _share(count, of), verdict, said)


# Appendix 1.


def _proposition_1(rods: _memo.RodTrials) -> list[Row]:
    return [*_recovered_rods(rods), *_steps_of_the_proof(rods)]


def _recovered_rods(rods: _memo.RodTrials) -> list[Row]:
    trials = rods.trials
    return [
        _counted(
            *("Proposition 1", "rods recovered from three views, up to the mirror", "all"),
            *(rods.recovered, trials, "depths within 1e-6 of the length"),
            rest=NEAR,
        ),
        _counted(
            *("Proposition 1", "the same by the ellipse of footnote 14 (Horn)", "all"),
            *(rods.recovered_by_ellipse, trials, "linear in the form of the ellipse"),
            rest=NEAR,
        ),
        _counted(
            *("Proposition 1", "the same by eqs. (4)-(14) in the printed order", "all"),
            *(rods.recovered_as_printed, trials, "(14) loses digits near k1 = 0 and k3 = 0"),
            rest=NEAR,
        ),
    ]


def _steps_of_the_proof(rods: _memo.RodTrials) -> list[Row]:
    trials = rods.trials
    where = "appendix 1"
    return [
        compared(
            *(f"{where}, eq. (6)", "[a1 a2 a3] minus (k3 z1 + k4 z2 + k5 z3), largest", EQUAL),
            *(
                rods.triple_product_error,
                f"{counted(trials, 'triple')} of vectors with the k's of footnote 11",
            ),
            within=1e-12,
        ),
        compared(
            *(
                f"{where}, Jacobian",
                "determinant minus 4 (k3 z2 z3 + k4 z1 z3 + k5 z1 z2), largest",
                EQUAL,
            ),
            *(rods.jacobian_error, "the printed determinant, expanded; footnote 12 uses its factors"),
            within=1e-12,
        ),
        _counted(
            *(f"{where}, Jacobian", "rods whose Jacobian has rank 3", "rank three"),
            *(rods.full_rank, trials, "smallest singular value over 1e-9 of the largest"),
        ),
        _counted(
            *(f"{where}, claim", "rods with exactly one valid root x of eq. (9)", "at most one"),
            *(
                rods.one_root,
                trials,
                "a root is valid if z3 is real and (6) is met within 1e-6: of the four solutions that Bezout"
                " allows, a mirror pair is left",
            ),
            least=0.98,
        ),
        Row(
            *(f"{where}, after (14)", "of z3 = ± with z1 = + sqrt(z3^2 - k2), those that meet (6)", "both"),
            f"one of the two: + in {rods.printed_z1}, - in {trials - rods.printed_z1} of {trials}",
            Verdict.DIFFERS,
            "(5) does not determine the sign of z1, (6) does; the mirror has the other sign",
        ),
        _counted(
            *("section 6", "rods never seen longer than 0.9 of their length, recovered", "all"),
            *(rods.never_extended_recovered, rods.never_extended),
            "maximal extension need not be visible, as predicted",
        ),
    ]


# Appendix 2.


def _proposition_2(hinges: _memo.HingeTrials) -> list[Row]:
    trials = hinges.trials
    return [
        _counted(
            *("Proposition 2", "hinges recovered from two views, up to the mirror", "all"),
            *(hinges.recovered, trials),
            "depths within 1e-6 of the length",
            rest=NEAR,
        ),
        _counted(
            *("Proposition 2", "hinges with exactly one plane, up to the mirror", "all"),
            *(hinges.one_plane, hinges.searched),
            f"by search over all directions of slope, without the closed form; largest number of planes:"
            f" {hinges.most_planes}. The paper omits its proof",
            rest="have their plane so near another change of sign that steps of 0.025 degrees miss it",
            least=0.97,
        ),
        _counted(
            *("appendix 2, Jacobian", "hinges whose Jacobian has rank 4", "rank four"),
            *(hinges.full_rank, trials, "smallest singular value over 1e-9 of the largest"),
        ),
    ]


# False targets, degenerate cases, linking.


def _false_targets(rods: int, hinges: int) -> list[Row]:
    why = (
        "the claim cannot hold for the smallest number of views, which has as many equations as unknowns; it"
        " needs more views and a test with a stated rate, as in `memo planar`"
    )
    return [
        Row("section 6", name, "probability zero", _share(count, TRIALS), Verdict.DIFFERS, why)
        for name, count in (
            ("unrelated pairs of points read as a rod, three views", rods),
            ("unrelated triples of points read as a hinge, two views", hinges),
        )
    ]


def _degenerate_rows(rods: _memo.RodTrials, degenerate: list[tuple[str, int]]) -> list[Row]:
    paper = {
        "rod in a plane parallel to the image": "degenerate",
        "rod in a plane seen edge-on": "degenerate (collinear)",
        "rod with two opposite images": "degenerate (collinear)",
        "hinge with one rod that does not move": "not mentioned",
    }
    rows = [
        Row(
            *("appendix 1, claim", name, paper[name], f"{count} of 1000 refused"),
            Verdict.SAME if paper[name] != "not mentioned" and count == 1000 else Verdict.DIFFERS,
            "refused by name, with the reason"
            if paper[name] != "not mentioned"
            else "two distinct projections of the figure do not suffice: each rod must have moved",
        )
        for name, count in degenerate
    ]
    one, of = rods.equal_images_one_root, rods.equal_images
    rows.append(
        Row(
            *("appendix 1, claim", "k1 = k2 without parallel plane or collinear images", "degenerate"),
            f"one root is valid in {_share(one, of)}",
            Verdict.DIFFERS,
            "views 2 and 3 mirrored in the ellipse's axis have k1 = k2, and only one of x = 1 and x = -1 is"
            " real: such views are not degenerate",
        )
    )
    return rows


def _linking_rows(hinges: _memo.HingeTrials) -> list[Row]:
    trials = hinges.trials
    return [
        _counted(
            *("section 6, linking", "ankle, knee, hip: read with the knee as the joint", "an interpretation"),
            *(hinges.joint_in_the_middle, trials, "two views, exact"),
        ),
        Row(
            *("section 6, linking", "the same with the ankle as the joint", "no interpretation"),
            f"an interpretation in {_share(hinges.joint_at_an_end, trials)}",
            Verdict.DIFFERS,
            "two views cannot contradict: see false targets. More views give the links (next rows)",
        ),
    ]


class _Walker:
    """A point-light walker and the linkage found in it, as it is and with scrambled starting times."""

    def __init__(self) -> None:
        motion = _memo.walker_motion(frames=90, rate_hz=60.0)
        self.names: list[str] = list(motion.names)
        self.times_s: Array = np.asarray(motion.times_s)
        self.lengths_m = {
            link: float(
                np.linalg.norm(np.subtract(*(motion.positions[0, self.names.index(n)] for n in link)))
            )
            for link in LINKS
        }
        self.shown = {
            "as it is": self._display(motion),
            "starting times scrambled": self._display(
                motion, scramble_phase="periodic", period_s=motion.cycle_s
            ),
        }
        self.found = {name: self._read(tracks, 0.0) for name, tracks in self.shown.items()}
        self.at_1_px = self._read(self._display(motion, noise_sd_px=1.0), 1.0)

    def _display(self, motion: _memo.WalkerMotion, **conditions: Any) -> Array:
        shown = _memo.pointlight(
            motion.positions,
            motion.times_s,
            motion.names,
            azimuth_deg=AZIMUTH_DEG,
            px_per_m=PX_PER_M,
            seed=SEED,
            **conditions,
        )
        order = np.argsort(shown.labels[0])  # a dot shows the same point in all frames
        return np.asarray(shown.positions_px[:, order])

    def _read(self, tracks: Array, noise_px: float) -> PlanarFigure:
        return planar(tracks, self.times_s, noise_px, window_s=1.4)

    def links(self, found: PlanarFigure) -> dict[frozenset[str], float]:
        """Links of the first interpreted window with their lengths in metres."""
        if not found.interpreted:
            return {}
        return {
            frozenset(self.names[point] for point in link.points): link.length / PX_PER_M
            for chain in found.interpreted[0].chains
            for link in chain.links
        }

    def rows(self) -> list[Row]:
        on = (
            f"synthetic walker seen from {AZIMUTH_DEG:g} degrees aside, without names; Johansson's films are"
            " not published"
        )
        links = self.links(self.found["as it is"])
        errors = [abs(links[link] / self.lengths_m[link] - 1) for link in LINKS & set(links)]
        noisy = self.links(self.at_1_px)
        scrambled = self.links(self.found["starting times scrambled"])
        return [
            in_kind(
                *("section 6, linking", "links of arms and legs found in the moving dots", "the right ones"),
                f"{len(LINKS & set(links))} of {len(LINKS)}, and {len(set(links) - LINKS)} others",
                f"{on}; with 1 px of noise {len(LINKS & set(noisy))} of {len(LINKS)}, and"
                f" {len(set(noisy) - LINKS)} others",
            ),
            in_kind(
                *("section 4", "three-dimensional length of each limb segment", "computed"),
                f"within {max(100 * max(errors, default=float('nan')), 0.001):.2g} % of the truth",
                f"{on}; exact dots",
            ),
            in_kind(
                *("section 6", "links found when each dot starts at another time of the cycle", "none"),
                f"{len(scrambled)}",
                "planarity without rigid links: the scheme must give no interpretation",
            ),
        ]

    def table(self) -> Table:
        exact, noisy = (self.links(found) for found in (self.found["as it is"], self.at_1_px))
        rows = [
            [
                " ".join(sorted(link)),
                f"{length:.4f}",
                *(f"{of[link]:.4f}" if link in of else "" for of in (exact, noisy)),
            ]
            for link, length in sorted(self.lengths_m.items(), key=lambda item: sorted(item[0]))
        ]
        return Table("links", ["link", "length_m", "found_m", "found_at_1_px_m"], rows)


def _cannot_rows() -> list[Row]:
    people = "an experiment with people, not a computation"
    return [
        cannot("section 2", "dots seen as a walker", "within 100-1000 ms", people),
        cannot("section 6", "perception without maximal extension", "not at all reduced", people),
        cannot(
            *("section 6", "Johansson's dancing couple", "interpreted in part"),
            "the film is not published; the test of `memo planar` refuses points that leave their plane",
        ),
        cannot(
            *("section 5", "four points, three views: Ullman's rigidity theorem", "unique"),
            "cited, not proved there; memo has no rigid bodies of four points",
        ),
        cannot(
            *("section 6", "motion from known lengths where planarity fails", "inferred uniquely"),
            "stated without proof; in one view each rod of known length has two ends, so a hinge has four"
            " readings (two up to the mirror): only motion over time decides, as in `memo posture`",
        ),
        cannot(
            "section 5",
            "pairwise-rigid structures without planarity",
            "infinitely many",
            "the number is infinite",
        ),
        cannot("footnote 8", "a local network", "no numbers", "described elsewhere (Hoffman 1981)"),
    ]


# The figures.

# A rod in the plane z = 0.9 x + 0.5 y at three angles, and a hinge in it: for Figs. 3 to 6.
SLOPE = np.array([0.9, 0.5])
ROD_DEG = (-35.0, 20.0, 80.0)


def _in_plane(angle_deg: float, length: float = 1.0) -> Array:
    """The vector (3,) of a length at an angle in the plane, from its line of steepest slope."""
    steep = SLOPE / np.linalg.norm(SLOPE)
    cos_tilt = 1 / np.sqrt(1 + SLOPE @ SLOPE)
    angle = np.radians(angle_deg)
    image = np.cos(angle) * cos_tilt * steep + np.sin(angle) * np.array([-steep[1], steep[0]])
    return length * np.append(image, SLOPE @ image)


def _figures(walker: _Walker) -> list[Drawing]:
    example = "Example in a plane chosen here; the paper's drawing has no numbers"
    dots = "Synthetic walker; Johansson's films are not published"
    return [
        Drawing(
            *(
                "fig1",
                "Fig. 1",
                "A frame of a point-light walker: the dots, and the links found in the moving dots",
            ),
            *(lambda figure: _draw_dots(figure, walker), (7, 5), dots),
        ),
        Drawing(
            *("fig2", "Fig. 2", "The four descriptions of the input, and memo's methods for each"),
            *(_draw_inputs, (8, 3.6), "A scheme; its cells are memo's functions"),
        ),
        Drawing(
            "fig3",
            "Fig. 3",
            "Two rods with a common joint, moving in one plane",
            _draw_hinge,
            (6, 5),
            example,
        ),
        Drawing(
            *("fig4", "Fig. 4", "Three views of a rod: its ends in space and their images"),
            *(lambda figure: _draw_views(figure, [[_in_plane(a) for a in ROD_DEG]]), (6, 5.5), example),
        ),
        Drawing(
            *("fig5", "Fig. 5", "The solutions for z1, z2, z3: two hyperbolic sheets cut a plane"),
            *(_draw_solutions, (10.5, 5.2), f"{example}; with the k's of footnote 11 of the rod in Fig. 4"),
        ),
        Drawing(
            *("fig6", "Fig. 6", "Two views of a hinge: its ends in space and their images"),
            *(
                lambda figure: _draw_views(
                    figure, [[_in_plane(a) for a in (-35, 15)], [_in_plane(a, 0.8) for a in (75, 140)]]
                ),
                (6, 5.5),
                example,
            ),
        ),
        Drawing(
            *(
                "false_targets",
                "section 6",
                "Links found in the walker as it is and with scrambled starting times",
            ),
            *(lambda figure: _draw_scrambled(figure, walker), (7, 5), dots),
        ),
    ]


def _dots(ax: Axes, places: Array) -> None:
    ax.plot(places[:, 0], places[:, 1], "o", color="black", markersize=5, zorder=3)
    ax.set(aspect="equal")
    ax.set_axis_off()


def _linked(ax: Axes, walker: _Walker, places: Array, found: PlanarFigure) -> None:
    if not found.interpreted:
        return
    for index, chain in enumerate(found.interpreted[0].chains):
        for link in chain.links:
            ends = places[list(link.points)]
            ax.plot(*ends.T, color=COLOURS[index % len(COLOURS)], linewidth=2.5)


def _draw_dots(figure: Figure, walker: _Walker) -> None:
    places = walker.shown["as it is"][len(walker.times_s) // 3]
    alone, linked = figure.subplots(1, 2, sharex=True, sharey=True)
    for ax, title in ((alone, "a  one frame"), (linked, "b  links found in all frames")):
        _dots(ax, places)
        ax.set_title(title, loc="left", fontsize=9)
    _linked(linked, walker, places, walker.found["as it is"])
    alone.invert_yaxis()
    alone.margins(x=0.3)


def _draw_scrambled(figure: Figure, walker: _Walker) -> None:
    axes = figure.subplots(1, len(walker.shown), sharex=True, sharey=True)
    for ax, (name, tracks) in zip(axes, walker.shown.items(), strict=True):
        places = tracks[len(walker.times_s) // 3]
        _dots(ax, places)
        _linked(ax, walker, places, walker.found[name])
        ax.set_title(
            f"{name}: {counted(len(walker.links(walker.found[name])), 'link')}", loc="left", fontsize=9
        )
    axes[0].invert_yaxis()
    axes[0].margins(x=0.3)


def _draw_inputs(figure: Figure) -> None:
    ax = figure.subplots()
    cells = [
        ["", "parallel projection", "central projection"],
        [
            "views at instants\n(the paper's choice)",
            "rod from three, hinge from two;\nfits of many (`memo planar`)",
            "scale and focal length of the views\n(`scales`, `focal_px`)",
        ],
        ["continuous motion", "plane from velocities\n(`memo_core::planar::motion`)", "not in memo"],
    ]
    table = ax.table(cells, loc="center", cellLoc="center")
    table.auto_set_font_size(False)
    table.set_fontsize(9)
    table.scale(1, 3.6)
    for (row, column), cell in table.get_celld().items():
        cell.set_edgecolor("#bbbbbb")
        if (row, column) == (1, 1):
            cell.set_facecolor("#fbe3d3")
    ax.set_axis_off()


def _space(figure: Figure) -> Any:
    ax: Any = figure.add_subplot(projection="3d")
    ax.set(xlabel="x", ylabel="z (depth)", zlabel="-y")
    for axis in (ax.xaxis, ax.yaxis, ax.zaxis):
        axis.pane.set_visible(False)
        axis.set_ticklabels([])
    ax.grid(False)
    ax.set_box_aspect((1, 1, 1))
    ax.view_init(elev=22, azim=-60)
    return ax


def _draw_plane(ax: Any, reach: float = 1.1) -> None:
    steep, level = _in_plane(0), _in_plane(90)
    corners = [reach * (a * steep + b * level) for a, b in ((-1, -1), (-1, 1), (1, 1), (1, -1), (-1, -1))]
    x, y, z = np.transpose(corners)
    ax.plot(x, z, -y, color="#bbbbbb", linewidth=0.8)
    ax.plot_trisurf(x[:4], z[:4], -y[:4], triangles=[[0, 1, 2], [0, 2, 3]], color="#dddddd", alpha=0.35)


def _draw_rod(ax: Any, end: Array, colour: str, label: str = "") -> None:
    x, y, z = np.transpose([[0, 0, 0], end])
    ax.plot(x, z, -y, color=colour, linewidth=2.2, marker="o", markersize=4)
    ax.text(1.08 * end[0], 1.08 * end[2], -1.08 * end[1], label, color=colour)


def _draw_hinge(figure: Figure) -> None:
    ax = _space(figure)
    _draw_plane(ax)
    _draw_rod(ax, _in_plane(-30), RIGHT, "A")
    _draw_rod(ax, _in_plane(70, 0.8), LEFT, "B")
    ax.text(0, 0, -0.15, "O")
    arc = np.array([_in_plane(a, 0.3) for a in np.linspace(-30, 70, 30)])
    ax.plot(arc[:, 0], arc[:, 2], -arc[:, 1], color="black", linewidth=0.8)
    middle = _in_plane(20, 0.42)
    ax.text(middle[0], middle[2], -middle[1], "φ")


def _draw_views(figure: Figure, rods: list[list[Array]]) -> None:
    """Rods in space, the image plane before them, and the images."""
    ax = _space(figure)
    _draw_plane(ax)
    image_at = -1.9
    frame = 1.1 * np.array([[-1, -1], [-1, 1], [1, 1], [1, -1], [-1, -1]])
    ax.plot(frame[:, 0], np.full(5, image_at), frame[:, 1], color=NEUTRAL, linewidth=0.8)
    ax.text(-1.1, image_at, 1.18, "image", color=NEUTRAL, fontsize=8)
    for letter, ends, colours in zip("ab", rods, ((RIGHT, LEFT, "#009e73"),) * 2, strict=False):
        for number, (end, colour) in enumerate(zip(ends, colours, strict=False), 1):
            _draw_rod(ax, end, colour, f"{letter}{number}")
            ax.plot(
                [0, end[0]],
                [image_at] * 2,
                [0, -end[1]],
                color=colour,
                linewidth=1.2,
                marker="o",
                markersize=3,
            )
            ax.plot(
                [end[0]] * 2, [image_at, end[2]], [-end[1]] * 2, color=colour, linewidth=0.6, linestyle=":"
            )
    ax.plot([0, 0], [image_at, 0], [0, 0], color="black", linewidth=0.6, linestyle=":")


def _draw_solutions(figure: Figure) -> None:
    """Left in space: the sheets through the solution of z1^2 - z2^2 + k1 = 0 and z1^2 - z3^2 + k2 = 0, and
    the plane k3 z1 + k4 z2 + k5 z3 = 0. Right in that plane: all sheets as curves."""
    ends = np.array([_in_plane(angle) for angle in ROD_DEG])
    printed = _memo.hoffman_flinchbaugh_rod(np.ascontiguousarray(ends[None, :, :2]))
    k1, k2, *normal = printed.k
    z = np.asarray(printed.depths)
    first = np.cross(normal, [0, 0, 1.0])
    first /= np.linalg.norm(first)
    second = np.cross(normal, first) / np.linalg.norm(normal)
    reach = 1.4
    ax: Any = figure.add_subplot(1, 2, 1, projection="3d")
    along, free = np.meshgrid(np.linspace(-reach, reach, 80), np.linspace(-reach, reach, 2))
    for constant, place, colour in ((k1, 1, RIGHT), (k2, 2, LEFT)):
        squared = along**2 + constant
        sheet = np.where(squared >= 0, np.sign(z[place]) * np.sqrt(np.maximum(squared, 0)), np.nan)
        across = [along, sheet, free] if place == 1 else [along, free, sheet]
        ax.plot_surface(*across, color=colour, alpha=0.45, linewidth=0, rcount=2, ccount=80)
    u, v = np.meshgrid([-reach, reach], [-reach, reach])
    ax.plot_surface(*(u * first[k] + v * second[k] for k in range(3)), color="#999999", alpha=0.35)
    above = np.array([0, 0, 0.12])
    for solution in (z, -z):
        ax.plot(*solution[:, None], marker="o", color="black", linestyle="none")
    ax.text(*(z + above), "solution", fontsize=9)
    ax.text(*(above - z), "its mirror", fontsize=9)
    limits = (-reach, reach)
    ax.set(xlabel="z1", ylabel="z2", zlabel="z3", xlim=limits, ylim=limits, zlim=limits)
    ax.set_box_aspect((1, 1, 1))
    ax.view_init(elev=18, azim=-35)
    ax.set_title("the sheets through the solution, and the plane", fontsize=9, loc="left")

    plane = figure.add_subplot(1, 2, 2)
    u, v = np.meshgrid(np.linspace(-reach, reach, 400), np.linspace(-reach, reach, 400))
    z1, z2, z3 = (u * first[k] + v * second[k] for k in range(3))
    for values, colour, label in (
        (z1**2 - z2**2 + k1, RIGHT, "z1² - z2² + k1 = 0"),
        (z1**2 - z3**2 + k2, LEFT, "z1² - z3² + k2 = 0"),
    ):
        plane.contour(u, v, values, levels=[0.0], colors=colour, linewidths=1.5)
        plane.plot([], [], color=colour, label=label)
    for solution in (z, -z):
        plane.plot(solution @ first, solution @ second, marker="o", color="black")
    plane.set(aspect="equal", xlabel="in the plane", ylabel="in the plane")
    plane.legend(frameon=False, fontsize=8, loc="lower left", bbox_to_anchor=(0, 1), ncols=2)
    numbers = ", ".join(f"{k:.3f}" for k in printed.k)
    figure.suptitle(
        f"k1 ... k5 = {numbers}; z1, z2, z3 = ±({z[0]:.3f}, {z[1]:.3f}, {z[2]:.3f})", fontsize=9, ha="center"
    )
