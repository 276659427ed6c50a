"""A camera of K, R and t, and its arrays of any shape, beside OpenCV."""

import pickle

import cv2
import memo
import numpy as np
import pytest

K = np.array([[812.0, 0.0, 331.5], [0.0, 806.0, 238.25], [0.0, 0.0, 1.0]])
TURN = np.array([1.4, 0.2, -0.3])
T = np.array([0.3, -0.4, 5.0])
LENS = np.array([-0.21, 0.07, 0.001, -0.002, 0.01])
SIZE = (640, 480)
POINTS = np.random.default_rng(3).uniform(-1, 1, (4, 5, 3))


def projected(points, lens):
    return cv2.projectPoints(points.reshape(-1, 3), TURN, T, K, lens)[0].reshape(*points.shape[:-1], 2)


@pytest.mark.parametrize(
    "rotation", [TURN, cv2.Rodrigues(TURN)[0], TURN.tolist()], ids=["vector", "matrix", "list"]
)
@pytest.mark.parametrize("lens", [None, LENS, LENS[:4]], ids=["none", "five", "four"])
def test_it_projects_as_opencv_does(rotation, lens):
    camera = memo.Camera(K, rotation, T, SIZE, distortion=lens)
    expected = projected(POINTS, np.zeros(5) if lens is None else np.asarray(lens))
    np.testing.assert_allclose(camera.project(POINTS), expected, atol=1e-9)
    assert camera.size == SIZE


def test_it_gives_back_what_it_was_made_of():
    camera = memo.Camera(K, TURN, T, SIZE, distortion=LENS)
    np.testing.assert_array_equal(camera.matrix, K)
    np.testing.assert_allclose(camera.rotation, cv2.Rodrigues(TURN)[0], atol=1e-12)
    np.testing.assert_array_equal(camera.translation, T)
    again = memo.Camera(camera.matrix, camera.rotation, camera.translation, camera.size, distortion=LENS)
    assert again == camera == pickle.loads(pickle.dumps(camera))


@pytest.mark.parametrize("shape", [(), (1,), (7,), (2, 3), (2, 0), (2, 3, 4)])
def test_arrays_keep_their_shape(shape):
    camera = memo.Camera(K, TURN, T, SIZE)
    points = np.random.default_rng(1).uniform(-1, 1, (*shape, 3))
    pixels, in_camera = camera.project(points), camera.camera_from_world(points)
    assert pixels.shape == (*shape, 2) and in_camera.shape == (*shape, 3)
    np.testing.assert_allclose(in_camera, points @ cv2.Rodrigues(TURN)[0].T + T, atol=1e-12)
    on_ground = camera.ground_points(pixels)
    assert on_ground.shape == (*shape, 3)
    flat = camera.project(points.reshape(-1, 3)).reshape(*shape, 2)
    np.testing.assert_array_equal(pixels, flat)


@pytest.mark.parametrize(
    ("changed", "complaint"),
    [
        ({"matrix": np.eye(4)}, r"\(3, 3\)"),
        ({"matrix": K + np.array([[0, 0.5, 0], [0, 0, 0], [0, 0, 0]])}, "fx, 0, cx"),
        ({"matrix": "K"}, "numbers"),
        ({"rotation": np.diag([1.0, 1.0, -1.0])}, "rotation"),
        ({"rotation": 1.1 * np.eye(3)}, "rotation"),
        ({"rotation": np.zeros(4)}, r"\(3, 3\)"),
        ({"translation": [1.0, 2.0]}, "3 numbers, got 2"),
        ({"translation": [1.0, 2.0, np.nan]}, "finite"),
        ({"translation": [0.0, 0.0, 5000.0]}, "mill"),
        ({"size": (0, 480)}, "size"),
        ({"distortion": [0.1, 0.2]}, "4 or 5 coefficients"),
    ],
)
def test_what_is_no_camera_is_refused(changed, complaint):
    given = {"matrix": K, "rotation": TURN, "translation": T, "size": SIZE} | changed
    with pytest.raises((ValueError, TypeError), match=complaint):
        memo.Camera(**given)


@pytest.mark.parametrize("points", [np.zeros((4, 2)), np.zeros(4), np.float64(1.0), [["a", "b", "c"]], None])
def test_what_are_no_points_is_refused(points):
    with pytest.raises((ValueError, TypeError), match=r"\(\.\.\., 3\)"):
        memo.Camera(K, TURN, T, SIZE).project(points)
