"""Many videos: what a manifest may hold, and that no kill, crash or second run loses or changes a result.

Most runs have a stand-in for `memo` as child, which does what its "video", a text file, tells it to.
`MEMO_FULL=1` repeats the kills many times, with more videos.
"""

import csv
import errno
import json
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from pathlib import Path

import memo
import pytest
from conftest import grey_video
from memo import batch
from memo.batch import engine, tables
from memo.batch.engine import Progress, described
from memo.batch.folder import OutFolder
from memo.batch.manifest import Row
from memo.cli.batch import _line
from memo.files import read_text_columns
from memo.given import heights
from memo.unfinished import is_unfinished

FULL = bool(os.environ.get("MEMO_FULL"))
KILLS = 60 if FULL else 4
LONGEST_S = 120.0  # what has not happened by then, on a machine however busy, will not happen

CHILD = """
import os, signal, sys, threading, time
def leash():
    os.read(0, 1)
    os._exit(1)
threading.Thread(target=leash, daemon=True).start()
_, track, video, *options = sys.argv
out = options[options.index("--out") + 1]
height = options[options.index("--height") + 1] if "--height" in options else "1.75"
todo = open(video).read().split()
if todo[0] == "fails":
    sys.exit("memo: " + video + ": not a video")
if todo[0] in ("SIGSEGV", "SIGKILL", "SIGABRT"):
    os.kill(os.getpid(), getattr(signal, todo[0]))
if todo[0] == "defect":
    sys.exit(70)
if todo[0] == "kills-its-worker" and not (len(todo) > 1 and os.path.exists(todo[1])):
    if len(todo) > 1:
        open(todo[1], "w").close()
    os.kill(os.getppid(), signal.SIGKILL)
if todo[0] == "grows":
    hoard = []
    while True:
        hoard.append(b"x" * 1000000)
        time.sleep(0.002)
os.makedirs(out)
for name in ("track.csv", "gait_parameters.csv"):
    with open(os.path.join(out, name), "w") as file:
        file.write("walk,parameter,side,value,unit,ci_low,ci_high,n\\n")
        file.flush()
        if todo[0] == "sleeps":
            time.sleep(float(todo[1]))
        if todo[0] != "nobody":
            file.write("0,stride_time,right," + height + ",s,1.0,1.2,3\\n")
            file.write("0,cadence,," + height + ",1/min,,,6\\n")
        if todo[0] == "twice":
            file.write("1,cadence,," + height + ",1/min,,,4\\n")
with open(os.path.join(out, "run.json"), "w") as file:
    options = '"options": {"height_m": ' + height + '}, "camera_given": false'
    times = ', "start_s": 0.5, "end_s": 2.25'
    ways = (
        ("left to right", "forward", 0.01, times + ', "fit": {"measured": true, "fits": "in part"}'),
        ("right to left", "backward", 0.2, ', "fit": {"measured": false}'),
    )
    walk = '{"direction": "%s", "gait": "%s", "p_swapped": %s%s}'
    walks = ", ".join(walk % way for way in ways) if todo[0] != "nobody" else ""
    file.write('{"walks": [' + walks + "], " + options + "}")
said = '{"message": "said of ' + os.path.basename(video) + '"'
if todo[0] == "twice":
    print(said + ', "walks": 2, "each_walk": [{"message": "Goes."}, {"message": "Comes."}], '
        '"sentences": ["Walk 0: Goes.", "Walk 0: Look.", "Walk 1: Comes."]}')
    sys.stderr.write("memo: " + video + ": cut off\\n")
else:
    print(said + ', "walks": ' + str(int(todo[0] != "nobody")) + ', "each_walk": [], "sentences": []}')
if todo[0] == "no-table":
    os.remove(os.path.join(out, "track.csv"))
sys.exit(3 if todo[0] == "nobody" else 0)
"""

DRIVER = """
import sys
from memo import batch
manifest, out, child = sys.argv[1:4]
command = [sys.executable, "-S", "-E", child]
batch.run(manifest, out, jobs=3, resume=True, retry_failed="--retry" in sys.argv, command=command)
"""


@pytest.fixture
def lab(tmp_path):
    return Lab(tmp_path)


