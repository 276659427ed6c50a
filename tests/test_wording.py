"""Counts in messages: one video, two videos, wherever a message counts anything."""

import ast
import re
from pathlib import Path

import memo
import pytest
from memo.wording import counted

PACKAGE = Path(memo.__file__).parent
CRATES = Path(__file__).resolve().parents[1] / "crates"

#: What messages count.
NOUNS = (
    *("anchors", "angles", "blocks", "boards", "branches", "bytes", "cameras", "cells", "chains", "channels"),
    *("characters", "coefficients", "columns", "dots", "elements", "events", "figures", "files", "forces"),
    *("frames", "gaps", "groups", "heights", "instants", "intervals", "joints", "labels", "lengths"),
    *("lines", "links", "markers", "motions", "names", "nodes", "numbers", "parts", "people", "phases"),
    *(
        "pictures",
        "pieces",
        "pixels",
        "places",
        "points",
        "poses",
        "positions",
        "postures",
        "regions",
        "rods",
    ),
    *("rows", "scales", "scores", "segments", "sightings", "steps", "times", "tracks", "triples", "values"),
    *("videos", "views", "walks", "windows", "words", "workers"),
)
_WORDS = rf"(?:(?!as |of |and )[a-z]+ )??(?:{'|'.join(NOUNS)})\b"
_COUNTED = re.compile(rf"\s+{_WORDS}")
#: Rust: a name in braces, or none, and what it counts; `{width}x{height} pixels` is a size.
_RUST = re.compile(rf"(?<!x)\{{[a-z_.]*\}} {_WORDS}")

#: What is never one, in Rust, and why.
NEVER_ONE = {
    "the file has {} cameras, choose one": "one is taken",
    "{length} bytes are no calibration": "more than a file may have",
    "{count} parts, at most 255": "more than 255",
    "{needed} views of a rod's points": "a rod needs more than one",
    "{count} points may be {} or {}": "as many as a detector has",
    "needs at least {needed} points": "a head needs more than one",
    "none of {starts} starting poses": "a constant",
    'if *people == 1 { "1 person"': "says so itself",
}


@pytest.mark.parametrize(
    ("count", "nouns", "says"),
    [
        (0, ("frame",), "0 frames"),
        (1, ("frame",), "1 frame"),
        (2, ("frame",), "2 frames"),
        (1, ("branch", "branches"), "1 branch"),
        (3, ("branch", "branches"), "3 branches"),
    ],
)
def test_one_is_singular_and_all_else_plural(count, nouns, says):
    assert counted(count, *nouns) == says


def uncounted(path):
    """Places in a file at which a number stands before a plural that does not depend on it."""
    found = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if not isinstance(node, ast.JoinedStr):
            continue
        parts = [None, *node.values]
        for before, number, after in zip(parts, parts[1:], parts[2:], strict=False):
            if not (isinstance(number, ast.FormattedValue) and isinstance(after, ast.Constant)):
                continue
            text = ast.unparse(number.value)
            size = isinstance(before, ast.Constant) and str(before.value).endswith("x")
            words = text.startswith("counted(")
            if _COUNTED.match(str(after.value)) and not (
                size or words or text == "row" or text.isupper() or number.format_spec
            ):
                found.append(f"{path.name}:{node.lineno}: {text}{str(after.value)[:30]}")
    return found


def test_a_count_without_its_noun_is_seen(tmp_path):
    file = tmp_path / "a.py"
    file.write_text(
        "f'{n} videos'; f'{n} inner corners'; f'{w}x{h} pixels'; f'{MOST} rows'; f'{n:.1f} frames'"
    )
    assert [text.partition(": ")[2] for text in uncounted(file)] == ["n videos"]


@pytest.mark.parametrize("path", sorted(PACKAGE.rglob("*.py")), ids=lambda path: path.name)
def test_no_message_says_one_videos(path):
    assert uncounted(path) == []


SOURCES = sorted(
    path for crate in ("memo-core", "memo-py") for path in (CRATES / crate / "src").rglob("*.rs")
)


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: "/".join(path.parts[-2:]))
def test_no_message_of_the_core_says_one_points(path):
    if path.stem == "tests":
        return
    code = path.read_text(encoding="utf-8").split("#[cfg(test)]\nmod tests {")[0]
    lines = [line for line in code.splitlines() if not line.lstrip().startswith("//")]
    found = [line.strip() for line in lines if _RUST.search(line)]
    assert [line for line in found if not any(text in line for text in NEVER_ONE)] == []
