"""AMC with its ASF: places by a chain of SciPy's rotations, the choice of the skeleton, damage."""

import contextlib
import random

import numpy as np
import pytest
from memo.formats import FormatError, read_motion
from scipy.spatial.transform import Rotation

SKELETON = """# made by hand
:version 1.10
:name test
:units
  mass 1.0
  length 0.45
  angle deg
:root
   order TX TY TZ RX RY RZ
   axis XYZ
   position 0 0 0
   orientation 0 0 0
:bonedata
{bones}:hierarchy
  begin
    root lhipjoint rhipjoint lowerback
    lhipjoint lfemur
    lfemur ltibia
    rhipjoint rfemur
    rfemur rtibia
    lowerback thorax
    thorax lclavicle rclavicle head
    lclavicle lhumerus
    lhumerus lradius
    rclavicle rhumerus
    rhumerus rradius
  end
"""
PARENTS = {
    **{"lhipjoint": "root", "rhipjoint": "root", "lowerback": "root", "lfemur": "lhipjoint"},
    **{"ltibia": "lfemur", "rfemur": "rhipjoint", "rtibia": "rfemur", "thorax": "lowerback"},
    **{"lclavicle": "thorax", "rclavicle": "thorax", "head": "thorax", "lhumerus": "lclavicle"},
    **{"lradius": "lhumerus", "rhumerus": "rclavicle", "rradius": "rhumerus"},
}
DOFS = {
    "lhipjoint": "",
    "rhipjoint": "",
    "ltibia": "rx",
    "rtibia": "rx",
    "lclavicle": "ry rz",
    "lradius": "rz ry",
}
ENDS = {
    "hipjoint": "hip",
    "femur": "knee",
    "tibia": "ankle",
    "clavicle": "shoulder",
    "humerus": "elbow",
    "radius": "wrist",
}
UNIT_M = 0.0254 / 0.45


def bone_name(name):
    side = {"l": "left", "r": "right"}.get(name[0])
    return f"{side}_{ENDS[name[1:]]}" if name[1:] in ENDS else name


@pytest.fixture
def recorded(tmp_path):
    """A skeleton with turned axes and its motion in `01.asf` and `01_05.amc`; the places that SciPy finds."""
    rng = np.random.default_rng(8)
    frames, bones, text = 7, {}, ""
    for name in PARENTS:
        direction = rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        order = "".join(rng.permutation(list("XYZ")))
        axis_deg, length = rng.uniform(-90, 90, 3), rng.uniform(2, 7)
        dofs = DOFS.get(name, "rx ry rz").split()
        bones[name] = (direction, length, order, axis_deg, dofs, rng.uniform(-80, 80, (frames, len(dofs))))
        text += (
            f"  begin\n    id 1\n    name {name}\n    direction {' '.join(map(repr, direction.tolist()))}\n"
        )
        text += f"    length {length!r}\n    axis {' '.join(map(repr, axis_deg.tolist()))} {order}\n"
        text += (
            f"    dof {' '.join(dofs)}\n    limits (-160.0 20.0)\n           (-70.0 70.0)\n" if dofs else ""
        ) + "  end\n"
    (tmp_path / "01.asf").write_text(SKELETON.format(bones=text))
    root = np.column_stack([rng.uniform(-20, 20, (frames, 3)), rng.uniform(-170, 170, (frames, 3))])
    lines = ["#!OML:ASF F:", ":FULLY-SPECIFIED", ":DEGREES"]
    for frame in range(frames):
        lines += [str(frame + 1), "root " + " ".join(map(repr, root[frame].tolist()))]
        lines += [
            f"{name} " + " ".join(map(repr, values[frame].tolist()))
            for name, (*_, dofs, values) in bones.items()
            if dofs
        ]
    (tmp_path / "01_05.amc").write_text("\n".join(lines) + "\n")

    def by_scipy(frame):
        turn = {"root": Rotation.from_euler("xyz", root[frame, 3:], degrees=True)}
        place = {"root": root[frame, :3]}
        for name, parent in PARENTS.items():
            direction, length, order, axis_deg, dofs, values = bones[name]
            # In SciPy, lower case is about fixed axes, in the order of the letters.
            by_letter = [axis_deg["XYZ".index(letter)] for letter in order]
            own = Rotation.from_euler(order.lower(), by_letter, degrees=True)
            moved = Rotation.identity()
            for dof, angle in zip(dofs, values[frame], strict=True):
                moved = Rotation.from_euler(dof[1], angle, degrees=True) * moved
            turn[name] = turn[parent] * own * moved * own.inv()
            place[name] = place[parent] + turn[name].apply(length * direction)
        return place

    return tmp_path / "01_05.amc", [by_scipy(frame) for frame in range(frames)]


