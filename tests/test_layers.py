"""Who imports whom: the library and the workers of a batch need nothing of the command line's."""

import ast
import json
import os
import subprocess
import sys
from pathlib import Path

import memo
import pytest

PACKAGE = Path(memo.__file__).parent
#: All but the command line and `python -m memo`, which runs it.
LIBRARY = sorted(
    path
    for path in PACKAGE.rglob("*.py")
    if "cli" not in path.relative_to(PACKAGE).parts and path.name != "__main__.py"
)


def imported(path):
    """Every module that a file imports, wherever the import stands."""
    package = ["memo", *path.relative_to(PACKAGE).parts[:-1]]
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = ".".join(package[: len(package) - node.level + 1]) if node.level else ""
            module = ".".join(part for part in (base, node.module) if part)
            found |= {module, *(f"{module}.{alias.name}" for alias in node.names)}
    return found


def test_imports_are_seen_wherever_they_stand():
    file = PACKAGE / "cli" / "track.py"
    assert {"memo.cli.delivery", "memo.exits.Exit", "typer"} <= imported(file)


@pytest.mark.parametrize("path", LIBRARY, ids=lambda path: path.relative_to(PACKAGE).as_posix())
def test_the_library_imports_nothing_of_the_command_line(path):
    forbidden = ("memo.cli", "typer", "rich")
    assert [name for name in imported(path) for no in forbidden if f"{name}.".startswith(f"{no}.")] == []


RUN = """
import sys
from memo import batch
rows = [{"video": sys.argv[1], "height_m": 1.7}, {"video": sys.argv[1], "name": "b", "fov_deg": 3}]
result = batch.run(rows, sys.argv[2], skip_bad=True, overlay=True)
import json
print(json.dumps([[record.state, record.message] for record in result.records]))
assert not [name for name in sys.modules if name.startswith(("memo.cli", "typer", "rich"))]
"""


def test_a_batch_runs_where_typer_and_rich_are_not_installed(tmp_path, write_video, luma_frames):
    blocked = tmp_path / "blocked"
    blocked.mkdir()
    for name in ("typer", "rich", "click"):
        (blocked / f"{name}.py").write_text(f"raise ImportError('{name} is not here')")
    clip = write_video("clip.mp4", luma_frames(count=8))
    environment = {**os.environ, "PYTHONPATH": str(blocked)}
    arguments = [sys.executable, "-c", RUN, str(clip), str(tmp_path / "out")]
    done = subprocess.run(arguments, capture_output=True, text=True, env=environment, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    (state, message), (bad_state, bad) = json.loads(done.stdout)
    assert state == "nobody" and message.startswith("Nobody was seen walking.")
    assert bad_state == "failed" and "fov_deg 3 is not a field of view" in bad
    assert (tmp_path / "out" / "clip" / "track.csv").is_file()
