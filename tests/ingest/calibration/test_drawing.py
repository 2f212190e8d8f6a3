"""A mount by numbers: the same from words, angles and matrices; contradictions are refused."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from ingest.calibration.drawn_mount import (
    MEASURED,
    PRINTED,
    body_mount,
    body_of_camera,
    camera_mount,
    camera_of_body,
    rotation_in_words,
    rotation_of_euler,
    rotation_of_quaternion,
)
from ingest.calibration.phone_body import body_point, phone_body, phone_named
from ingest.calibration.pose_file import load_pose, load_similarity
from ingest.uncertainty import between, bounds_95, moved
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse

PHONE = phone_named("iPhone 15")


def _rotation(seed: int) -> np.ndarray:
    return Rotation.random(rng=np.random.default_rng(seed)).as_matrix()


def _code(call: object, *arguments: object) -> str:
    with pytest.raises(InputError) as caught:
        call(*arguments)  # pyright: ignore[reportCallIssue]
    return caught.value.code


def test_words_say_where_the_sides_point():
    R = rotation_in_words("screen faces +x, top edge points +z")
    np.testing.assert_allclose(R @ [0, 0, 1], [1, 0, 0], atol=1e-12)
    np.testing.assert_allclose(R @ [0, 1, 0], [0, 0, 1], atol=1e-12)
    np.testing.assert_allclose(R @ [1, 0, 0], [0, 1, 0], atol=1e-12)
    same = [
        "back faces -x; bottom edge points -z",
        "the camera looks -x and the left side points -y",
        "top points (0, 0, 2), right points y",
        "port points -z, screen faces x, right edge points +y",
    ]
    for words in same:
        np.testing.assert_allclose(rotation_in_words(words), R, atol=1e-12)


@settings(max_examples=20)
@given(seed=st.integers(0, 2**32 - 1))
def test_words_with_vectors_give_any_rotation(seed: int):
    R = _rotation(seed)
    up, out = (f"({v[0]:.4f}, {v[1]:.4f}, {v[2]:.4f})" for v in (R[:, 1], R[:, 2]))
    found = rotation_in_words(f"top points {up}, screen faces {out}")
    np.testing.assert_allclose(found, R, atol=3e-4)


@pytest.mark.parametrize(
    ("words", "code"),
    [
        ("screen faces +x", "drawing-axes"),
        ("screen faces +x, back faces -x", "drawing-axes"),
        ("screen faces +x, top points +x", "drawing-axes"),
        ("screen faces +x, top points -x", "drawing-axes"),
        ("screen faces +x, top points (1, 0, 1)", "drawing-axes"),
        ("screen faces (0, 0, 0), top points z", "drawing-axes"),
        ("screen faces +z, top points +y, right points -x", "drawing-mirrored"),
        ("", "drawing-words"),
        ("up and down", "drawing-words"),
        ("screen faces +x, top points +z please", "drawing-words"),
        ("hinge points +x, top points +z", "drawing-words"),
        ("top left points +x, screen faces +z", "drawing-words"),
        ("screen faces (0, 1), top points z", "drawing-numbers"),
    ],
)
def test_words_that_contradict(words: str, code: str):
    assert _code(rotation_in_words, words) == code


@settings(max_examples=20)
@given(seed=st.integers(0, 2**32 - 1), order=st.sampled_from(["xyz", "XYZ", "zyx", "YXZ", "zxz"]))
def test_angles_and_quaternions_are_rotations(seed: int, order: str):
    R = Rotation.from_matrix(_rotation(seed))
    angles = R.as_euler(order, degrees=True)
    text = f"{order} {angles[0]:.10f}, {angles[1]:.10f}, {angles[2]:.10f}"
    np.testing.assert_allclose(rotation_of_euler(text), R.as_matrix(), atol=1e-8)
    quaternion = " ".join(f"{x:.10f}" for x in R.as_quat())
    np.testing.assert_allclose(rotation_of_quaternion(quaternion), R.as_matrix(), atol=1e-8)


def test_angles_and_quaternions_that_are_none():
    assert _code(rotation_of_euler, "10 20 30") == "drawing-euler"
    assert _code(rotation_of_euler, "xxz 10 20 30") == "drawing-euler"
    assert _code(rotation_of_euler, "xYz 10 20 30") == "drawing-euler"
    assert _code(rotation_of_euler, "xyz 10 20") == "drawing-numbers"
    assert _code(rotation_of_quaternion, "0 0 1") == "drawing-numbers"
    assert _code(rotation_of_quaternion, "0 0 1 1") == "drawing-quaternion"
    assert _code(rotation_of_quaternion, "nan 0 0 1") == "drawing-numbers"


@settings(max_examples=15)
@given(
    seed=st.integers(0, 2**32 - 1),
    point=st.sampled_from(["centre front", "top left back corner", "lens", "bottom middle back"]),
)
def test_body_and_camera_give_the_same_mount(seed: int, point: str):
    rng = np.random.default_rng(seed)
    T_object_body = np.eye(4)
    T_object_body[:3, :3], T_object_body[:3, 3] = _rotation(seed), rng.uniform(-1, 1, 3)
    at = (T_object_body @ [*body_point(PHONE, point), 1])[:3]
    by_body = body_mount(PHONE, T_object_body[:3, :3], at, point)
    T_object_phone = T_object_body @ inverse(phone_body(PHONE)[0])
    by_camera = camera_mount(T_object_phone)
    np.testing.assert_allclose(by_body.T_phone_object, by_camera.T_phone_object, atol=1e-12)
    np.testing.assert_allclose(by_body.T_phone_object @ T_object_phone, np.eye(4), atol=1e-12)
    R = T_object_phone[:3, :3]
    np.testing.assert_allclose(body_of_camera(R), T_object_body[:3, :3], atol=1e-12)
    np.testing.assert_allclose(camera_of_body(body_of_camera(R)), R, atol=1e-12)


@pytest.mark.parametrize("precision", [PRINTED, MEASURED])
def test_the_truth_is_inside_the_bounds(precision):
    rng = np.random.default_rng(1)
    inside, tries = np.zeros(2), 500
    T_object_point = np.eye(4)
    T_object_point[:3, :3], T_object_point[:3, 3] = _rotation(1), [0.2, 0.5, 0.1]
    point = "top left back corner"
    mount = body_mount(PHONE, T_object_point[:3, :3], T_object_point[:3, 3], point, precision)
    assert mount.covariance is not None
    bounds = bounds_95(mount.covariance)
    T_phone_body, of_body = phone_body(PHONE)
    T_body_point = np.eye(4)
    T_body_point[:3, 3] = body_point(PHONE, point)
    for _ in range(tries):
        real = moved(T_phone_body, rng.multivariate_normal(np.zeros(6), of_body))
        placed = moved(T_object_point, rng.multivariate_normal(np.zeros(6), precision.covariance))
        step = between(mount.T_phone_object, real @ T_body_point @ inverse(placed))
        inside += [
            1e3 * np.linalg.norm(step[3:]) < bounds.mm,
            np.degrees(np.linalg.norm(step[:3])) < bounds.deg,
        ]
    assert (np.abs(inside / tries - 0.95) < 0.025).all()


def test_millimetres_are_refused():
    T = np.eye(4)
    T[:3, 3] = [120, 0, 35]
    assert _code(camera_mount, T) == "drawing-units"
    assert _code(body_mount, PHONE, np.eye(3), T[:3, 3]) == "drawing-units"


def test_a_pose_in_a_file(tmp_path: Path):
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = _rotation(2), [0.1, 0.2, 0.3]
    path = tmp_path / "pose.txt"
    for text in ("\n".join(" ".join(map(str, row)) for row in T), str(T.tolist())):
        path.write_text(text)
        np.testing.assert_allclose(load_pose(path), T, atol=1e-9)
    for bad, code in [
        ("", "pose-unreadable"),
        ("1 2 3", "pose-unreadable"),
        (str((T * 1).tolist()).replace("1.0", "one", 1), "pose-unreadable"),
        (str(T.T.tolist()), "pose-not-rigid"),
        (str((np.diag([1, 1, -1, 1.0]) @ T).tolist()), "pose-not-rigid"),
        (str((np.diag([2, 2, 2, 1.0]) @ T).tolist()), "pose-not-rigid"),
        (str((T * np.nan).tolist()), "pose-not-rigid"),
    ]:
        path.write_text(bad)
        assert _code(load_pose, path) == code
    assert _code(load_pose, tmp_path / "none") == "pose-missing"
    path.write_text(str((T @ np.diag([2, 2, 2, 1.0])).tolist()))
    rigid, scale = load_similarity(path)
    assert scale == pytest.approx(2)
    np.testing.assert_allclose(rigid, T, atol=1e-9)
