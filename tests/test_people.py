"""Several people in one video: the whole chain on drawn people who cross, told apart by `person`."""

import memo
import numpy as np
import pytest
from conftest import SHARED_DATA, ran
from memo.cycles import read_cycles_csv
from memo.explain import explain
from memo.files import read_events_csv, read_track_csv
from memo.gait import read_gait_parameters_csv
from memo.report import write_report


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """The folder of a run over two people who cross."""
    scene = SHARED_DATA / "people" / "cross2"
    if not scene.is_dir():
        pytest.skip(f"no scene in {scene} (set MEMO_SHARED_DATA)")
    folder = tmp_path_factory.mktemp("people")
    given = [scene / "video.mp4", "--camera", scene / "camera.toml"]
    ran("track", *given, "--no-overlay", "--no-plots", "--quiet", "--out", folder)
    return folder


def test_every_table_tells_the_people_apart(run):
    track = read_track_csv(run / "track.csv")
    person_of = dict(zip(track["walk"].tolist(), track["person"].tolist(), strict=True))
    assert sorted(set(person_of.values())) == [0, 1]
    gait, cycles = read_gait_parameters_csv(run / "gait_parameters.csv"), read_cycles_csv(run / "cycles.csv")
    for table in (gait, cycles):
        assert {(int(w), int(p)) for w, p in zip(table["walk"], table["person"], strict=True)} == set(
            person_of.items()
        )
    assert all(event["person"] == person_of[event["walk"]] for event in read_events_csv(run / "events.csv"))


def test_everybody_in_a_frame_is_explained(run):
    track = read_track_csv(run / "track.csv")
    frames, counts = np.unique(track["frame"], return_counts=True)
    both = frames[counts == 2]
    assert len(both) > 20
    chosen = both[:: len(both) // 4].tolist()
    whys = list(explain(run, chosen))
    assert [(why.frame, why.walk) for why in whys] == [(frame, walk) for frame in chosen for walk in (0, 1)]
    for why in whys:
        # Each model lies on its own person.
        row = np.flatnonzero((track["frame"] == why.frame) & (track["walk"] == why.walk))[0]
        middle_px = why.model.reshape(-1, 2).mean(axis=0)
        hips_px = [
            np.mean([track[f"{side}_hip_{axis}_px"][row] for side in ("right", "left")]) for axis in "uv"
        ]
        assert np.linalg.norm(middle_px - hips_px) < 40
    page = write_report(run, frames=(chosen[0], chosen[0] + 3)).path.read_text(encoding="utf-8")
    assert "Walk 1 (person 1): value" in page and "Heel strikes and toe-offs of person 1" in page


def test_two_who_come_as_one_region_are_measured_from_where_they_came():
    """A drawn person and a copy 70 pixels beside, whose walks start 12 and 36 frames later."""
    scene = memo.demo_scene(4, frames=60)
    frames = np.stack([np.asarray(frame) for frame in scene.frames]).astype(np.int16)
    empty = np.median(frames, axis=0).astype(np.int16)
    changed = np.abs(frames - empty) > 10
    beside, also_changed = (np.roll(pixels, -70, axis=2) for pixels in (frames, changed))
    both = np.where(changed, frames, np.where(also_changed, beside, empty)).astype(np.uint8)
    walks = memo.track(list(both), fps=25, camera=scene.camera, height_m=scene.height_m).walks
    assert len(walks) == 2
    off_m = []
    for columns in (walk.columns for walk in walks):
        assert columns["frame"][0] <= 4 and len(columns["frame"]) >= 54
        off_m.append(columns["x_m"] - scene.truth["x_m"][columns["frame"]])
    original, copy = sorted(off_m, key=lambda off: np.abs(np.median(off)))
    assert np.abs(original).max() < 0.05
    # Where the copy is seen, 70 pixels beside: at the same distance from it all the way.
    assert np.abs(copy - np.median(copy)).max() < 0.06