class Lab:
    """A folder with videos that tell the stand-in what to do, a manifest and results."""

    def __init__(self, folder):
        self.folder, self.out, self.manifest = folder, folder / "out", folder / "walks.csv"
        self.child = folder / "child.py"
        self.child.write_text(CHILD)
        self.command = [sys.executable, "-S", "-E", str(self.child)]

    def videos(self, *todo, heights=None):
        """One video for each thing to do, and the manifest of all."""
        lines = ["video,height_m"]
        for k, text in enumerate(todo):
            path = self.folder / f"v{k:02}.mp4"
            if not (path.exists() and path.read_text() == text):
                path.write_text(text)
            lines.append(f"{path.name},{heights[k] if heights else 1.7}")
        self.manifest.write_text("\n".join(lines) + "\n")

    def run(self, out=None, **options):
        return batch.run(self.manifest, out or self.out, **{"jobs": 3, "command": self.command, **options})

    def start(self, *arguments):
        """A run in a process of its own, the head of a process group."""
        driver = self.folder / "driver.py"
        driver.write_text(DRIVER)
        return subprocess.Popen(
            [sys.executable, str(driver), str(self.manifest), str(self.out), str(self.child), *arguments],
            start_new_session=True,
            stderr=subprocess.PIPE,
        )

    def results(self, out=None):
        """Every file a user finds, by name; what is said of time and attempts is left out."""
        out = out or self.out
        found = {}
        for file in sorted(out.rglob("*")):
            name = str(file.relative_to(out))
            if file.is_file() and not name.startswith((".batch", "logs")):
                found[name] = file.read_bytes()
        found["status.csv"] = [(row["name"], row["state"], row["message"]) for row in self.status(out)]
        return found

    def status(self, out=None):
        return table(out or self.out, "status.csv")

    def states(self):
        return {row["name"]: row["state"] for row in self.status()}

    def strays(self):
        """Unfinished files, and anything in the folder of results that is nobody's."""
        known = {"status.csv", "gait_parameters.csv", "logs", ".batch"} | {
            row["name"] for row in self.status()
        }
        work = [path for path in (self.out / ".batch").glob("*.work/*")]
        return work + [path for path in self.out.iterdir() if path.name not in known]

    def processes(self):
        """Command lines of living processes that have to do with this folder."""
        found = []
        for process in Path("/proc").glob("[0-9]*"):
            try:
                line = (process / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
            except OSError:
                continue
            if str(self.folder) in line and int(process.name) != os.getpid():
                found.append((int(process.name), line))
        return found


def table(out, name):
    with open(out / name, newline="") as file:
        return list(csv.DictReader(file))


def problems_of(manifest):
    with pytest.raises(batch.ManifestError) as refused:
        batch.run(manifest, "/nonexistent/out")
    return refused.value.problems


# Manifests.


def test_names_of_videos_are_no_formulas_in_the_tables(lab):
    names = ["=HYPERLINK(1)", "+1", "-2+cmd", "@SUM(A1)", "x;=1"]
    rows = []
    for name in names:
        (lab.folder / f"{name}.mp4").write_text("ok")
        rows.append({"video": lab.folder / f"{name}.mp4", "name": name, "height_m": 1.7})
    batch.run(rows, lab.out, command=lab.command)
    for file in ("status.csv", "gait_parameters.csv"):
        assert read_text_columns(lab.out / file)["name"] == names
        with open(lab.out / file, newline="") as opened:
            cells = [cell for row in csv.reader(opened) for part in [*row] for cell in part.split(";")]
        assert [cell for cell in cells if cell[:1] in ("=", "@") or cell == "-2+cmd"] == []
    with open(lab.manifest, "w", newline="") as file:  # the cells as they stand
        csv.writer(file).writerows(
            [["video", "name"], *([row["video"], row["name"]] for row in lab.status())]
        )
    assert [row.name for row in batch.read_manifest(lab.manifest).rows] == names


def test_names_that_look_like_numbers_are_kept_by_pandas(lab):
    pandas = pytest.importorskip("pandas")
    page = Path(__file__).parents[1] / "docs" / "reference" / "files.md"
    (options,) = re.findall(r"`(dtype=.*, na_values=.*)`", page.read_text(encoding="utf-8"))
    lab.videos("ok")
    batch.run(
        [{"video": lab.folder / "v00.mp4", "name": name} for name in ("001", "NA")],
        lab.out,
        command=lab.command,
    )
    for file in ("status.csv", "gait_parameters.csv"):
        read = eval(f"read_csv(path, {options})", {"read_csv": pandas.read_csv, "path": lab.out / file})
        assert list(read["name"]) == ["001", "NA"]
    assert read["p_swapped"].dtype == float and read["person"].isna().sum() == 0


def test_csv_and_toml_say_the_same(tmp_path):
    for name in ("a.mp4", "b.mp4", "side.toml"):
        (tmp_path / name).write_text("x")
    (tmp_path / "side.toml").write_text(CAMERA)
    (tmp_path / "m.csv").write_text(
        "video;camera;height_m;frames;overlay\na.mp4;side.toml;1.7;3:9;yes\n\nb.mp4;;1.6;;\n",
        encoding="utf-8-sig",
    )
    (tmp_path / "m.toml").write_text(
        "[defaults]\nheight_m = 1.6\n[[video]]\nvideo = 'a.mp4'\ncamera = 'side.toml'\nheight_m = 1.7\n"
        "frames = '3:9'\noverlay = true\n[[video]]\nvideo = 'b.mp4'\n"
    )
    of_csv, of_toml = (batch.read_manifest(tmp_path / name).rows for name in ("m.csv", "m.toml"))
    of_dicts = batch.read_manifest(
        [
            {"video": tmp_path / "a.mp4", "camera": tmp_path / "side.toml", "height_m": 1.7}
            | {"frames": "3:9", "overlay": True},
            {"video": str(tmp_path / "b.mp4"), "height_m": 1.6, "fps": None},
        ]
    ).rows
    assert [row.problems for row in of_csv] == [(), ()]
    for rows in (of_toml, of_dicts):
        assert [(row.name, row.arguments) for row in rows] == [(row.name, row.arguments) for row in of_csv]
    assert of_csv[0].arguments == [
        *(str(tmp_path / "a.mp4"), "--camera", str(tmp_path / "side.toml"), "--height", "1.7"),
        *("--frames", "3:9", "--overlay"),
    ]
    assert of_csv[1].place == f"{tmp_path / 'm.csv'}, line 4"
    assert of_toml[1].place == f"{tmp_path / 'm.toml'}, line 9"


def test_every_option_of_track_is_a_column():
    import typer
    from memo import cli

    track = typer.main.get_command(cli._app()).commands["track"]
    flags = {option.opts[0] for option in track.params if option.opts[0].startswith("--")}
    assert {option.flag for option in batch.OPTIONS.values()} == flags - {
        "--out",
        "--json",
        "--quiet",
        "--help",
    }


@pytest.mark.parametrize("truth", [True, False])
def test_the_child_reads_a_row_as_it_was_given(tmp_path, truth):
    options = {
        **{"camera": tmp_path / "-c.toml", "camera_name": "-1", "camera_unit": "mm", "camera_size": "4x3"},
        **{"camera_v_up": truth, "height_m": 1.7, "fov_deg": 59.125, "frames": "-5:", "fps": 1e-3},
        **{"shrink": 3, "overlay": truth, "plots": truth, "report": truth},
        **{"steady": truth, "treadmill": truth, "follow": "10,20.5@7", "boxes": tmp_path / "-b.txt"},
    }
    assert set(options) == set(batch.OPTIONS)
    row = Row("name", tmp_path / "--out", options, "here")
    video, again = Row.of_arguments(row.arguments)
    assert video == row.video and again == options
    assert {name: type(value) for name, value in again.items()} == {
        name: type(value) for name, value in options.items()
    }


def test_a_row_takes_the_heights_of_several_people(tmp_path):
    (tmp_path / "a.mp4").write_text("x")
    (tmp_path / "m.csv").write_text('video,height_m\na.mp4,"1.80, 1.65"\n')
    (tmp_path / "m.toml").write_text("[[video]]\nvideo = 'a.mp4'\nheight_m = [1.80, 1.65]\n")
    (of_csv,), (of_toml,) = (batch.read_manifest(tmp_path / name).rows for name in ("m.csv", "m.toml"))
    assert of_csv.options["height_m"] == "1.80,1.65" and not of_csv.problems and not of_toml.problems
    assert memo_heights(of_csv) == memo_heights(of_toml) == [1.80, 1.65]
    (tmp_path / "m.csv").write_text('video,height_m\na.mp4,"1.80,165.0"\n')
    (bad,) = batch.read_manifest(tmp_path / "m.csv").rows
    assert "165 looks like centimetres" in bad.problems[0]


def memo_heights(row):
    """The heights in the options that the child reads from a row."""
    return heights(Row.of_arguments(row.arguments)[1]["height_m"])


def test_each_walk_has_the_height_of_its_person(tmp_path):
    walk = {"start_s": 0.0, "end_s": 1.0, "direction": "left to right", "gait": "forward", "p_swapped": 0.0}
    walks = [walk | {"height_m": 1.8}, walk | {"height_m": 1.65}]
    run = {"options": {"height_m": [1.8, 1.65]}, "camera_given": True, "walks": walks}
    (tmp_path / "run.json").write_text(json.dumps(run))
    given, seen = tables._run(tmp_path / "run.json")
    assert given["height_m"] == "1.8,1.65" and [seen[k]["height_m"] for k in "01"] == ["1.800", "1.650"]


@pytest.mark.parametrize("shrink", ["0", 2.5, True, "two", -1])
def test_pictures_shrink_by_whole_numbers(tmp_path, shrink):
    video = tmp_path / "a.mp4"
    video.write_text("x")
    (good, bad) = batch.read_manifest(
        [{"video": video, "name": "b", "shrink": 2}, {"video": video} | {"shrink": shrink}]
    ).rows
    assert good.arguments[1:] == ["--shrink", "2"] and not good.problems
    assert f"{shrink!r} is not a whole number from 1 to 9999" in bad.problems[0]


def test_all_problems_are_told_together_with_their_lines(tmp_path):
    (tmp_path / "a.mp4").write_text("x")
    (tmp_path / "empty.mp4").touch()
    (tmp_path / "frames").mkdir()
    (tmp_path / "bad.toml").write_text("[side]\nsize = 3\n")
    manifest = tmp_path / "m.csv"
    rows = [
        ("nobody-has-it.mp4,,,,", "nobody-has-it.mp4: no such video"),
        ("a.mp4,168,,,", "height_m 168 looks like centimetres: give height_m 1.68"),
        ('a.mp4,"1,68",,,', "height_m '1,68' is not a number: write a decimal point"),
        ("a.mp4,1.7,bad.toml,,", "bad.toml: "),
        ("a.mp4,1.7,none.toml,,", "none.toml: no such camera file"),
        ("a.mp4,1.7,,9:3,", "frames 9:3 is not A:B"),
        ("a.mp4,1.7,,,0", "fps 0 is not a frame rate"),
        ("empty.mp4,1.7,,,", "the file is empty"),
        ("frames,1.7,,,", "give fps"),
        (",1.7,,,", "no video"),
    ]
    lines = [f"v{k},{row}" for k, (row, _) in enumerate(rows)]
    manifest.write_text("\n".join(["name,video,height_m,camera,frames,fps", *lines]) + "\n")
    problems = problems_of(manifest)
    assert len(problems) == len(rows)
    for k, (problem, (_, expected)) in enumerate(zip(problems, rows, strict=True)):
        assert problem.startswith(f"{manifest}, line {k + 2}: ") and expected in problem, problem


@pytest.mark.parametrize(
    "text, expected",
    [
        ("video,heigth_m\na,1.7\n", ["line 1: unknown column 'heigth_m' (is it 'height_m'?)"]),
        (
            "vidoe,subject\na,1\n",
            ["'vidoe' (is it 'video'?)", "'subject' (known: video,", "no column 'video'"],
        ),
        ("video,video\na,b\n", ["column 'video' twice"]),
        ("video\na,b\n", ["line 2: 2 cells under 1 column"]),
        ('video\n"a\n', ["line 2: "]),
        ("", ["no column 'video'"]),
        ("video\n", ["holds no video"]),
    ],
)
def test_what_is_no_csv_manifest(tmp_path, text, expected):
    (tmp_path / "m.csv").write_text(text)
    problems = problems_of(tmp_path / "m.csv")
    assert len(problems) == len(expected)
    assert all(part in problem for part, problem in zip(expected, problems, strict=True)), problems


@pytest.mark.parametrize(
    "text, expected",
    [
        ("[[video]\n", "m.toml: "),
        (
            "[[video]]\nvideo = 'a'\n\nheigth_m = 2\n",
            "m.toml, line 4: unknown key 'heigth_m' (is it 'height_m'?)",
        ),
        ("[all]\n[[video]]\nvideo = 'a'\n", "m.toml, line 1: unknown key 'all'"),
        ("[defaults]\nname = 'x'\n[[video]]\nvideo = 'a'\n", "m.toml, line 2: unknown key 'name'"),
        ("[video]\nvideo = 'a'\n", "m.toml: each video must be a table"),
        ("[[video]]\nvideo = 3\n", "m.toml, line 1: video 3 is not a path"),
        ("[[video]]\nvideo = 'm.toml'\nheight_m = true\n", "m.toml, line 1: height_m True is not a number"),
    ],
)
def test_what_is_no_toml_manifest(tmp_path, text, expected):
    (tmp_path / "m.toml").write_text(text)
    assert any(expected in problem for problem in problems_of(tmp_path / "m.toml"))


def test_files_that_are_no_manifest(tmp_path):
    (tmp_path / "latin.csv").write_bytes("video\nG\xe4nge.mp4\n".encode("latin-1"))
    assert "not text in UTF-8" in problems_of(tmp_path / "latin.csv")[0]
    assert "no such file" in problems_of(tmp_path / "none.csv")[0]
    assert "unknown key 'vdeo'" in problems_of([{"vdeo": "a"}])[0]


def test_no_manifest_however_mangled_is_more_than_refused(tmp_path):
    (tmp_path / "a.mp4").write_text("x")
    (tmp_path / "c.toml").write_text(CAMERA)
    header = b"video,name,camera,camera_name,height_m,fov_deg,frames,fps,overlay\n"
    of_csv = header + b"a.mp4,x,c.toml,side,1.7,,3:9,,yes\n"
    of_toml = (
        b"[defaults]\nheight_m = 1.6\n[[video]]\nvideo = 'a.mp4'\nframes = '3:9'\noverlay = true\nfps = 25\n"
    )
    chance = random.Random(3)
    accepted = refused = 0
    for k in range(100_000 if FULL else 400):
        suffix, text = ((".csv", of_csv), (".toml", of_toml))[k % 2]
        mangled = bytearray(text)
        for _ in range(chance.randrange(1, 6)):
            at = chance.randrange(len(mangled))
            change = chance.randrange(4)
            if change == 0:
                mangled[at] = chance.randrange(256)
            elif change == 1:
                del mangled[at : at + chance.randrange(1, 9)]
            elif change == 2:
                mangled[at:at] = bytes(chance.choices(b"\0\n\r\"',;[]=.-/~9e", k=chance.choice((1, 2, 900))))
            else:
                mangled[at:at] = mangled[chance.randrange(len(mangled)) :][:20]
        (tmp_path / f"m{suffix}").write_bytes(mangled)
        try:
            read = batch.read_manifest(tmp_path / f"m{suffix}")
        except batch.ManifestError as error:
            assert error.problems and all(str(tmp_path) in problem for problem in error.problems)
            refused += 1
        else:
            assert all(row.fingerprint is not None and row.arguments for row in read.rows)
            accepted += 1
    assert accepted > 10 and refused > 10


def test_names_follow_from_paths_and_differ(tmp_path):
    for path in ("s1/walk.mp4", "s2/walk.mp4", "s2/run.mp4", "s2/fast/walk.mp4"):
        (tmp_path / path).parent.mkdir(exist_ok=True)
        (tmp_path / path).write_text("x")
    (tmp_path / "m.csv").write_text("video\ns1/walk.mp4\ns2/walk.mp4\ns2/run.mp4\ns2/fast/walk.mp4\n")
    rows = batch.read_manifest(tmp_path / "m.csv").rows
    assert [row.name for row in rows] == ["s1-walk", "s2-walk", "run", "fast-walk"]
    (tmp_path / "m.csv").write_text("video,name\ns2/run.mp4,\ns1/walk.mp4,RUN\n")
    assert [row.name for row in batch.read_manifest(tmp_path / "m.csv").rows] == ["s2-run", "RUN"]
    (tmp_path / "m.csv").write_text("video,frames\ns2/run.mp4,:9\ns1/walk.mp4,\ns2/run.mp4,9:\n")
    assert "line 2: the name 'run' is also used in line 4" in problems_of(tmp_path / "m.csv")[0]
    for name in ("..", "a/b", ".x", "logs", "status.csv", "x" * 200, "a\x07"):
        assert (
            "cannot be the name of a folder"
            in problems_of([{"video": tmp_path / "s2/run.mp4", "name": name}])[0]
        )


@pytest.mark.skipif(sys.platform != "linux", reason="other systems have no such file names")
def test_a_file_name_that_is_not_text_needs_a_name(lab):
    video = os.fsdecode(os.fsencode(lab.folder) + b"/gr\xfc\xdfe.mp4")
    Path(video).write_text("ok")
    lab.videos("ok")
    rows = [{"video": lab.folder / "v00.mp4"}, {"video": video}]
    (problem,) = problems_of(rows)
    assert problem.startswith(r"row 2: 'gr\udcfc\udcdfe' cannot be the name of a folder here; give another")
    rows[1]["name"] = "greetings"
    batch.run(rows, lab.out, command=lab.command)
    assert lab.states() == {"v00": "done", "greetings": "done"}
    assert lab.status()[1]["video"].endswith(r"gr\udcfc\udcdfe.mp4")


CAMERA = """
[side]
name = "side"
size = [64.0, 48.0]
matrix = [[60.0, 0.0, 32.0], [0.0, 60.0, 24.0], [0.0, 0.0, 1.0]]
distortions = [0.0, 0.0, 0.0, 0.0]
rotation = [1.5, 0.0, 0.0]
translation = [0.0, 1.0, 5.0]
"""


# What becomes of a video.


def test_each_end_is_known_for_what_it_is(lab):
    todo = ("ok", "nobody", "fails", "SIGSEGV", "SIGKILL", "defect", "no-table", "ok")
    lab.videos(*todo)
    told = []
    lab.run(progress=told.append)
    ended = [now for now in told if now.record is not None]
    assert len(ended) == 8 and ended[-1].ended == 8 and isinstance(ended[0], Progress)
    lab.videos(*todo, "sleeps 60")  # on its own, for on a busy machine the others may take a second too
    result = lab.run(timeout_s=1.0, resume=True)
    assert result.done_now == 1 and list(lab.states().values()) == [
        *("done", "nobody", "failed", "crashed", "crashed", "crashed", "crashed", "done", "timeout")
    ]
    messages = [record.message for record in result.records]
    assert messages[0] == "said of v00.mp4" and messages[2].endswith("v02.mp4: not a video")
    assert messages[3] == "killed by SIGSEGV" and messages[4] == "killed by SIGKILL"
    assert messages[8] == "ended after 1 s" and "without track.csv" in messages[6]
    assert (lab.out / "logs" / "v02.log").read_text().endswith("not a video\n")
    assert sorted(path.name for path in lab.out.iterdir() if path.is_dir()) == [
        *(".batch", "logs", "v00", "v01", "v07")
    ]
    assert result.counts == {
        **{"done": 2, "nobody": 1, "elsewhere": 0, "failed": 1, "crashed": 4, "timeout": 1}
    }
    assert result.unfinished == 6 and not lab.strays() and not lab.processes()


def test_one_table_of_all_walks(lab):
    lab.videos("ok", "nobody", "fails", heights=[1.6, 1.7, 1.8])
    lab.run()
    first, second, third = table(lab.out, "gait_parameters.csv")
    assert first["name"] == "v00" and first["walk"] == "0" and first["direction"] == "left to right"
    assert (first["height_m"], first["camera_given"], first["p_swapped"]) == ("1.6", "no", "0.010000")
    assert first["stride_time_right_s"] == "1.6" and first["stride_time_right_s_ci_high"] == "1.2"
    assert first["stride_time_right_s_n"] == "3" and first["cadence_per_min"] == "1.6"
    assert (second["state"], second["walk"], second["cadence_per_min"]) == ("nobody", "", "")
    assert (third["state"], third["walk"]) == ("failed", "")


def test_each_walk_of_a_video_has_its_own_direction(lab):
    lab.videos("twice")
    lab.run()
    seen = [
        [row[name] for name in ("walk", "person", "direction", "gait", "p_swapped", "fits")]
        for row in table(lab.out, "gait_parameters.csv")
    ]
    assert table(lab.out, "gait_parameters.csv")[0]["camera_motion"] == ""  # of an older version
    assert seen == [
        ["0", "0", "left to right", "forward", "0.010000", "in part"],
        ["1", "1", "right to left", "backward", "0.200000", "not measured"],
    ]


def test_every_walk_is_counted_and_told(lab):
    lab.videos("twice", "ok", "nobody", "fails")
    told = []
    result = lab.run(progress=told.append)
    first, *others = lab.status()
    assert (first["walks"], first["message"]) == ("2", "Walk 0: Goes. Walk 1: Comes.")
    assert first["remarks"] == f"{lab.folder / 'v00.mp4'}: cut off; Walk 0: Look."
    assert [row["walks"] for row in others] == ["1", "0", ""] and not any(row["remarks"] for row in others)
    assert result.walks == 3
    sentences = list(described(result))
    several = "gait_parameters.csv has one row per walk; its column person tells people of a video apart."
    assert f"3 walks; several in 1 video (v00): {several}" in sentences
    assert "Remarks on 1 video (v00): see status.csv." in sentences
    line = next(_line(now.record) for now in told if now.record is not None and now.record.name == "v00")
    assert ": done, 2 walks, " in line and line.endswith("Walk 0: Goes. Walk 1: Comes. (remarks: status.csv)")
    rows = [(row["start_s"], row["end_s"]) for row in table(lab.out, "gait_parameters.csv")[:2]]
    assert rows == [("0.500", "2.250"), ("", "")]  # the second as an older memo left it


def test_records_of_an_older_memo_know_no_number_of_walks(lab):
    lab.videos("twice")
    lab.run()
    record = lab.out / ".batch" / "records" / "v00.json"
    older = {
        key: value for key, value in json.loads(record.read_text()).items() if key not in ("walks", "remarks")
    }
    record.write_text(json.dumps(older))
    assert lab.run(resume=True).done_now == 0
    assert (lab.status()[0]["walks"], lab.status()[0]["state"]) == ("", "done")


def test_a_second_run_goes_on_only_when_told(lab):
    lab.videos("ok", "fails", "ok")
    lab.run()
    before = lab.results()
    with pytest.raises(batch.BatchError, match=r"videos have been run here \(3 of 3\)"):
        lab.run()
    assert lab.run(resume=True).done_now == 0
    assert lab.results() == before
    assert lab.run(retry_failed=True).done_now == 1
    assert [row["attempt"] for row in lab.status()] == ["1", "2", "1"]
    lab.videos("ok", "ok", "ok")
    result = lab.run(resume=True)  # the video has changed
    assert result.done_now == 1 and [row["attempt"] for row in lab.status()] == ["1", "1", "1"]


def test_a_changed_row_is_done_again_and_told(lab):
    lab.videos("ok", "ok", heights=[1.6, 1.7])
    lab.run()
    lab.videos("ok", "ok", heights=[1.6, 1.8])
    result = lab.run(resume=True)
    assert result.done_now == 1
    assert "1 video changed since the last run and done again (height_m of 1)." in result.notes
    assert [row["cadence_per_min"] for row in table(lab.out, "gait_parameters.csv")] == ["1.6", "1.8"]
    assert lab.run(resume=True, overlay=True).done_now == 2
    lab.videos("ok")
    result = lab.run(resume=True, overlay=True)
    assert "1 video no longer in the manifest (v01): left unchanged." in result.notes
    assert (lab.out / "v01").is_dir() and len(lab.status()) == 1


def test_a_row_that_now_fails_leaves_no_old_results(lab):
    lab.videos("ok", "ok")
    lab.run()
    lab.videos("ok", "fails")
    lab.run(resume=True)
    assert lab.states() == {"v00": "done", "v01": "failed"} and not (lab.out / "v01").exists()


def test_results_that_were_removed_are_made_again(lab):
    lab.videos("ok", "ok")
    lab.run()
    shutil.rmtree(lab.out / "v01")
    assert lab.run(resume=True).done_now == 1 and (lab.out / "v01" / "track.csv").is_file()


def spoil(lab):
    """Results of two videos that are of no use for the table of all."""
    (lab.out / "v00" / "gait_parameters.csv").unlink()
    file = lab.out / "v01" / "gait_parameters.csv"
    file.write_text(file.read_text().replace(",", ";"))


def test_unusable_results_of_a_video_do_not_affect_the_tables_of_others(lab):
    lab.videos("ok", "ok")
    lab.run()
    spoil(lab)
    lab.videos("ok", "ok", "ok")
    result = lab.run(resume=True)
    rows = table(lab.out, "gait_parameters.csv")
    assert [(row["name"], row["state"], row["cadence_per_min"]) for row in rows] == [
        *(("v00", "done", ""), ("v01", "done", ""), ("v02", "done", "1.7"))
    ]
    missing = f"{lab.out / 'v00' / 'gait_parameters.csv'}: No such file or directory"
    assert (
        f"2 videos without values in gait_parameters.csv (v00, v01): {missing}; "
        "remove the folder of results and resume to track a video again." in result.notes
    )


@pytest.mark.parametrize("full", [False, True])
def test_tables_that_cannot_be_written_do_not_hide_an_interrupt(lab, monkeypatch, full):
    lab.videos("ok", "ok")
    lab.run()
    spoil(lab)
    lab.videos("ok", "ok", "sleeps 60")

    def interrupt(_):
        if full:
            monkeypatch.setattr(engine, "write_status", fill)
        raise KeyboardInterrupt

    def fill(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with pytest.raises(KeyboardInterrupt):
        lab.run(resume=True, progress=interrupt)


def test_bad_rows_can_be_skipped(lab):
    lab.videos("ok", "ok")
    (lab.folder / "v01.mp4").unlink()
    with pytest.raises(batch.ManifestError):
        lab.run()
    assert not lab.out.exists()
    result = lab.run(skip_bad=True)
    assert lab.states() == {"v00": "done", "v01": "failed"}
    assert "line 3" in result.records[1].message and "no such video" in result.records[1].message
    (lab.folder / "v01.mp4").write_text("ok")
    lab.run(resume=True)
    assert lab.states() == {"v00": "done", "v01": "done"}


def test_where_it_does_not_start(lab, monkeypatch):
    lab.videos("ok")
    (lab.folder / "other").mkdir()
    (lab.folder / "other" / "thesis.tex").write_text("years of work")
    with pytest.raises(batch.BatchError, match="holds files that"):
        lab.run(lab.folder / "other", resume=True)
    with pytest.raises(batch.BatchError, match="is a file"):
        lab.run(lab.manifest)
    for wrong in ({"jobs": 0}, {"shard": (3, 2)}, {"shard": (0, 2)}, {"timeout_s": 0.0}, {"memory_mb": 0}):
        with pytest.raises(batch.BatchError):
            lab.run(**wrong)
    usage = shutil.disk_usage("/")
    monkeypatch.setattr(shutil, "disk_usage", lambda _: usage._replace(free=1 << 20))
    with pytest.raises(batch.BatchError, match="1 MB are free, about 51 MB are needed"):
        lab.run()
    assert not lab.out.exists()


def test_no_input_is_where_results_go(lab):
    lab.videos("ok")
    lab.run()
    (lab.out / "walk").mkdir()
    (lab.out / "walk" / "0001.png").write_text("a picture")
    given = {
        "a video": {"video": lab.out / "v00" / "track.csv", "name": "v00"},
        "images": {"video": lab.out / "walk", "fps": 25},
        "a camera": {"video": lab.folder / "v00.mp4", "camera": lab.out / "v00" / "run.json"},
        "boxes": {"video": lab.folder / "v00.mp4", "boxes": lab.out / "status.csv"},
    }
    before = {path: path.read_bytes() for path in lab.out.rglob("*") if path.is_file()}
    for row in given.values():
        # `skip_bad`: the content of these files is not what is tested.
        with pytest.raises(batch.ManifestError, match=r"row 1: .*: is where results go \(.*give another"):
            batch.run([row], lab.out, command=lab.command, resume=True, skip_bad=True)
    assert {path: path.read_bytes() for path in lab.out.rglob("*") if path.is_file()} == before
    lab.manifest.write_text(f"video,fps\n{lab.out / 'walk'},25\n")
    checked = subprocess.run(
        memo_command(lab.manifest, "--check", "--out", lab.out), capture_output=True, text=True
    )
    assert checked.returncode == 1 and "walks.csv, line 2: " in checked.stderr
    assert "is where results go" in checked.stderr


@pytest.mark.parametrize("kind", ["folder", "file", "link to results", "link to nothing"])
def test_nothing_but_results_is_replaced_by_results(lab, kind):
    lab.videos("ok", "ok")
    lab.run()
    place, elsewhere = lab.out / "v01", lab.folder / "elsewhere"
    place.rename(elsewhere)
    if kind == "folder":
        place.mkdir()
        (place / "diary.txt").write_text("precious")
    elif kind == "file":
        place.write_text("precious")
    else:
        place.symlink_to(elsewhere if kind == "link to results" else lab.folder / "nowhere")
    lab.videos("ok", "ok", "ok", heights=[1.6, 1.8, 1.7])
    before = {path: path.read_bytes() for path in lab.folder.rglob("*.*") if path.is_file()}
    told = rf"walks.csv, line 3: {place}: is not a folder of results of memo and would be replaced; move it"
    with pytest.raises(batch.ManifestError, match=told):
        lab.run(resume=True)
    assert {path: path.read_bytes() for path in lab.folder.rglob("*.*") if path.is_file()} == before
    checked = subprocess.run(
        memo_command(lab.manifest, "--check", "--out", lab.out), capture_output=True, text=True
    )
    assert checked.returncode == 1 and re.search(told, checked.stderr)
    place.rename(lab.folder / "moved")
    assert lab.run(resume=True).done_now == 3 and set(lab.states().values()) == {"done"}


def test_results_without_a_record_are_made_again(lab):
    lab.videos("ok", "ok")
    lab.run()
    (lab.out / ".batch" / "records" / "v01.json").unlink()  # as if killed after the folder was placed
    assert lab.run(resume=True).done_now == 1 and set(lab.states().values()) == {"done"}
    assert not lab.strays()


def test_a_disk_that_fills_up_stops_the_run_and_not_the_videos(lab, monkeypatch):
    lab.videos("ok", "fails", "ok", "ok")
    usage, full = shutil.disk_usage("/"), lab.out / "v00"
    monkeypatch.setattr(shutil, "disk_usage", lambda _: usage._replace(free=1 if full.exists() else 1 << 40))
    with pytest.raises(batch.BatchError, match="the disk is full"):
        lab.run(jobs=1)
    monkeypatch.undo()
    lab.run(resume=True)
    assert list(lab.states().values()) == ["done", "failed", "done", "done"]


# Kills.


def test_killed_at_any_moment_it_resumes_to_the_same_results(lab):
    lab.videos(*["sleeps 0.05", "ok", "nobody", "fails", "SIGSEGV"] * 3)
    lab.run(lab.folder / "undisturbed")
    expected = lab.results(lab.folder / "undisturbed")
    kill_and_resume(lab, lab.start, expected, KILLS, longest_s=1.3)


def kill_and_resume(lab, start, expected, kills, longest_s):
    """Kills runs, every second one while files are unfinished, the others at random moments, and resumes
    them; in the end every result must be as expected, and nothing else be there."""
    chance, count, amid = random.Random(1), 0, 0
    while count < kills:
        shutil.rmtree(lab.out, ignore_errors=True)
        for _ in range(4):
            killed = kill(start(), lab.out, chance, longest_s, amid_files=count % 2 == 0)
            if killed is None:
                break
            count, amid = count + 1, amid + killed
        else:
            last = start()
            _, complaints = last.communicate()
            assert last.returncode == 0, complaints
        assert lab.results() == expected
        assert not lab.strays()
        assert not [path for path in lab.out.rglob("*") if is_unfinished(path.name)]
        wait_for(lambda: not lab.processes())
    assert amid >= (kills - 3) // 2
    print(f"{count} kills, {amid} of them with unfinished files")


def kill(run, out, chance, longest_s, amid_files):
    """Kills a run or all its processes; whether files were unfinished, or None if it had ended by itself."""
    end = time.monotonic() + (LONGEST_S if amid_files else chance.uniform(0.05, longest_s))
    while time.monotonic() < end and not (amid_files and unfinished(out)):
        if run.poll() is not None:
            assert run.returncode == 0
            return None
        time.sleep(0.001)
    time.sleep(chance.uniform(0, 0.1))
    found = unfinished(out)
    (os.kill if chance.random() < 0.5 else os.killpg)(run.pid, signal.SIGKILL)
    run.communicate()
    return found


def unfinished(out):
    try:
        return bool(os.listdir(out / ".batch" / "1-of-1.work"))
    except FileNotFoundError:  # not yet, or no more
        return False


def wait_for(condition, seconds=LONGEST_S):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.02)


def test_children_end_with_a_killed_run_and_the_lock_with_it(lab):
    lab.videos("sleeps 60", "sleeps 60", "ok")
    run = lab.start()
    wait_for(
        lambda: len([line for _, line in lab.processes() if "--out" in line]) == 2 and lab_done(lab, "v02")
    )
    with pytest.raises(batch.BatchError, match="another run uses this folder"):
        lab.run(resume=True)
    run.kill()
    run.communicate()
    wait_for(lambda: not lab.processes())
    lab.videos("ok", "ok", "ok")
    assert lab.run(resume=True).done_now == 2 and set(lab.states().values()) == {"done"}


def lab_done(lab, name):
    return OutFolder(lab.out).record(name) is not None


def test_a_child_killed_from_outside_costs_its_video_alone(lab):
    lab.videos("sleeps 60", "ok", "ok", "ok")
    done = []
    thread = threading.Thread(target=lambda: done.append(lab.run()))
    thread.start()
    wait_for(lambda: any("v00.mp4" in line for _, line in lab.processes()))
    for pid, line in lab.processes():
        if "v00.mp4" in line:
            os.kill(pid, signal.SIGKILL)
    thread.join(LONGEST_S)
    assert lab.states() == {"v00": "crashed", "v01": "done", "v02": "done", "v03": "done"}
    assert done[0].records[0].message == "killed by SIGKILL"


def test_interrupted_it_ends_its_children_and_keeps_what_is_done(lab):
    lab.videos("ok", "sleeps 60", "sleeps 60", "sleeps 60", "ok")
    run = lab.start()
    wait_for(lambda: lab_done(lab, "v00") and sum("--out" in line for _, line in lab.processes()) == 3)
    run.send_signal(signal.SIGINT)
    _, complaints = run.communicate(timeout=LONGEST_S)
    assert b"KeyboardInterrupt" in complaints
    assert not lab.processes() and not lab.strays()
    assert list(lab.states().values()) == ["done", "waiting", "waiting", "waiting", "waiting"]


# Several machines.


def test_shards_do_every_video_once_and_their_tables_are_one(lab):
    lab.videos(*["ok", "nobody", "fails", "ok"] * 3, heights=[1.5 + 0.02 * k for k in range(12)])
    lab.run(lab.folder / "whole")
    results = {}

    def work(part):
        results[part] = lab.run(shard=(part, 3), jobs=2)

    threads = [threading.Thread(target=work, args=(part,)) for part in (1, 2, 3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert lab.results() == lab.results(lab.folder / "whole") and not lab.strays()
    assert [result.done_now for result in results.values()] == [4, 4, 4]
    with pytest.raises(batch.BatchError, match="have been run here"):
        lab.run(shard=(2, 3))
    assert lab.run(shard=(1, 2), resume=True).done_now == 0


def test_shards_of_another_division_are_refused_meanwhile(lab):
    lab.videos("ok", "ok")
    with OutFolder(lab.out, (1, 2)).taken():
        with pytest.raises(batch.BatchError, match="shard 1/2 runs here"):
            lab.run(shard=(1, 3))
        assert lab.run(shard=(2, 2)).done_now == 1
    assert lab.run(resume=True).done_now == 1


def test_any_executor_will_do(lab):
    lab.videos("ok", "SIGSEGV", "nobody", "fails")
    lab.run(lab.folder / "here")
    with ProcessPoolExecutor(2) as pool:
        lab.run(executor=pool)
    assert lab.results() == lab.results(lab.folder / "here")

    class Serial(Executor):
        def submit(self, work, /, *arguments, **named):
            future = Future()
            future.set_result(work(*arguments, **named))
            return future

    lab.run(lab.folder / "serial", executor=Serial())
    assert lab.results(lab.folder / "serial") == lab.results(lab.folder / "here")


def test_a_lost_worker_is_told(lab):
    class Losing(Executor):
        lost = False

        def submit(self, work, /, *arguments, **named):
            future = Future()
            if self.lost:
                future.set_result(work(*arguments, **named))
            else:
                self.lost = True
                future.set_exception(RuntimeError("the machine was switched off"))
            return future

    lab.videos("ok", "ok")
    result = lab.run(executor=Losing())
    assert set(lab.states().values()) == {"done"}
    assert "1 worker was lost; its video was given to another." in result.notes


def test_a_broken_pool_is_told_and_loses_nothing_for_good(lab):
    lab.videos("ok", f"kills-its-worker {lab.folder / 'killed'}", "sleeps 0.2", "ok", "ok")
    with ProcessPoolExecutor(2) as pool:
        result = lab.run(executor=pool)
    assert result.left and any("The executor failed" in note for note in result.notes)
    assert len(result.left) + len(result.records) == 5 and result.unfinished == len(result.left)
    lab.run(resume=True)
    assert set(lab.states().values()) == {"done"}
    assert not lab.strays()  # not even of a worker that wrote until the pool's end


def test_an_interrupted_pool_is_not_left_with_children(lab):
    lab.videos("sleeps 60", "sleeps 60", "ok")

    def interrupt(_):
        raise KeyboardInterrupt

    with ProcessPoolExecutor(2) as pool, pytest.raises(KeyboardInterrupt):
        lab.run(executor=pool, progress=lambda now: interrupt(now) if now.running == 2 else None)
    assert not lab.processes() and not lab.strays()


def test_a_ray_worker_that_is_killed_loses_its_video_alone(lab, monkeypatch):
    ray = pytest.importorskip("ray")
    monkeypatch.setenv("RAY_USAGE_STATS_ENABLED", "0")
    lab.videos(
        "ok", "kills-its-worker", f"kills-its-worker {lab.folder / 'killed'}", "nobody", "SIGSEGV", "ok"
    )
    ray.init(num_cpus=2, log_to_driver=False, include_dashboard=False)
    try:
        with batch.RayExecutor() as executor:
            result = lab.run(executor=executor)
    finally:
        ray.shutdown()
    assert list(lab.states().values()) == ["done", "crashed", "done", "nobody", "crashed", "done"]
    assert "3 workers were lost with this video" in result.records[1].message
    assert any("4 workers were lost; their videos were" in note for note in result.notes)
    assert not lab.processes() and not lab.strays()


# With memo itself as the child.


@pytest.fixture
def clip(write_video, luma_frames):
    return write_video("clip.mp4", luma_frames(count=8))


def test_memo_as_the_child(clip, tmp_path):
    (tmp_path / "text.mp4").write_text("no video at all")
    rows = [
        {"video": clip},
        {"video": tmp_path / "text.mp4"},
        {"video": clip, "name": "late", "frames": "50:60"},
    ]
    result = batch.run(rows, tmp_path / "out")
    assert [record.state for record in result.records] == ["nobody", "failed", "failed"]
    assert "not a video" in result.records[1].message
    assert "frame 50 was requested" in result.records[2].message
    assert (tmp_path / "out" / "clip" / "track.csv").is_file()
    alone = tmp_path / "alone"
    subprocess.run([sys.executable, "-m", "memo.cli", "track", str(clip), "--out", str(alone), "--quiet"])
    for file in ("track.csv", "events.csv"):
        assert (alone / file).read_bytes() == (tmp_path / "out" / "clip" / file).read_bytes()


def test_who_is_not_where_follow_says_has_no_row_of_somebody_else(tmp_path):
    scene = memo.demo_scene(1)
    video = grey_video(tmp_path / "clip.mkv", scene.frames)
    given = {"video": video, "height_m": scene.height_m, "plots": False, "overlay": False}
    result = batch.run([{**given, "follow": "3,3@40"}], tmp_path / "out")
    (record,) = result.records
    assert (record.state, record.walks, record.finished) == ("elsewhere", 0, True)
    assert record.message.startswith("Nobody was tracked at 3,3@40, but person 0 at ")
    assert not any("Somebody walks" in said or "3,3@40" in said for said in record.remarks)
    (row,) = table(tmp_path / "out", "gait_parameters.csv")
    assert row["camera_motion"] == "still"
    assert (row["state"], row["walk"], row["direction"]) == ("elsewhere", "", "")
    assert next(described(result)) == "1 video: 1 with nobody where follow says."
    resumed = batch.run([{**given, "follow": "3,3@40"}], tmp_path / "out", resume=True)
    assert resumed.done_now == 0 and resumed.counts["elsewhere"] == 1


@pytest.mark.skipif(sys.platform != "linux", reason="memory is looked at on Linux")
def test_memory_is_limited(lab):
    lab.videos("grows", "ok")
    result = lab.run(memory_mb=100)
    assert [record.state for record in result.records] == ["crashed", "done"]
    assert result.records[0].message == "ended because it used more than 100 MB of memory"


def test_ray_out_of_reach_is_told(lab):
    pytest.importorskip("ray")
    with pytest.raises(batch.BatchError, match=r"no Ray cluster at 127\.0\.0\.1:1"):
        batch.RayExecutor("127.0.0.1:1")


def memo_command(*arguments):
    return [sys.executable, "-m", "memo.cli", "batch", *map(str, arguments)]


def test_the_command_line(clip, tmp_path):
    manifest, out = tmp_path / "walks.csv", tmp_path / "out"
    manifest.write_text("video,height_m,name\nclip.mp4,1.7,\nclip.mp4,170,cm\nnone.mp4,1.7,\n")
    checked = subprocess.run(memo_command(manifest, "--check", "--out", out), capture_output=True, text=True)
    assert checked.returncode == 1 and not out.exists()
    assert [line.partition("csv, ")[2][:6] for line in checked.stderr.splitlines()] == ["line 3", "line 4"]
    ran = subprocess.run(
        memo_command(manifest, "--skip-bad", "--json", "--out", out), capture_output=True, text=True
    )
    assert ran.returncode == 5
    summary = json.loads(ran.stdout)
    assert (summary["videos"], summary["nobody"], summary["failed"], summary["left"]) == (3, 1, 2, 0)
    assert re.search(r"^\[3/3, 0 s left\] clip: nobody", ran.stderr, re.MULTILINE)
    manifest.write_text("video,height_m,name\nclip.mp4,1.7,\n")
    again = subprocess.run(memo_command(manifest, "--out", out), capture_output=True, text=True)
    assert again.returncode == 1 and "resume" in again.stderr
    resumed = subprocess.run(
        memo_command(manifest, "--out", out, "--resume", "--quiet"), capture_output=True, text=True
    )
    assert (resumed.returncode, resumed.stdout, resumed.stderr) == (0, "", "")


@pytest.mark.parametrize("signal_", [signal.SIGINT, signal.SIGTERM])
def test_the_command_line_interrupted(clip, tmp_path, signal_):
    manifest, out = tmp_path / "walks.csv", tmp_path / "out"
    manifest.write_text("video,name\n" + "".join(f"clip.mp4,v{k}\n" for k in range(30)))
    run = subprocess.Popen(
        memo_command(manifest, "--out", out, "--jobs", 1), stderr=subprocess.PIPE, text=True
    )
    wait_for(lambda: (out / "status.csv").exists())
    run.send_signal(signal_)
    _, complaints = run.communicate(timeout=LONGEST_S)
    assert run.returncode == 130
    assert f"memo batch {manifest} --out {out} --jobs 1 --resume" in complaints
    assert not list((out / ".batch").glob("*.work/*"))


def test_memo_killed_at_any_moment_resumes_to_the_same_results(clip, tmp_path):
    lab = Lab(tmp_path)
    names = [f"v{k}" for k in range(6 if FULL else 3)]
    lab.manifest.write_text("video,name\n" + "".join(f"clip.mp4,{name}\n" for name in names))
    batch.run(lab.manifest, tmp_path / "undisturbed")
    command = memo_command(lab.manifest, "--out", lab.out, "--resume", "--quiet")

    def start():
        return subprocess.Popen(command, process_group=0, stderr=subprocess.PIPE)

    kill_and_resume(
        lab,
        start,
        lab.results(tmp_path / "undisturbed"),
        kills=50 if FULL else 2,
        longest_s=4.0 if FULL else 1.0,
    )
