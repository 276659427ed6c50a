"""Calibration files against OpenCV, which writes them and projects the same points."""

import json
import tomllib

import memo
import numpy as np
import pytest
from conftest import opencv_pixels

cv2 = pytest.importorskip("cv2")

MATRIX = np.array([[702.5, 0.0, 321.25], [0.0, 698.0, 236.5], [0.0, 0.0, 1.0]])
LENS = np.array([-0.21, 0.04, 0.0011, -0.0023, 0.007])
RVEC, TVEC = np.array([1.62, 0.11, -0.07]), np.array([0.12, 0.98, 6.06])
POINTS = np.random.default_rng(3).uniform([-2, -1, 0], [2, 1, 2], (50, 3))


def projected():
    return cv2.projectPoints(POINTS, RVEC, TVEC, MATRIX, LENS)[0].reshape(-1, 2)


def written(path, **changes):
    entries = {
        "image_width": 640,
        "image_height": 480,
        "camera_matrix": MATRIX,
        "distortion_coefficients": LENS.reshape(1, -1),
        "rvec": RVEC.reshape(3, 1),
        "tvec": TVEC.reshape(3, 1),
    } | changes
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    for name, value in entries.items():
        if value is not None:
            storage.write(name, value)
    storage.release()
    return path


@pytest.mark.parametrize("suffix", ["yml", "yaml", "xml", "json"])
def test_what_opencv_writes_projects_as_opencv_does(tmp_path, suffix):
    for name, changes in {
        "vectors": {},
        "matrix": {"rvec": None, "tvec": None, "R": cv2.Rodrigues(RVEC)[0], "T": TVEC.reshape(1, 3)},
        "flat": {"rvec": RVEC, "tvec": TVEC},
        "named": {"camera_matrix": None, "cameraMatrix": MATRIX, "calibration_time": "Mon: 3", "flags": 0},
    }.items():
        camera = memo.Camera.from_file(written(tmp_path / f"{name}.{suffix}", **changes))
        assert camera.size == (640, 480)
        np.testing.assert_allclose(camera.project(POINTS), projected(), atol=1e-9, rtol=0)


def test_files_of_opencv_up_to_4(tmp_path):
    path = written(tmp_path / "camera.yml")
    path.write_text(path.read_text().replace("%YAML 1.2", "%YAML:1.0"))
    np.testing.assert_allclose(memo.Camera.from_file(path).project(POINTS), projected(), atol=1e-9, rtol=0)


def test_camera_info_of_ros_is_only_a_lens(tmp_path):
    path = tmp_path / "camera_info.yaml"
    path.write_text(
        "image_width: 640\nimage_height: 480\ncamera_name: head\ncamera_matrix:\n  rows: 3\n  cols: 3\n"
        f"  data: {MATRIX.ravel().tolist()}\ndistortion_model: plumb_bob\ndistortion_coefficients:\n"
        f"  rows: 1\n  cols: 5\n  data: {LENS.tolist()}\nrectification_matrix:\n  rows: 3\n  cols: 3\n"
        f"  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]\n"
    )
    with pytest.raises(ValueError, match=r"camera_info.yaml: \[head\]: neither rotation nor translation"):
        memo.Camera.from_file(path)
    lens = memo.Camera.from_file(path, lens_only=True)
    in_camera = np.array([[0.5, -0.3, 4.0]])
    expected = cv2.projectPoints(in_camera, np.zeros(3), np.zeros(3), MATRIX, LENS)[0].reshape(-1, 2)
    np.testing.assert_allclose(lens.project(in_camera), expected, atol=1e-9, rtol=0)
    path.write_text(path.read_text().replace("plumb_bob", "equidistant"))
    with pytest.raises(ValueError, match=r"distortion_model \(line 8\): expected plumb_bob"):
        memo.Camera.from_file(path, lens_only=True)


def test_several_cameras_in_json(tmp_path):
    path = tmp_path / "cameras.json"
    one = {"size": [640, 480], "K": MATRIX.tolist(), "dist": LENS.tolist()}
    one |= {"rotation": RVEC.tolist(), "translation": TVEC.tolist()}
    path.write_text(
        json.dumps({"left": one, "right": {**one, "size": [320, 240]}, "metadata": {"error": 0.1}})
    )
    assert memo.Camera.from_file(path, "right").size == (320, 240)
    with pytest.raises(ValueError, match="2 cameras, choose one of: left, right"):
        memo.Camera.from_file(path)


