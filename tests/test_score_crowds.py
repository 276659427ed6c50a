"""The trackers of boxes beside which memo is scored, and the score itself, on planted boxes."""

import numpy as np
import pytest
import score_crowds as crowds


def moving(frames=40, hidden=range(18, 22)):
    """Two boxes of 30 by 80 pixels that pass each other; the second is not seen for some frames."""
    truth = []
    for frame in range(1, frames + 1):
        truth.append((frame, 1, np.array([10.0 + 8 * frame, 50, 30, 80])))
        if frame not in hidden:
            truth.append((frame, 2, np.array([340.0 - 8 * frame, 90, 30, 80])))
    return truth


def regions(rows, frames=40):
    return [
        np.array([box for at, _, box in rows if at == frame]).reshape(-1, 4) for frame in range(1, frames + 1)
    ]


def test_what_is_true_scores_one_and_nothing_scores_nothing():
    truth = moving()
    score = crowds.scored(truth, truth)
    assert (score["mota"], score["idf1"], score["num_switches"], score["recall"]) == (1, 1, 0, 1)
    assert crowds.scored(truth, [])["recall"] == 0
    shifted = [(frame, identity, box + np.array([20, 0, 0, 0])) for frame, identity, box in truth]
    assert crowds.scored(truth, shifted)["recall"] < 0.2
    assert crowds.share_on_somebody(truth, truth) == {1: 1.0, 2: 1.0}


def test_overlaps_are_intersections_over_unions():
    boxes = np.array([[0, 0, 10, 10], [5, 0, 10, 10], [20, 20, 1, 1]], float)
    assert crowds.overlaps(boxes, boxes)[0] == pytest.approx([1, 1 / 3, 0])
    assert crowds.overlaps(boxes, np.empty((0, 4))).shape == (3, 0)


@pytest.mark.parametrize("follow", [crowds.by_kalman, crowds.by_nearest])
def test_boxes_that_move_evenly_are_followed(follow):
    truth = moving(hidden=())
    score = crowds.scored(truth, follow(regions(truth)))
    assert score["mota"] > 0.9 and score["num_switches"] == 0 and score["people"] == 2


def test_a_filter_leads_over_a_gap_and_the_nearest_box_does_not():
    truth = moving()
    kalman, nearest = (
        crowds.scored(truth, follow(regions(truth))) for follow in (crowds.by_kalman, crowds.by_nearest)
    )
    assert kalman["people"] == 2 and kalman["num_switches"] == 0
    assert nearest["people"] == 3


def test_regions_are_those_that_change():
    frames = np.full((9, 120, 160), 90, np.uint8)
    for k, frame in enumerate(frames):
        frame[30:90, 15 * k : 15 * k + 20] = 200
    found = crowds.regions_of(list(frames))
    assert all(np.abs(boxes[0] - [15 * k, 30, 20, 60]).max() <= 3 for k, boxes in enumerate(found))


def test_strikes_are_told_by_who_walks_there_and_by_their_side():
    truth = [(frame, identity, box) for frame, identity, box in moving() if identity == 1]
    rows = [(frame, 7, box + 1) for frame, _, box in truth]
    marked = [crowds.Strike(5.5, 1, "right"), crowds.Strike(18.0, 1, "left"), crowds.Strike(30.0, 1, "right")]
    found = [
        crowds.Strike(6.5, 7, "right"),
        crowds.Strike(17.0, 7, "right"),
        crowds.Strike(18.0, 3, "left"),
        crowds.Strike(38.0, 7, "right"),
    ]
    assert crowds.strike_errors(marked, found, truth, rows) == (3, [(1.0, True), (-1.0, False)])
    elsewhere = [(frame, 7, box + 100) for frame, _, box in truth]
    assert crowds.strike_errors(marked, found, truth, elsewhere) == (0, [])


def test_who_walks_to_the_right_shows_the_right_foot():
    marked = crowds.marked_strikes(crowds.STRIKES["tud_stadtmitte"])
    assert len(marked) == 25 and {strike.person for strike in marked} == {2, 4, 7, 10}
    assert marked[0] == crowds.Strike(8.5, 2, "left") and marked[1] == crowds.Strike(21.5, 2, "right")
    assert [strike.side for strike in marked if strike.person == 7][:2] == ["right", "left"]
