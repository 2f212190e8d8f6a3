"""Record3D: portrait poses in the first frame's world, several layouts, optional depth."""

import importlib
import json
import sys
import tempfile
import zlib
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from ingest.formats import record3d
from tests.ingest.formats.logs import (
    LANDSCAPE,
    ROW,
    MakeTake,
    edit_json,
    error_of,
    seeds,
    with_pictures,
)
from tests.log_writers import write_session


def _pixel(T_world_camera: np.ndarray, K: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Column and row where a camera that looks along -z, y up, sees a point."""
    x, y, z = T_world_camera[:3, :3].T @ (point - T_world_camera[:3, 3])
    return np.array([K[2] + K[0] * x / -z, K[3] - K[1] * y / -z])


@settings(max_examples=30)
@given(seed=seeds, u=st.integers(0, 35), v=st.integers(0, 47), depth=st.floats(0.3, 4))
def test_it_sees_a_point_where_its_portrait_image_shows_it(seed: int, u: int, v: int, depth: float):
    rng = np.random.default_rng(seed)
    q, t = Rotation.random(40, rng=rng).as_quat(), rng.normal(size=(40, 3))
    fx, fy, cx, cy = 41.0, 43.0, 17.2, 24.4
    metadata = {
        "poses": np.concatenate([q, t], axis=1).tolist(),
        "K": [fx, 0, 0, 0, fy, 0, cx, cy, 1],
        "w": 36,
        "h": 48,
        "fps": 30,
        "initPose": [0, 0, 0, 1, 0, 0, 0],
    }
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "metadata").write_text(json.dumps(metadata))
        session = record3d.read(Path(folder))
    ray = np.array([(u - cx) / fx, -(v - cy) / fy, -1.0])
    point = Rotation.from_quat(q[7]).apply(depth * ray) + t[7]
    image = np.zeros((48, 36))
    image[v, u] = 1
    row, column = np.argwhere(np.rot90(image, session.image_turns))[0]
    assert session.intrinsics is not None
    seen = _pixel(session.T_world_phone[7], session.intrinsics[7], point)
    np.testing.assert_allclose(seen, [column, row], atol=1e-6)
    assert session.image_size == LANDSCAPE


def test_an_upright_phone_has_its_charging_port_to_the_right(take: MakeTake, tmp_path: Path):
    """Landscape x points to the port: down, for a phone held upright; y to the phone's right."""
    back = record3d.read(write_session(record3d, take(0), tmp_path))
    np.testing.assert_allclose(back.T_world_phone[0, :3, :2], [[0, 1], [-1, 0], [0, 0]], atol=1e-12)


def test_without_stamps_it_uses_fps(take: MakeTake, tmp_path: Path):
    folder = write_session(record3d, take(0), tmp_path)
    edit_json(folder / "metadata", lambda v: (v.pop("frameTimestamps"), v.update(fps=25)))
    np.testing.assert_allclose(np.diff(record3d.read(folder).times), 1 / 25)


def test_it_believes_the_camera_more_than_width_and_height(take: MakeTake, tmp_path: Path):
    folder = write_session(record3d, take(0), tmp_path)
    straight = record3d.read(folder)
    edit_json(folder / "metadata", lambda v: v.update(w=1920, h=1440))
    swapped = record3d.read(folder)
    assert swapped.image_size == straight.image_size == (1920, 1440)
    np.testing.assert_array_equal(swapped.intrinsics, straight.intrinsics)


def test_the_first_camera_matrix_where_frames_have_none(take: MakeTake, tmp_path: Path):
    folder = write_session(record3d, take(0), tmp_path)
    expected = record3d.read(folder).intrinsics[0]
    edit_json(folder / "metadata", lambda v: v.pop("perFrameIntrinsicCoeffs"))
    session = record3d.read(folder)
    np.testing.assert_allclose(session.intrinsics, np.tile(expected, (len(session.times), 1)))


def test_an_export_with_separate_folders(take: MakeTake, tmp_path: Path):
    """metadata.json and rgb/; images are paired by number, not by the order of their names."""
    session = with_pictures(take(0), tmp_path / "pictures")
    folder = write_session(record3d, session, tmp_path / "take")
    (folder / "metadata").rename(folder / "metadata.json")
    (folder / "rgbd").rename(folder / "rgb")
    back = record3d.read(folder)
    assert [int(image.stem) for image in back.images] == list(range(0, 37, 3))
    np.testing.assert_array_equal(back.video_times, session.video_times)


@pytest.fixture
def lzfse(monkeypatch: pytest.MonkeyPatch):
    """The optional package, or one of the same shape where it is not installed."""
    try:
        return importlib.import_module("liblzfse")
    except ImportError:
        stand_in = SimpleNamespace(
            error=zlib.error, compress=zlib.compress, decompress=zlib.decompress
        )
        monkeypatch.setitem(sys.modules, "liblzfse", stand_in)
        return stand_in


def test_depth(take: MakeTake, lzfse, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    folder = write_session(record3d, take(0), tmp_path)
    (folder / "rgbd").mkdir()
    metres = np.arange(12, dtype=np.float32).reshape(4, 3)
    metres[0, 0] = np.nan
    (folder / "rgbd" / "9.depth").write_bytes(lzfse.compress(metres.tobytes()))
    edit_json(folder / "metadata", lambda v: v.update(dw=3, dh=4))
    session = record3d.read(folder)
    (file,) = session.depth.files
    assert session.depth.times == session.times[9]
    metres[0, 0] = 0
    np.testing.assert_array_equal(session.depth.load(file), metres)
    for damage in (b"bvx2", lzfse.compress(metres[1:].tobytes()), b"bvx2" * 1000):
        file.write_bytes(damage)
        error = error_of(file, session.depth.load)
        assert error.code == "depth-damaged"
        assert error.where == str(file)
    edit_json(folder / "metadata", lambda v: v.update(dh=40000))
    assert error_of(folder).code == "depth-damaged"
    monkeypatch.setitem(sys.modules, "liblzfse", None)
    assert record3d.read(folder).depth is None


@pytest.mark.parametrize(
    ("change", "code", "where"),
    [
        (lambda v: v["poses"].__setitem__(ROW, [0.5, 0.5, 0.5, 0.6, 0, 0, 0]), "pose-not-unit", "20"),
        (lambda v: v["poses"][ROW].pop(), "log-damaged", "poses[20]"),
        (lambda v: v["poses"][ROW].__setitem__(2, "0.5"), "log-damaged", "poses[20][2]"),
        (lambda v: v["poses"][ROW].__setitem__(2, True), "log-damaged", "poses[20][2]"),
        (lambda v: v["poses"][ROW].__setitem__(2, 10**400), "log-not-finite", "poses[20][2]"),
        (lambda v: v["frameTimestamps"].pop(), "log-damaged", "frameTimestamps"),
        (lambda v: v["perFrameIntrinsicCoeffs"].pop(), "log-damaged", "perFrameIntrinsicCoeffs"),
        (lambda v: v.update(perFrameIntrinsicCoeffs=[], K=[9, 0, 5, 0, 9, 5, 0, 0, 1]),
         "camera-damaged", "K"),
        (lambda v: v.update(frameTimestamps=None, fps=0), "log-damaged", "fps"),
    ],
)  # fmt: skip
def test_faults(take: MakeTake, tmp_path: Path, change, code: str, where: str):
    folder = write_session(record3d, take(0), tmp_path)
    edit_json(folder / "metadata", change)
    error = error_of(folder)
    assert error.code == code
    assert where in error.where.removeprefix(str(tmp_path))


@pytest.mark.parametrize("size", [{"w": 0}, {"h": -720}, {"w": 0.4}])
def test_images_without_a_size(take: MakeTake, tmp_path: Path, size: dict[str, float]):
    log = write_session(record3d, take(0), tmp_path) / "metadata"
    edit_json(log, lambda values: values.update(size))
    assert error_of(tmp_path).code == "image-size"