def test_places_are_those_of_a_chain_of_rotations(recorded):
    path, places = recorded
    motion = read_motion(path)
    assert motion.points.shape == (7, 16, 3)
    for name in places[0]:
        own = motion.points[:, motion.names.index(bone_name(name))]
        x, y, z = UNIT_M * np.array([place[name] for place in places]).T
        assert np.allclose(own, np.stack([x, -z, y], axis=1), atol=1e-9), name  # Z up
    assert np.allclose(np.diff(motion.times_s), 1 / 120)
    assert motion.notes == (
        "The file does not say which axis is up: Y was assumed, as most files have it.",
        "An AMC file has no frame rate: 120 Hz was assumed, as of CMU's recordings.",
        "Skeleton: 01.asf.",
    )
    given = read_motion(path, up="z", rate_hz=60, unit_m=UNIT_M / 2)
    x, y, z = np.moveaxis(motion.points, -1, 0)
    assert np.allclose(given.points, np.stack([x, z, -y], axis=-1) / 2)
    assert given.times_s[1] == 1 / 60 and given.notes == ("Skeleton: 01.asf.",)


def test_the_skeleton_is_found_by_its_name(recorded):
    path, _ = recorded
    skeleton = path.with_name("01.asf")
    skeleton.rename(path.with_name("other.ASF"))
    assert read_motion(path).notes[-1] == "Skeleton: other.ASF."
    path.with_name("second.asf").write_text("")
    with pytest.raises(
        FormatError, match=r"needs its skeleton 01_05.asf in the same folder: 2 .asf files beside"
    ):
        read_motion(path)
    path.with_name("01_05.asf").write_text(path.with_name("other.ASF").read_text())
    assert read_motion(path).notes[-1] == "Skeleton: 01_05.asf."
    for entry in path.parent.glob("*.[aA][sS][fF]"):
        entry.unlink()
    with pytest.raises(FormatError, match=r"0 .asf files beside it"):
        read_motion(path)


@pytest.mark.parametrize(
    ("ending", "old", "new", "reason"),
    [
        ("amc", "lfemur", "tail", "'tail' is no bone of the skeleton"),
        ("amc", "\n2\nroot ", "\n2\nroot 1 ", "7 usable numbers, the skeleton has 6 channels of root"),
        ("amc", "\n3\nroot", "\n3\n#", "frame 3 has no line of root"),
        ("amc", "lradius ", "lradius x", "is not a finite number"),
        ("asf", ":hierarchy", ":tree", "01.asf: not an ASF file: it has no :bonedata and :hierarchy"),
        ("asf", "lfemur ltibia", "lfemur", "bone 'ltibia' is not in :hierarchy"),
        ("asf", "lfemur ltibia", "lfemur ltibia ltibia", "'ltibia' is no bone, or has a parent already"),
        ("asf", "    lhipjoint lfemur", "    nobody lfemur", "'nobody' has no parent yet"),
        ("asf", "length 0.45", "length 0", ":units length 0"),
        ("asf", "dof rx\n", "dof rx rx\n", "wanted some of tx ty tz rx ry rz"),
        ("asf", "name thorax", "name head", "two bones have the same name"),
        ("asf", "order TX", "order QX", "wanted some of tx ty tz rx ry rz"),
        ("asf", "axis XYZ", "axis XXZ", "wanted an order of axes such as XYZ, got 'xxz'"),
        ("asf", "position 0 0 0", "position 0 0", "wanted three numbers, got '0 0'"),
    ],
)
def test_damage_is_named(recorded, ending, old, new, reason):
    path, _ = recorded
    damaged = path if ending == "amc" else path.with_name("01.asf")
    text = damaged.read_text()
    assert old in text
    damaged.write_text(text.replace(old, new, 1))
    with pytest.raises(FormatError) as refused:
        read_motion(path)
    assert reason in str(refused.value) and str(path) in str(refused.value)


def test_any_damage_is_refused_or_read(recorded):
    path, _ = recorded
    draw = random.Random(3)
    words = ("nan", "1e400", "-1", "begin", "end", ":root", ":bonedata", "root", "", "x" * 500, "0", "1e300")
    for damaged in (path, path.with_name("01.asf")):
        whole = damaged.read_text()
        for _ in range(150):
            parts = whole.split(" ")
            for _ in range(draw.choice((1, 1, 3))):
                at = draw.randrange(len(parts))
                parts[at : at + draw.choice((0, 1, 5))] = [draw.choice(words)]
            damaged.write_text(" ".join(parts))
            with contextlib.suppress(FormatError):
                assert np.isfinite(read_motion(path).points).all()
        damaged.write_text(whole)


def test_displays_are_made_of_it(recorded, memo_command, tmp_path):
    path, _ = recorded
    code, said, complaint = memo_command("pointlight", path, "--out", tmp_path / "display")
    assert code == 0, complaint
    header = (tmp_path / "display" / "dots.csv").read_text().split("\n", 1)[0]
    assert "RKN_u_px" in header and "LWR_v_px" in header, (header, said)
