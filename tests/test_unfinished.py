"""Files and folders on their way: nobody can lie in wait for them, and none is left or seen half written."""

import os
import re
import signal
import stat
import subprocess
import sys
from pathlib import Path

import memo
import numpy as np
import pytest
from memo import unfinished
from memo.files import write_columns_csv, write_json
from memo.keypoints import Keypoints, write_keypoints
from memo.unfinished import complete_file, complete_folder, is_unfinished

CAMERA = memo.Camera.level((640, 480), 60.0, 1.0, 5.0)


def write_openpose(path):
    keypoints = Keypoints.from_arrays(np.ones((2, 1, 2)), names=["right_knee"], fps=25)
    write_keypoints(path, keypoints, "openpose")


WRITERS = {
    "table.csv": lambda path: write_columns_csv(path, {"x_m": np.arange(3.0)}),
    "table.json": lambda path: write_json(path, [1]),
    "camera.toml": lambda path: CAMERA.to_toml(path),
    "walk_json": write_openpose,
}


@pytest.mark.parametrize("name", WRITERS)
@pytest.mark.parametrize("guess", [".{pid}-{name}", ".{pid}-before-{name}", "{name}.{pid}.part"])
def test_nobody_lies_in_wait_under_the_name_of_a_process(tmp_path, name, guess):
    precious, folder = tmp_path / "precious", tmp_path / "out"
    precious.write_text("mine")
    folder.mkdir()
    trap = folder / guess.format(pid=os.getpid(), name=name)
    trap.symlink_to(precious)
    WRITERS[name](folder / name)
    assert precious.read_text() == "mine" and trap.is_symlink()
    assert sorted(path.name for path in folder.iterdir()) == sorted([name, trap.name])
    assert not (folder / name).is_symlink()


@pytest.mark.parametrize("trap", ["link", "file"])
def test_what_lies_under_the_name_already_is_not_opened(tmp_path, monkeypatch, trap):
    monkeypatch.setattr(unfinished.secrets, "token_hex", lambda count: "0" * 2 * count)
    precious = tmp_path / "precious"
    precious.write_text("mine")
    lying = tmp_path / f".memo-{'0' * 16}"
    if trap == "link":
        lying.symlink_to(precious)
    else:
        lying.write_text("another's")
    for write, path in ((WRITERS["table.csv"], tmp_path / "t.csv"), (write_openpose, tmp_path / "walk_json")):
        with pytest.raises((OSError, ValueError), match="exists"):
            write(path)
        assert not path.exists() and lying.exists()
    assert precious.read_text() == "mine"


@pytest.mark.parametrize("mask", [0o022, 0o077, 0o002])
def test_results_have_the_permissions_of_any_new_file(tmp_path, mask):
    before = os.umask(mask)
    try:
        for name, write in WRITERS.items():
            write(tmp_path / name)
        (tmp_path / "any").write_text("")
        (tmp_path / "any_folder").mkdir()
    finally:
        os.umask(before)
    modes = {path.name: stat.S_IMODE(path.stat().st_mode) for path in tmp_path.iterdir()}
    assert {modes[name] for name in WRITERS if name != "walk_json"} == {modes["any"]} == {0o666 & ~mask}
    assert modes["walk_json"] == modes["any_folder"]


def test_no_two_names_are_alike_and_each_is_known_for_what_it_is(tmp_path):
    names = set()
    for _ in range(20):
        with complete_file(tmp_path / "a.csv") as file, complete_folder(tmp_path / "b") as folder:
            assert file.parent == folder.parent == tmp_path
            names |= {file.name, folder.name}
    assert len(names) == 40 and all(map(is_unfinished, names))
    assert not any(
        map(is_unfinished, ("a.csv", ".memo", ".memo-0", ".memo-" + "0" * 17, "x.memo-" + "0" * 16))
    )
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.csv", "b"]


def test_a_folder_that_fails_half_way_leaves_the_old_one(tmp_path):
    (tmp_path / "b").mkdir()
    (tmp_path / "b" / "old").write_text("")
    with pytest.raises(RuntimeError), complete_folder(tmp_path / "b") as folder:
        (folder / "half").write_text("")
        raise RuntimeError
    assert [path.name for path in tmp_path.rglob("*")] == ["b", "old"]


KILLED = """
import os, signal, sys
from pathlib import Path
from memo.unfinished import complete_file
with complete_file(sys.argv[1]) as temporary:
    temporary.write_text("half")
    os.kill(os.getpid(), signal.SIGKILL)
"""


def test_what_a_killed_process_leaves_is_known(tmp_path):
    killed = subprocess.run([sys.executable, "-c", KILLED, tmp_path / "a.csv"])
    assert killed.returncode == -signal.SIGKILL
    (left,) = tmp_path.iterdir()
    assert is_unfinished(left.name) and left.read_text() == "half"


def test_errors_name_the_file_that_was_wanted(tmp_path):
    with pytest.raises(FileNotFoundError, match=re.escape(str(tmp_path / "no" / "a.csv"))):
        write_json(tmp_path / "no" / "a.csv", 1)


def test_files_take_their_names_in_one_place():
    package = Path(memo.__file__).parent
    renaming = re.compile(r"os\.(replace|rename)\(|\.rename\(|mkstemp|mkdtemp|NamedTemporaryFile|getpid\(")
    found = {
        path.relative_to(package).as_posix()
        for path in package.rglob("*.py")
        if renaming.search(path.read_text(encoding="utf-8"))
    }
    assert found == {"unfinished.py", "batch/folder.py"}  # the latter puts finished folders in their places
