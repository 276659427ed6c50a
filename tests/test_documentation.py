"""What the documentation tells people to type is typed here: blocks of README.md and docs/, and all examples.

A page is run from top to bottom in a folder of its own, in which the files stand that its text takes for
given: `walk.mp4`, `points.csv`, `walk_json/` and such. A block with `<!-- not run: why -->` above it is
left out; how many these are is counted below, so that none is left out unseen.
"""

import contextlib
import doctest
import os
import re
import runpy
import shlex
import subprocess
import sys
import tomllib
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import detector_files
import matplotlib
import memo
import numpy as np
import pytest
from fake_psychopy import stand_in
from memo.files import write_json
from memo.video import VideoReader
from PIL import Image

ROOT = Path(__file__).resolve().parents[1]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))
LANGUAGES = ("sh", "console", "python", "pycon")

#: Blocks that are not run, by page: set-up, what compiles for minutes, and what needs data of the reader's.
NOT_RUN = {
    "README.md": 4,
    "CONTRIBUTING.md": 2,
    "docs/start/install.md": 4,
    "docs/start/rust.md": 3,
    "docs/start/vision-science.md": 1,
    "docs/reference/accuracy.md": 10,
    "docs/methods/point-light-displays.md": 1,
    "docs/start/keypoints-from.md": 1,
}
BLOCKS_RUN = 35

_FENCE = re.compile(
    r"^(?P<ticks>```+)(?P<language>[^\n`]*)\n(?P<text>.*?)^(?P=ticks)$", re.MULTILINE | re.DOTALL
)
_MARKER = re.compile(r"<!-- not run: (.+) -->\n\Z")


@dataclass(frozen=True)
class Block:
    """A fenced block of a page."""

    language: str
    text: str
    line: int
    why_not: str | None


def blocks(page: Path) -> list[Block]:
    """The blocks of a page that are commands or Python."""
    text = page.read_text(encoding="utf-8")
    found = []
    for match in _FENCE.finditer(text):
        marker = _MARKER.search(text[: match.start()])
        line = text[: match.start()].count("\n") + 1
        found.append(Block(match["language"], match["text"], line, marker and marker[1]))
    return [block for block in found if block.language in LANGUAGES]


def name(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


WITH_BLOCKS = [page for page in PAGES if any(block.why_not is None for block in blocks(page))]


def test_no_block_is_left_out_unseen():
    left_out = {name(page): sum(block.why_not is not None for block in blocks(page)) for page in PAGES}
    assert {page: count for page, count in left_out.items() if count} == NOT_RUN
    assert sum(block.why_not is None for page in PAGES for block in blocks(page)) == BLOCKS_RUN


def test_the_architecture_names_every_module_and_no_other():
    tree = (ROOT / "docs/ARCHITECTURE.md").read_text(encoding="utf-8").split("```")[1]
    core, python = tree.split("crates/memo-py/src/")
    named: dict[str, set[str]] = {}
    wing = ""
    for line in core.splitlines()[2:]:
        wing = line[2:13].strip(" /") or wing  # a line without one goes on with the last
        named.setdefault(wing, set()).update(line[38:].split())
    for file in ("progress", "wording"):  # files, said in a sentence
        del named[file]
    folders = [folder for folder in (ROOT / "crates/memo-core/src").iterdir() if folder.is_dir()]
    assert named == {folder.name: {file.stem for file in folder.iterdir()} - {"mod"} for folder in folders}
    modules = {path.stem for path in (ROOT / "python/memo").glob("[!_]*") if path.suffix in ("", ".py")}
    found = re.findall(r"^  (\w+)/? |  (\w+)/?  ", python, re.MULTILINE)
    assert {name for pair in found for name in pair if name} == modules


@pytest.fixture(scope="session")
def given(tmp_path_factory):
    """The files that pages take for given."""
    folder = tmp_path_factory.mktemp("given")
    scene = memo.demo_scene(seed=0, frames=60)
    write_walk(folder / "walk.mp4", scene)
    (folder / "camera.toml").write_text(calibration(scene.camera), encoding="utf-8")
    write_keypoints(folder / "walk_json", scene.camera)
    write_points(folder / "points.csv", scene.camera)
    write_detections(folder)
    return folder


def write_walk(path, scene):
    import av

    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=round(1 / (scene.times_s[1] - scene.times_s[0])))
        stream.height, stream.width = scene.frames.shape[1:]
        stream.pix_fmt = "yuv420p"
        for frame in scene.frames:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(frame, format="gray")))
        container.mux(stream.encode(None))


