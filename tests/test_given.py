"""What is given to commands: what is not there, lies elsewhere or would have no effect is refused."""

import re
import shlex

import pytest
from memo import batch
from memo.given import Box, InputError, Point, is_url, nothing_at, place_in_frame, tracker_options


@pytest.fixture
def command(monkeypatch, memo_command, tmp_path):
    """Runs a command in an empty folder; exit code and what is said."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")

    def run(line):
        code, said, complaint = memo_command(*shlex.split(line))
        return code, said + complaint

    return run


URLS = (
    "track {}.mp4",
    "posture k.json --camera {}.toml",
    "posture k.json --camera c.toml --lengths {}.csv",
    "planar {}.csv",
    "unswap {}.json",
    "pointlight {}.c3d",
    "convert {}.c3d b.trc",
    "convert {}.csv b.json",
    "report {}",
    "report memo-out/x --video {}.mp4",
    "batch {}.csv",
    "batch {}.toml",
    "calibrate points {}.csv --size 640x480",
    "calibrate points p.csv --picture {}.png",
    "calibrate walker {}.mp4 --height 1.7",
    "calibrate checkerboard {} --squares 9x6 --square-mm 30",
    "reproduce rohr --video {}.mp4",
)


@pytest.mark.parametrize("line", URLS)
def test_a_url_must_be_downloaded_first(command, tmp_path, line):
    url = "https://example.org/a/b"
    code, said = command(line.format(url))
    assert code == 1 and re.fullmatch(rf"memo: {url}[.\w]*: is a URL: download it first and .*\n", said), said
    assert [path.name for path in tmp_path.rglob("*") if path.is_file()] == []


def test_a_url_in_a_manifest_is_told_with_its_line(command, tmp_path):
    (tmp_path / "m.csv").write_text(
        "video,camera\nhttps://example.org/a.mp4,\nb.mp4,https://example.org/c.toml\n"
    )
    (tmp_path / "b.mp4").write_text("x")
    code, said = command("batch m.csv --check")
    assert code == 1
    first, second = said.splitlines()
    assert first.startswith("memo: m.csv, line 2: https://example.org/a.mp4: is a URL: download it first")
    assert second.startswith("memo: m.csv, line 3: https://example.org/c.toml: is a URL")


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("320,240@50", Point(320, 240, 50)),
        (" 3.5,4@0 ", Point(3.5, 4, 0)),
        ("280,120,80.5,240@50", Box(280, 120, 80.5, 240, 50)),
    ],
)
def test_somebody_is_chosen_by_a_point_or_a_box(text, place):
    found = place_in_frame(text)
    assert found == place and type(found) is type(place) and str(found) == text.strip()


@pytest.mark.parametrize(
    "text", ["3,4", "1,2,3@4", "1,2,3,4", "1,2,0,4@5", "1,2,3,-4@5", "1,2,3,4,5@6", "a,b@c"]
)
def test_what_is_neither_a_point_nor_a_box_is_refused(text):
    with pytest.raises(
        InputError, match=rf"--follow {text} is neither a point in a frame, X,Y@F .* nor a box"
    ):
        place_in_frame(text)


@pytest.mark.parametrize(
    ("path", "yes"),
    [
        ("https://x.org/a", True),
        ("https:/x.org/a", True),  # as a Path has it
        ("s3://bucket/a.mp4", True),
        ("rtsp://10.0.0.1/", True),
        ("C:/videos/a.mp4", False),
        ("a:b.mp4", False),
        ("walk.mp4", False),
        ("/https/a.mp4", False),
    ],
)
def test_urls_are_told_from_paths(path, yes):
    assert is_url(path) is yes
    assert ("URL" in nothing_at(path)) is yes


def test_a_file_called_like_a_url_is_read(command, tmp_path, write_video, luma_frames):
    (tmp_path / "https:" / "x.org").mkdir(parents=True)
    write_video("https:/x.org/a.mp4", luma_frames(count=3))
    code, said = command("track https://x.org/a.mp4 --no-overlay --no-plots --out o")
    assert code == 3 and "URL" not in said, said


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("pointlight nothere.c3d", "nothere.c3d: no such file or folder"),
        ("pointlight nothere.csv", "nothere.csv: no such file or folder"),
        ("pointlight nothere", "nothere: no such file or folder"),
        ("convert nothere.c3d a.trc", "nothere.c3d: no such file or folder"),
        ("planar nothere.csv", "nothere.csv: no such file or folder"),
        ("posture nothere.json --camera c.toml", "c.toml: no such camera file"),
        ("track nothere.mp4", "nothere.mp4: no such file"),
        ("batch nothere.csv", "nothere.csv: no such file"),
        ("report nothere", "nothere: no such folder"),
        ("calibrate points nothere.csv --size 640x480", "nothere.csv: no such file"),
    ],
)
def test_what_is_not_there_is_refused(command, tmp_path, line, says):
    assert command(line) == (1, f"memo: {says}\n")
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("pointlight --dots 3", "--dots needs --lifetime"),
        ("pointlight --on joints", "--on needs --lifetime"),
        ("pointlight --noise-kind linear", "--noise-kind needs --noise-dots"),
        ("pointlight --noise-area 2", "--noise-area needs --noise-dots"),
        ("pointlight --cycles 2 --seconds 3", "--seconds cannot be used with --cycles"),
        ("pointlight a.csv --seconds 2", "--seconds cannot be used with MOTION"),
        ("track a.mp4 --camera-unit mm", "--camera-unit needs --camera"),
    ],
)
def test_options_without_effect_are_wrong_usage(command, tmp_path, line, says):
    (tmp_path / "a.mp4").mkdir()
    assert command(line) == (2, f"memo: {says}\n")
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []


def test_how_a_camera_file_is_read_needs_one():
    reading = {"name": None, "unit": None, "size": None, "v_up": None}
    assert tracker_options(1.7, None, reading, None) == {"height_m": 1.7}
    assert tracker_options(1.7, None, reading, 60.0) == {"height_m": 1.7, "fov_deg": 60.0}
    for name, option in (("unit", "--camera-unit"), ("v_up", "--camera-v-up")):
        with pytest.raises(InputError, match=f"{option} needs --camera"):
            tracker_options(1.7, None, reading | {name: "m"}, None)


def test_dots_with_a_lifetime_are_shown(command, tmp_path):
    for options, count in (("", 8), ("--dots 5 --on joints", 5)):
        code, said = command(f"pointlight --lifetime 3 {options} --seconds 0.2 --out o")
        assert code == 0 and said.startswith(f"{count} dots in 12 frames.")


@pytest.mark.parametrize(
    ("line", "file"),
    [("pointlight dots.csv --out .", "dots.csv"), ("planar points3d.csv --out .", "points3d.csv")],
)
def test_results_do_not_replace_the_motion_they_come_from(command, tmp_path, line, file):
    (tmp_path / file).write_text("time_s,a_u_px,a_v_px\n0,1,2\n")
    assert command(line) == (1, f"memo: {file}: is the input; write to another place\n")
    assert [path.name for path in tmp_path.iterdir()] == [file]


def test_the_help_of_the_manifest_names_every_column(command):
    _, said = command("batch --help")
    words = set(re.findall(r"[a-z_]+", said))
    assert {"video", "name", *batch.OPTIONS} <= words
