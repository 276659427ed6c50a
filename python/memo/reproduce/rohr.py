"""Rohr (1994): constants and equations, the model, and every figure in kind.

The paper's sequences are not published. Numbers that follow from the text are computed; results on
a sequence are shown for the synthetic scene of `memo demo`, or for a given video.
"""

from __future__ import annotations

import numpy as np

from memo import _memo
from memo.reproduce.result import (
    EQUAL,
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
from memo.reproduce.rohr_figures import figures, similarity_peaks, start_outliers
from memo.reproduce.sequence import Clip, NobodyTracked, Sequence, clip_sequence, scene_sequence

__all__ = ["Clip", "NobodyTracked", "rohr"]

NOTE = """Numbers and equations are computed by the code of the tracker. The paper prints neither its gait
samples (Murray's averages at ten instants) nor its body sizes, and its image sequences are not published:
figures are made in kind, on the synthetic scene of `memo demo` (drawn with the model that tracks it, as the
paper's synthetic sequence was) or on a given video. They are not the paper's figures."""

CURVES = ("hip", "knee", "shoulder", "elbow")


def rohr(clip: Clip | None = None, progress: Progress = unseen) -> Reproduction:
    """Every number, equation and figure of Rohr (1994); figures of real sequences from `clip`, if given.

    Raises `NobodyTracked` if nobody is tracked in the clip.
    """
    filmed = clip_sequence(clip, progress) if clip is not None else None
    scene = scene_sequence(progress)
    progress("rohr: numbers and equations", 0, None)
    numbers, deviations = dict(_memo.rohr_numbers()), dict(_memo.rohr_deviations(0))
    rows = [
        *_model_rows(numbers, deviations),
        *_image_rows(numbers, deviations, filmed or scene),
        *_matching_rows(deviations, filmed or scene),
        *_start_rows(numbers, filmed, scene),
        *_filter_rows(numbers, deviations),
        *_result_rows(filmed, scene),
        *_cannot_rows(filmed),
    ]
    return Reproduction(
        "rohr",
        "Rohr 1994, Towards Model-Based Recognition of Human Movements in Image Sequences",
        NOTE,
        rows,
        figures(scene, filmed),
        [_sample_table(), _body_table()],
    )


def _on(sequence: Sequence) -> str:
    return f"in kind, on {sequence.label}; the paper's sequence is not published"


# Section 3: the model.


def _model_rows(numbers: dict[str, float], deviations: dict[str, float]) -> list[Row]:
    return [
        compared("section 3.1", "cylinders of the body", "14", numbers["parts"]),
        compared("section 3.1", "of arms and legs, three each", "12", numbers["arm_and_leg_parts"]),
        compared("section 3.1", "parameters of a cylinder", "3", len(_memo.body_parts(1.75)[0]) - 1),
        compared(
            *("section 3.1", "printed inverse of A times A, minus I", EQUAL, deviations["inverse"]),
            "largest element, 100 rigid transforms",
            within=1e-9,
        ),
        compared(
            *(
                "section 3.1",
                "printed A_i A_i+1 minus the product of matrices",
                EQUAL,
                deviations["product"],
            ),
            "largest element, 100 pairs",
            within=1e-9,
        ),
        compared(
            *("section 3.2", "splines through ten samples minus the samples, degrees", EQUAL),
            deviations["spline_samples_deg"],
            "ten samples of a sine of 60 degrees; periodic cubic spline",
            within=1e-9,
        ),
        compared(
            *("section 3.2", "left side minus right side half a cycle later, degrees", EQUAL),
            deviations["left_half_cycle_later_deg"],
            "all four joints, 100 phases: one parameter fixes the posture",
            within=1e-9,
        ),
        cannot(
            *("section 3.2", "ten angles of shoulder, elbow, hip and knee", "not printed"),
            "taken from Murray's averages; gait_samples.csv has memo's, of another public data set",
        ),
        cannot(
            *("section 3.1", "sizes of the 14 cylinders", "not printed"),
            "measured on a clothed person; body_parts.csv has memo's, by Drillis and Contini 1966",
        ),
        cannot(
            "section 3.2",
            "subjects of the gait study",
            "60 men, 20 to 65 years",
            "a cited study (Murray 1964)",
        ),
    ]


def _sample_table() -> Table:
    samples, dense = (
        _memo.gait_curves(gait, [k / 10 for k in range(10)]) for gait in ("sampled_10", "dense")
    )
    header = ["phase", *(f"{name}_deg" for name in CURVES), *(f"{name}_of_50_samples_deg" for name in CURVES)]
    rows = [
        [f"{k / 10:.1f}", *(f"{v:.2f}" for v in (*ten[:4], *fifty[:4]))]
        for k, (ten, fifty) in enumerate(zip(samples, dense, strict=True))
    ]
    return Table("gait_samples", header, rows)


def _body_table() -> Table:
    rows = [[name, *(f"{size:.4f}" for size in sizes)] for name, *sizes in _memo.body_parts(1.75)]
    return Table("body_parts", ["part", "length_m", "semi_axis_front_m", "semi_axis_side_m"], rows)


# Sections 4.1 and 4.2: change detection and position.


def _image_rows(numbers: dict[str, float], deviations: dict[str, float], shown: Sequence) -> list[Row]:
    soles = shown.soles_m()
    away_m = shown.camera.camera_from_world(soles)[:, 2]
    scatter = f"{_on(shown)}; from the rectangles only"
    return [
        compared("section 4.1", "grey values in the 5x5 window", "25", numbers["window_px"]),
        compared(
            *("section 4.1", "parameters of a polynomial of second order", "6", numbers["fit_parameters"]),
            f"so X X* has rank {numbers['rank']:g}",
        ),
        compared(
            *(
                "eq. (1)",
                "norm of two fits' difference minus the norm computed",
                EQUAL,
                deviations["eq_1"],
            ),
            "relative, 100 pairs of random windows; memo fits the difference once, in integers",
            within=1e-5,
        ),
        compared(
            *("eq. (6)", "T* X* + b* over its largest term", EQUAL, deviations["eq_6"]),
            "100 people seen by random cameras; six equations, five unknowns",
            within=1e-9,
        ),
        compared(
            *("eqs. (3)-(6)", "position from the rectangle minus the true one, metres", EQUAL),
            *(deviations["eq_6_position_m"], "exact midpoints"),
            within=1e-9,
        ),
        in_kind(
            *("section 4.2, Fig. 15", "distance covered in X, metres", "about 4.5"),
            *(f"{np.ptp(soles[:, 0]):.1f}", scatter),
        ),
        in_kind(
            *("section 4.2, Fig. 15", "distances from the camera, metres", "10.9 to 12.6"),
            *(f"{away_m.min():.1f} to {away_m.max():.1f}", scatter),
        ),
    ]


# Section 4.3: matching.


def _matching_rows(deviations: dict[str, float], shown: Sequence) -> list[Row]:
    rows = [
        compared(
            *(
                "eq. (7)",
                "s_i as printed minus the score used, over l",
                EQUAL,
                deviations["eq_7"],
            ),
            "200 pairs of contour and edge",
            within=1e-5,
        ),
        compared(
            *("eqs. (7), (8)", "the two forms of s_i, difference over l", EQUAL, deviations["eq_8"]),
            "200 pairs",
            within=1e-9,
        ),
        compared(
            *("eq. (8)", "change of the exponent if everything is three times as large", EQUAL),
            *(deviations["eq_8_scale"], "the exponent does not depend on the scale"),
            within=1e-9,
        ),
        compared(
            *(
                "eqs. (9), (10)",
                "growth of Lowe's measure (10) if everything is twice as large",
                "independent of scale (1)",
            ),
            *(
                deviations["eq_10_scaled_twice"],
                f"independent of scale; (9) grows {deviations['eq_9_scaled_twice']:g} times",
            ),
        ),
        compared(
            *(
                "eq. (11)",
                "1 - s(p) if every contour is an edge",
                EQUAL,
                deviations["eq_11_perfect"],
            ),
            "the sum is normalised by the contours' lengths",
            within=1e-5,
        ),
    ]
    for item, look, printed in zip(
        ("section 4.3, Fig. 19", "section 4.3, Fig. 21"),
        shown.examples,
        ("0.55 and 0.05", "not printed"),
        strict=True,
    ):
        best, other, apart = similarity_peaks(shown, look)
        rows.append(
            in_kind(
                *(item, "best pose, and the best half a cycle away", printed),
                f"{best:.2f} and {other:.2f}, {apart:.2f} apart",
                f"{_on(shown)}, frame {look.frame}; fixed position, pose over the whole cycle",
            )
        )
    return rows


# Section 5.1: the start.


def _start_rows(numbers: dict[str, float], filmed: Sequence | None, scene: Sequence) -> list[Row]:
    rows = [
        compared("section 6", "images of the start (numbers 2 to 14)", "13", numbers["start_images"]),
        compared(
            *("section 5.1", "their part of a walking cycle, about", "0.5", numbers["start_cycles"]),
            "13 images at 25 per second, a cycle of 1 s",
            within=0.05,
        ),
        compared("section 5.1", "search space of pose at the start", "1", numbers["interval_pose_start"]),
    ]
    for item, sequence, printed in (
        ("Fig. 23", scene, "1 (image 10), about half a cycle"),
        ("Fig. 24", filmed, "much higher than in Fig. 23"),
    ):
        if sequence is not None:
            count, of = start_outliers(sequence)
            rows.append(
                in_kind(
                    *(item, "single images over a quarter cycle off the line of the start", printed),
                    *(f"{count} of {of}", _on(sequence)),
                )
            )
    return rows


# Section 5.2 and 6: the filter.


def _filter_rows(numbers: dict[str, float], deviations: dict[str, float]) -> list[Row]:
    counts = [int(numbers[name]) for name in ("n_x", "n_y", "n_pose")]
    is_as_printed = all(
        n % 2 == 1 and abs(n - printed) <= 1 for n, printed in zip(counts, (20, 10, 20), strict=True)
    )
    slip = "printed per image², a mistake: it is a variance of a position"
    return [
        compared(
            *("eqs. (12)-(22)", "eight-state filter as printed minus the filters used", EQUAL),
            *(deviations["eqs_12_22"], "largest of states and covariances over 50 images"),
            within=1e-9,
        ),
        compared(
            *("section 6", "average velocity of X, cm/image", "6.4", numbers["x_per_image_cm"]),
            "1.6 m per cycle of 1 s, 25 images per second",
        ),
        compared(
            *("section 6", "average velocity of pose, 1/image", "0.04", numbers["pose_per_image"]),
            "a cycle of 1 s, 25 images per second",
        ),
        compared(
            *("section 6", "sigma_QX squared, cm²/image²", "3.69", numbers["sigma_q_x_sq"]),
            f"30 % of 6.4 squared is {numbers['sigma_q_x_sq_from_text']:.4f}; the value in the filter",
        ),
        compared("section 5.2", "sigma_QY squared", "0", numbers["sigma_q_y_sq"], "the height is constant"),
        compared(
            *("section 6", "sigma_Qpose squared, 1/image²", "0.000144", numbers["sigma_q_pose_sq"]),
            "30 % of 0.04 squared; the value in the filter",
        ),
        compared("section 6", "sigma_RX squared, cm²", "400", numbers["sigma_r_x_sq"], slip),
        compared("section 6", "sigma_RY squared, cm²", "100", numbers["sigma_r_y_sq"], slip),
        compared("section 6", "sigma_Rpose squared", "0.04", numbers["sigma_r_pose_sq"], slip),
        compared("section 6", "2ΔX, cm", "40", np.round(numbers["interval_x_cm"], 9)),
        compared("section 6", "2ΔY, cm", "20", np.round(numbers["interval_y_cm"], 9)),
        compared("section 6", "2Δpose", "0.4", numbers["interval_pose"]),
        Row(
            *("section 6", "points n_X = [ΔX], n_Y = [ΔY], n_pose = [100 Δpose], odd", "[20] [10] [20]"),
            f"{' '.join(map(str, counts))}, {int(numbers['hypotheses'])} hypotheses per image",
            Verdict.SAME if is_as_printed else Verdict.DIFFERS,
            "every 2 cm and 0.02 of the intervals, ends included: the odd numbers next to the printed ones",
        ),
        in_kind(
            *("section 5.1", "hypotheses per image at the start", "not printed"),
            f"{int(numbers['hypotheses_start'])}",
            "the same steps, the whole cycle at 50 phases",
        ),
    ]


# Section 6: results.


def _result_rows(filmed: Sequence | None, scene: Sequence) -> list[Row]:
    measured, filtered = scene.walk.measured, _memo.walk_filtered(scene.walk)
    rows = []
    for column, (name, unit, scale) in enumerate(
        (("x_m", "cm", 100), ("z_m", "cm", 100), ("phase", "cycles", 1))
    ):
        truth = scene.true(name)
        errors = []
        for values in (measured[:, column], filtered[:, column]):
            off = values - truth
            off = (off + 0.5) % 1 - 0.5 if name == "phase" else off
            errors.append(scale * float(np.sqrt(np.nanmean(off**2))))
        letter = {"x_m": "X", "z_m": "Y", "phase": "pose"}[name]
        rows.append(
            in_kind(
                *("Fig. 26", f"{letter} measured and after the Kalman filter, RMS from the truth, {unit}"),
                "fairly good agreement",
                " and ".join(f"{error:.2g}" for error in errors),
                f"{_on(scene)}; printed variances, no smoothing; the distance is fixed at the start,"
                " as in the paper",
            )
        )
    for item, sequence, label in (("Fig. 27", scene, "synthetic"), ("Figs. 28-31", filmed, "real")):
        if sequence is None:
            continue
        frames = sequence.track.columns["frame"]
        rows.append(
            in_kind(
                *(
                    item,
                    f"images in which the pedestrian is tracked, {label} sequence",
                    "the whole sequence",
                ),
                *(f"{len(frames)}, numbers {frames[0]} to {frames[-1]}", _on(sequence)),
            )
        )
    legs = {name: length for name, length, *_ in _memo.body_parts(scene.height_m)}
    leg_cm = 100 * (legs["RightThigh"] + legs["RightShank"])
    low, high = (leg_cm * np.radians(angle) for angle in (3, 5))
    rows.append(
        in_kind(
            *(
                "section 6, Figs. 32, 33",
                "displacement of the ankle by 3 to 5 degrees at the hip",
                "relatively large changes",
            ),
            *(f"{low:.0f} to {high:.0f} cm", "thigh and shank of memo's body, times the angle"),
        )
    )
    return rows


def _cannot_rows(filmed: Sequence | None) -> list[Row]:
    rows = [
        cannot(
            "Figs. 1-3",
            "rigid and nonrigid objects, interpretation cycles",
            "diagrams",
            "ideas, without data",
        ),
        cannot(
            "Figs. 34, 35",
            "pedestrian with cyclist, with car",
            "2 figures",
            "models of bicycle and car are not described",
        ),
        cannot("sections 4-6", "the paper's own sequences f2, f3 and synthetic", "figures", "not published"),
        cannot(
            "section 4.3",
            "c_l, c_d, c_r, sigma of the angle, T of eq. (1)",
            "not printed",
            "memo has its own values",
        ),
        cannot(
            *("Figs. 32, 33", "dashed curves adjusted by hand", "curves"),
            "made by hand on the paper's sequence; if the truth is known, it is drawn instead",
        ),
    ]
    if filmed is None:
        rows.append(
            cannot(
                "Figs. 24, 25, 28-31",
                "results on real sequences",
                "6 figures",
                "give a video: --video and --height",
            )
        )
    return rows