def calibration(camera):
    """The camera as TOML, found again from what it does to points."""
    corner = np.vstack([np.zeros(3), np.eye(3)])
    in_camera = camera.camera_from_world(corner)
    translation, rotation = in_camera[0], (in_camera[1:] - in_camera[0]).T
    ahead = (np.array([[0.0, 0.0, 4.0], [1.0, 1.0, 4.0]]) - translation) @ rotation
    (cu, cv), (u, v) = camera.project(ahead)
    matrix = [[4 * (u - cu), 0, cu], [0, 4 * (v - cv), cv], [0, 0, 1]]
    lines = [f"size = {list(camera.size)}", f"matrix = {np.round(matrix, 6).tolist()}"]
    lines += ["distortions = [0.0, 0.0, 0.0, 0.0]", f"rotation = {rotation.tolist()}"]
    return "\n".join(["[cam]", 'name = "cam"', *lines, f"translation = {translation.tolist()}", ""])


def write_points(path, camera):
    """Eight places, on the floor and 1.6 m above it, with their pixels."""
    places = np.array([[x, y, z] for z in (0, 1.6) for x in (-1.5, 1.5) for y in (-0.5, 1.5)])
    table = np.hstack([places, camera.project(places)])
    np.savetxt(path, table, delimiter=",", header="x_m,y_m,z_m,u_px,v_px", comments="", fmt="%.2f")


def write_keypoints(folder, camera):
    """A walker as OpenPose writes COCO-18, one file a frame."""
    folder.mkdir()
    walker = memo.walker_motion(90, rate_hz=30, heading_deg=20, height_m=1.75)
    places = dict(zip(walker.names, walker.positions.transpose(1, 0, 2), strict=True))
    places["NECK"] = (places["RSH"] + places["LSH"]) / 2
    order = ["HEAD", "NECK", *(f"{side}{joint}" for side in "RL" for joint in ("SH", "EL", "WR"))]
    order += [f"{side}{joint}" for side in "RL" for joint in ("HP", "KN", "AN")]
    pixels = np.stack([camera.project(places[joint]) for joint in order], axis=1)
    for frame, points in enumerate(pixels):
        triples = [[u, v, 0.9] if np.isfinite(u) else [0, 0, 0] for u, v in points] + [[0, 0, 0]] * 4
        person = {"pose_keypoints_2d": np.round(np.ravel(triples), 2).tolist()}
        write_json(folder / f"walk_{frame:012d}_keypoints.json", {"version": 1.3, "people": [person]})


def write_detections(folder):
    """Files of detectors, as each of them writes them."""
    detector_files.mediapipe(folder / "mediapipe.json", step_ms=33)
    detector_files.mmpose_demo(folder / "rtmpose.json")
    detector_files.easy_vitpose(folder / "vitpose.json")
    detector_files.yolo_labels(folder / "labels")
    detector_files.yolo_json(folder / "yolo.json")
    for ending in ("csv", "h5"):
        detector_files.deeplabcut(folder / f"deeplabcut.{ending}")
    detector_files.sleap_h5(folder / "sleap.h5")
    detector_files.sleap_csv(folder / "sleap.csv")
    detector_files.alphapose(folder / "alphapose-results.json")
    detector_files.coco(folder / "coco.json")
    detector_files.sports2d(folder / "walk_Sports2D_px_person00.trc")