def test_millimetres_are_noticed_and_taken_when_said(tmp_path):
    path = written(tmp_path / "camera.yml", tvec=TVEC.reshape(3, 1) * 1000)
    with pytest.raises(ValueError, match=r"tvec \(line 21\).*0.19 px high.*millimetres.*it would be 193 px"):
        memo.Camera.from_file(path)
    camera = memo.Camera.from_file(path, unit="mm")
    np.testing.assert_allclose(camera.project(POINTS), projected(), atol=1e-9, rtol=0)
    with pytest.raises(ValueError, match='wanted unit "m", "cm" or "mm"; got "ft"'):
        memo.Camera.from_file(path, unit="ft")


def test_dlt_coefficients_project_as_they_say(tmp_path):
    projection = MATRIX @ np.column_stack([cv2.Rodrigues(RVEC)[0], TVEC])
    coefficients = (projection / projection[2, 3]).ravel()[:11]
    upward = np.array([[1, 0, 0], [0, -1, 479], [0, 0, 1]]) @ projection
    upward = (upward / upward[2, 3]).ravel()[:11]
    path = tmp_path / "dlt.csv"
    np.savetxt(path, np.column_stack([coefficients, upward]), delimiter=",", fmt="%.17g")
    homogeneous = np.column_stack([POINTS, np.ones(50)]) @ projection.T
    expected = homogeneous[:, :2] / homogeneous[:, 2:]
    camera = memo.Camera.from_file(path, "1", size=(640, 480))
    np.testing.assert_allclose(camera.project(POINTS), expected, atol=1e-9, rtol=0)
    camera = memo.Camera.from_file(path, "2", size=(640, 480), v_up=True)
    np.testing.assert_allclose(camera.project(POINTS), expected, atol=1e-9, rtol=0)
    with pytest.raises(ValueError, match="mirror"):
        memo.Camera.from_file(path, "2", size=(640, 480))


def test_what_is_written_is_read_by_others(tmp_path):
    source = memo.Camera.from_file(written(tmp_path / "camera.yml"))
    source.to_toml(tmp_path / "camera.toml", "cam_01")
    table = tomllib.loads((tmp_path / "camera.toml").read_text())["cam_01"]
    np.testing.assert_allclose(opencv_pixels(table, POINTS), source.project(POINTS), atol=1e-9, rtol=0)
    again = memo.Camera.from_file(tmp_path / "camera.toml")
    np.testing.assert_allclose(again.project(POINTS), source.project(POINTS), atol=1e-9, rtol=0)
    assert list(tmp_path.glob("*.part")) == []


TSAI = """<?xml version="1.0" encoding="UTF-8"?>
<Camera name="View_001"><Geometry width="768" height="576" ncx="795" nfx="752" dpx="5.1e-03" dpy="4.65e-03"/>
<Intrinsic focal="5.55" kappa1="5.1e-03" cx="324" cy="282" sx="1.09"/>
<Extrinsic tx="828.7" ty="-3175.4" tz="3.5e+04" rx="2.04" ry="-0.89" rz="-0.43"/></Camera>"""


def test_tsai_calibration_in_xml(tmp_path):
    path = tmp_path / "View_001.xml"
    path.write_text(TSAI)
    camera = memo.Camera.from_file(path)
    same = memo.Camera.from_tsai(
        size=(768, 576),
        pixel_mm=(0.0051, 0.00465),
        focal_mm=5.55,
        kappa1_per_mm2=0.0051,
        centre_px=(324, 282),
        sx=1.09,
        translation_mm=(828.7, -3175.4, 35000),
        rotation_rad=(2.04, -0.89, -0.43),
    )
    np.testing.assert_array_equal(camera.project(POINTS), same.project(POINTS))
    for broken, reason in {
        TSAI.replace("kappa1", "kappa2"): "not a Tsai calibration in XML: attribute `kappa1` is missing",
        TSAI.replace("5.55", "f"): r"\[Intrinsic\] focal \(line 3\): expected a finite number",
        TSAI[:100]: "not a XML file",
    }.items():
        path.write_text(broken)
        with pytest.raises(ValueError, match=reason):
            memo.Camera.from_file(path)


@pytest.mark.parametrize(
    ("name", "content", "reason"),
    [
        ("camera.bin", b"", "not a calibration by its name"),
        ("camera.json", b"\xff\xfe\x00", "not a JSON file: it is not text in UTF-8"),
        ("camera.json", b"", "not a JSON file"),
        ("camera.yml", b"", "no camera"),
        ("camera.json", b"[1, 2]", "no camera"),
        ("camera.csv", b"", "expected 11 rows"),
    ],
)
def test_other_files_are_refused_by_name(tmp_path, name, content, reason):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ValueError, match=rf"{name}: .*{reason}"):
        memo.Camera.from_file(tmp_path / name)
    with pytest.raises(OSError, match=r"absent\.yml"):
        memo.Camera.from_file(tmp_path / "absent.yml")
