"""Several people in one video: the whole chain on drawn people who cross, told apart by `person`."""

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
    assert "Walk 2 (person 2): value" in page and "Heel strikes and toe-offs of person 2" in page