@pytest.fixture
def workplace(given, tmp_path, monkeypatch):
    """A folder with the given files in it, and the `memo` command on the path."""
    for file in given.iterdir():
        (tmp_path / file.name).symlink_to(file)
    command = tmp_path / "bin" / "memo"
    command.parent.mkdir()
    command.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m memo.cli "$@"\n', encoding="utf-8")
    command.chmod(0o755)
    monkeypatch.setenv("PATH", f"{command.parent}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setenv("PYTHONPATH", str(Path(memo.__file__).parents[1]))
    monkeypatch.setitem(sys.modules, "psychopy", stand_in())
    monkeypatch.chdir(tmp_path)
    matplotlib.use("Agg")
    return tmp_path


@pytest.mark.parametrize("page", WITH_BLOCKS, ids=name)
def test_a_page_does_what_it_says(page, workplace):
    known = {}
    for block in blocks(page):
        if block.why_not is None:
            run(block, known, f"{name(page)}:{block.line}")


def run(block, known, where):
    """Runs a block; Python blocks of a page share their names."""
    if block.language == "python":
        with contextlib.redirect_stdout(sys.stderr):
            exec(compile(block.text, where, "exec"), known)
    elif block.language == "pycon":
        test = doctest.DocTestParser().get_doctest(block.text, known, where, where, 0)
        assert not doctest.DocTestRunner().run(test, clear_globs=False).failed, where
        known.update(test.globs)
    elif block.language == "sh":
        shell(block.text, where)
    else:
        for command, output in commands(block.text):
            said = shell(command, where).splitlines()
            assert [line for line in output if line not in said] == [], where


def commands(text):
    """Commands of a `console` block, each with the lines of output shown below it."""
    found = []
    for line in text.splitlines():
        if line.startswith("$ "):
            found.append((line[2:], []))
        elif line.strip() and line.strip() != "…":
            found[-1][1].append(line)
    return found


def shell(script, where):
    done = subprocess.run(
        ["bash", "-euo", "pipefail", "-c", script], capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, f"{where}: {script}: exit code {done.returncode}\n{done.stdout}{done.stderr}"
    return done.stdout


@pytest.fixture(scope="session")
def made_once():
    """`memo.demo_scene` and `memo.track`, giving the same again for the same: most examples begin alike."""
    demo_scene, track = memo.demo_scene, memo.track
    scenes, tracks = {}, {}

    def scene_of(seed):
        if seed not in scenes:
            scenes[seed] = demo_scene(seed=seed)
        return scenes[seed]

    def track_of(frames, **options):
        key = (id(frames), *((name, id(options[name])) for name in sorted(options)))
        if key not in tracks:
            tracks[key] = (track(frames, **options), frames, options)  # what is kept keeps its id
        return tracks[key][0]

    return {"demo_scene": scene_of, "track": track_of}


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_runs_and_draws(example, workplace, made_once, monkeypatch):
    for called, function in made_once.items():
        monkeypatch.setattr(memo, called, function)
    from matplotlib import pyplot as plt

    try:
        runpy.run_path(str(example))
        assert plt.get_fignums()
    finally:
        plt.close("all")


def test_there_are_examples():
    assert len(EXAMPLES) == 12


CORE = ROOT / "crates" / "memo-core"
RUST_RUNS = [
    (page, block)
    for page in ("README.md", "docs/start/rust.md")
    for block in blocks(ROOT / page)
    if "cargo run" in block.text
]


@pytest.mark.parametrize(("page", "block"), RUST_RUNS, ids=[page for page, _ in RUST_RUNS])
def test_a_rust_example_is_run_as_it_wants_to_be(page, block):
    """What needs no compiler: the package, the example and the number and order of its arguments."""
    cargo, _, arguments = block.text.strip().partition(" -- ")
    words = shlex.split(cargo)
    assert words[:3] == ["cargo", "run", "--release"]
    with open(CORE / "Cargo.toml", "rb") as file:
        assert tomllib.load(file)["package"]["name"] == words[words.index("-p") + 1]
    source = (CORE / "examples" / f"{words[words.index('--example') + 1]}.rs").read_text(encoding="utf-8")
    usage = re.search(r'"usage: \S+ ([^"]*)"', source)[1]
    wanted = [word.strip("[]") for word in usage.split()]
    given = shlex.split(arguments)
    assert wanted == ["FRAMES_DIR", "RATE_HZ", "HEIGHT_M", "CAMERA.toml"] and len(given) == len(wanted)
    assert float(given[1]) > 1 and 0.5 < float(given[2]) < 2.5 and given[3].endswith(".toml")
    assert usage in source.split("fn main")[0], "the head of the example says the same"


def built_example():
    """`track_frames`, linked to the core of `cargo test`; None where that is older than its source.

    `cargo test` itself builds the example's tests alone.
    """
    target = Path(os.environ.get("CARGO_TARGET_DIR") or ROOT / "target")
    built = [path.stat().st_mtime for path in target.glob("debug/examples/track_frames-*")]
    if max(built, default=0.0) < max(path.stat().st_mtime for path in CORE.rglob("*.rs")):
        return None
    shell(f"cd {ROOT} && cargo build --example track_frames", "README.md")
    return target / "debug/examples" / f"track_frames{'.exe' if sys.platform == 'win32' else ''}"


def test_the_rust_example_of_the_readme_runs(workplace):
    """`MEMO_FULL=1` compiles all of it, as the block says; else it is linked to what is built."""
    full, example = bool(os.environ.get("MEMO_FULL")), built_example()
    if not full and example is None:
        pytest.skip("cargo test has not built it since the core was changed")
    frames = workplace / "FOLDER_OF_PNG_FRAMES"
    frames.mkdir()
    with VideoReader("walk.mp4") as video:
        for frame in islice(video, 45):
            Image.fromarray(np.ascontiguousarray(frame.luma)).save(frames / f"{frame.index:04d}.png")
    (block,) = [block for page, block in RUST_RUNS if page == "README.md"]
    command = block.text.replace("FOLDER_OF_PNG_FRAMES", str(frames)).replace(
        "camera.toml", str(workplace / "camera.toml")
    )
    if not full:
        command = f"{example} {command.partition(' -- ')[2]}"
    rows = shell(f"cd {ROOT} && {command}", "README.md").splitlines()
    assert rows[0].startswith("frame,time_s,x_m") and len(rows) > 30
