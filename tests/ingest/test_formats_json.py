"""Record3D, Polycam, 3D Scanner App, NeRFCapture, nerfstudio: what they write comes back."""

import importlib
import json
import shutil
import sys
import tempfile
import zlib
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from ingest.formats import (
    arkit_data_logger,
    ios_logger,
    nerfcapture,
    nerfstudio,
    polycam,
    record3d,
    scanner_3d,
    stray_scanner,
)
from ingest.formats.depth_png import load_millimetres, save_millimetres
from ingest.session import CaptureSession, DepthLog
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse

FORMATS = (record3d, polycam, scanner_3d, nerfcapture, nerfstudio)
OTHERS = (stray_scanner, ios_logger, arkit_data_logger)
LANDSCAPE = (48, 36)
every_format = pytest.mark.parametrize("format_", FORMATS, ids=lambda f: f.NAME)
seeds = st.integers(0, 2**32 - 1)


@pytest.fixture(scope="module")
def take(wander):
    """A take that is long enough and no longer: 37 poses."""
    return lambda seed: wander(seed, seconds=1.2, rate=30.0)


def _log(format_, folder: Path) -> Path:
    """The pose file, or the twentieth where there are many."""
    if format_ is polycam:
        return sorted((folder / "keyframes" / "cameras").iterdir())[20]
    names = {
        record3d: "metadata",
        scanner_3d: "frame_00020.json",
        nerfcapture: "transforms.json",
        nerfstudio: "transforms.json",
    }
    return folder / names[format_]


def _picture() -> np.ndarray:
    """Smooth colours, different in every corner."""
    v, u = np.mgrid[: LANDSCAPE[1], : LANDSCAPE[0]]
    return np.stack([4 * u, 5 * v, 2 * (u + v)], axis=-1).astype(np.uint8)


def _with_pictures(session: CaptureSession, folder: Path) -> CaptureSession:
    """An image at every third pose and a depth map at every fifth, in landscape."""
    folder.mkdir()
    images, maps = [], []
    for i in range(0, len(session.times), 3):
        images.append(folder / f"{i}.png")
        cv2.imwrite(str(images[-1]), _picture())
    for i in range(0, len(session.times), 5):
        maps.append(folder / f"depth {i}.png")
        save_millimetres(np.full((6, 8), 1 + i / 1000, dtype=np.float32), maps[-1])
    return replace(
        session,
        image_size=LANDSCAPE,
        intrinsics=session.intrinsics / 40,
        images=tuple(images),
        video_times=session.times[::3],
        depth=DepthLog(session.times[::5], tuple(maps), load_millimetres),
    )


@settings(max_examples=8, deadline=None)
@given(seed=seeds, format_=st.sampled_from(FORMATS))
def test_poses_and_cameras_come_back(take, seed: int, format_):
    session = take(seed)
    with tempfile.TemporaryDirectory() as folder:
        back = format_.read(format_.write(session, Path(folder) / "take"))
    T = session.T_world_phone
    if format_ is record3d:
        T = record3d.T_PORTRAIT_PHONE @ inverse(T[0]) @ T
    assert back.app == format_.NAME
    assert back.gravity_aligned is (format_ is not record3d)
    np.testing.assert_allclose(back.times, session.times, rtol=0, atol=6e-7)
    np.testing.assert_allclose(back.T_world_phone, T, rtol=0, atol=1e-12)
    np.testing.assert_allclose(back.intrinsics, session.intrinsics, rtol=0, atol=1e-9)
    # 3D Scanner App says the size of its images by the images alone.
    assert back.image_size == (None if format_ is scanner_3d else session.image_size)
    assert back.images is None
    assert back.video_times is None
    assert back.depth is None


@every_format
def test_images_and_depth_come_back(take, tmp_path: Path, format_):
    session = _with_pictures(take(3), tmp_path / "pictures")
    back = format_.read(format_.write(session, tmp_path / "take"))
    assert back.image_size == LANDSCAPE
    np.testing.assert_allclose(back.video_times, session.video_times, rtol=0, atol=6e-7)
    for image in back.images:
        seen = np.rot90(cv2.imread(str(image)), back.image_turns).astype(int)
        assert np.abs(seen - _picture()).max() < 25  # JPEG
    if format_ in (record3d, nerfcapture):
        assert back.depth is None
        return
    np.testing.assert_allclose(back.depth.times, session.depth.times, rtol=0, atol=6e-7)
    for i, file in enumerate(back.depth.files):
        np.testing.assert_allclose(back.depth.load(file), 1 + 5 * i / 1000, atol=1e-6)


@every_format
def test_written_again_it_is_the_same(take, tmp_path: Path, format_):
    """Portrait images of Record3D are copied, not turned twice."""
    session = _with_pictures(take(4), tmp_path / "pictures")
    first = format_.read(format_.write(session, tmp_path / "first"))
    second = format_.read(format_.write(first, tmp_path / "second"))
    np.testing.assert_allclose(second.T_world_phone, first.T_world_phone, rtol=0, atol=1e-12)
    np.testing.assert_allclose(second.intrinsics, first.intrinsics, rtol=0, atol=1e-9)
    assert [f.read_bytes() for f in second.images] == [f.read_bytes() for f in first.images]


@every_format
def test_only_its_own_format_claims_a_session(take, tmp_path: Path, format_):
    folder = format_.write(take(0), tmp_path / "take")
    for path in (folder, _log(format_, folder)):
        assert [f for f in (*FORMATS, *OTHERS) if f.detect(path)] == [format_]
        assert format_.read(path).app == format_.NAME


@every_format
def test_sessions_of_other_apps_and_junk_are_not_claimed(take, tmp_path: Path, format_):
    for other in OTHERS:
        folder = other.write(take(0), tmp_path / other.NAME)
        assert not any(format_.detect(path) for path in (folder, *folder.iterdir()))
    junk = tmp_path / "junk"
    (junk / "keyframes" / "cameras").mkdir(parents=True)
    (junk / "keyframes" / "cameras" / "1.json").write_text('{"t_00": 1}')
    for name in ("metadata", "frame_00000.json", "frame_x.json", "transforms.json", "[]"):
        (junk / name).write_bytes(b"\xff\x00{" if name == "metadata" else b"{}")
    (junk / "metadata.json").mkdir()
    for path in (tmp_path / "nowhere", junk, *junk.iterdir()):
        assert not format_.detect(path)


# What each app's conventions mean for the motion -------------------------------------------------


def _pixel(T_world_camera: np.ndarray, K: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Column and row where a camera that looks along -z, y up, sees a point."""
    x, y, z = T_world_camera[:3, :3].T @ (point - T_world_camera[:3, 3])
    return np.array([K[2] + K[0] * x / -z, K[3] - K[1] * y / -z])


@settings(max_examples=30, deadline=None)
@given(seed=seeds, u=st.integers(0, 35), v=st.integers(0, 47), depth=st.floats(0.3, 4))
def test_record3d_sees_a_point_where_its_portrait_image_shows_it(seed, u, v, depth):
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
    seen = _pixel(session.T_world_phone[7], session.intrinsics[7], point)
    np.testing.assert_allclose(seen, [column, row], atol=1e-6)
    assert session.image_size == LANDSCAPE


def test_record3d_upright_phone_has_its_charging_port_to_the_right(take, tmp_path: Path):
    """Landscape x points to the port: down, for a phone held upright; y to the phone's right."""
    back = record3d.read(record3d.write(take(0), tmp_path))
    np.testing.assert_allclose(back.T_world_phone[0, :3, :2], [[0, 1], [-1, 0], [0, 0]], atol=1e-12)


def _metadata(folder: Path, **change) -> Path:
    values = json.loads((folder / "metadata").read_text()) | change
    kept = {key: value for key, value in values.items() if value is not None}
    (folder / "metadata").write_text(json.dumps(kept))
    return folder


def test_record3d_without_stamps_uses_fps(take, tmp_path: Path):
    folder = record3d.write(take(0), tmp_path)
    session = record3d.read(_metadata(folder, frameTimestamps=None, fps=25))
    np.testing.assert_allclose(np.diff(session.times), 1 / 25)


def test_record3d_believes_the_camera_more_than_width_and_height(take, tmp_path: Path):
    folder = record3d.write(take(0), tmp_path)
    straight = record3d.read(folder)
    swapped = record3d.read(_metadata(folder, w=1920, h=1440))
    assert swapped.image_size == straight.image_size == (1920, 1440)
    np.testing.assert_array_equal(swapped.intrinsics, straight.intrinsics)


def test_record3d_first_camera_matrix_where_frames_have_none(take, tmp_path: Path):
    folder = record3d.write(take(0), tmp_path)
    expected = record3d.read(folder).intrinsics[0]
    session = record3d.read(_metadata(folder, perFrameIntrinsicCoeffs=None))
    np.testing.assert_allclose(session.intrinsics, np.tile(expected, (len(session.times), 1)))


def test_record3d_export_with_separate_folders(take, tmp_path: Path):
    """metadata.json and rgb/; images are paired by number, not by the order of their names."""
    session = _with_pictures(take(0), tmp_path / "pictures")
    folder = record3d.write(session, tmp_path / "take")
    (folder / "metadata").rename(folder / "metadata.json")
    (folder / "rgbd").rename(folder / "rgb")
    back = record3d.read(folder)
    assert [int(image.stem) for image in back.images] == list(range(0, 37, 3))
    np.testing.assert_array_equal(back.video_times, session.video_times)


@pytest.fixture
def lzfse(monkeypatch):
    """The optional package, or one of the same shape where it is not installed."""
    try:
        return importlib.import_module("liblzfse")
    except ImportError:
        stand_in = SimpleNamespace(
            error=zlib.error, compress=zlib.compress, decompress=zlib.decompress
        )
        monkeypatch.setitem(sys.modules, "liblzfse", stand_in)
        return stand_in


def test_record3d_depth(take, lzfse, tmp_path: Path, monkeypatch):
    folder = record3d.write(take(0), tmp_path)
    (folder / "rgbd").mkdir()
    metres = np.arange(12, dtype=np.float32).reshape(4, 3)
    metres[0, 0] = np.nan
    (folder / "rgbd" / "9.depth").write_bytes(lzfse.compress(metres.tobytes()))
    session = record3d.read(_metadata(folder, dw=3, dh=4))
    (file,) = session.depth.files
    assert session.depth.times == session.times[9]
    metres[0, 0] = 0
    np.testing.assert_array_equal(session.depth.load(file), metres)
    for damage in (b"bvx2", lzfse.compress(metres[1:].tobytes()), b"bvx2" * 1000):
        file.write_bytes(damage)
        with pytest.raises(InputError) as caught:
            session.depth.load(file)
        assert caught.value.code == "depth-damaged"
        assert caught.value.where == str(file)
    with pytest.raises(InputError) as caught:
        record3d.read(_metadata(folder, dw=3, dh=40000))
    assert caught.value.code == "depth-damaged"
    monkeypatch.setitem(sys.modules, "liblzfse", None)
    assert record3d.read(folder).depth is None


def test_polycam_corrected_cameras_only_when_complete(take, tmp_path: Path):
    session = _with_pictures(take(0), tmp_path / "pictures")
    moved = session.T_world_phone.copy()
    moved[:, 0, 3] += 1
    folder = polycam.write(session, tmp_path / "take") / "keyframes"
    other = polycam.write(replace(session, T_world_phone=moved), tmp_path / "other") / "keyframes"
    for kind in ("cameras", "images"):
        shutil.copytree(other / kind, folder / f"corrected_{kind}")
    back = polycam.read(folder.parent)
    np.testing.assert_allclose(back.T_world_phone, moved, atol=1e-12)
    assert {image.parent.name for image in back.images} == {"corrected_images"}
    min((folder / "corrected_cameras").iterdir()).unlink()
    back = polycam.read(folder.parent)
    np.testing.assert_allclose(back.T_world_phone, session.T_world_phone, atol=1e-12)
    assert {image.parent.name for image in back.images} == {"images"}


def test_nerfcapture_frames_are_put_in_order(take, tmp_path: Path):
    session = take(0)
    log = nerfcapture.write(session, tmp_path) / "transforms.json"
    values = json.loads(log.read_text())
    np.random.default_rng(0).shuffle(values["frames"])
    log.write_text(json.dumps(values))
    back = nerfcapture.read(tmp_path)
    np.testing.assert_array_equal(back.times, session.times)
    np.testing.assert_allclose(back.T_world_phone, session.T_world_phone, atol=1e-12)
    np.testing.assert_array_equal(back.intrinsics, session.intrinsics)


def _transforms(folder: Path, **change) -> Path:
    log = folder / "transforms.json"
    values = json.loads(log.read_text()) | change
    log.write_text(json.dumps(values))
    return folder


def test_nerfstudio_world_is_z_up(take, tmp_path: Path):
    folder = nerfstudio.write(take(0), tmp_path)
    saved = json.loads((folder / "transforms.json").read_text())["frames"]
    heights = [frame["transform_matrix"][2][3] for frame in saved]
    np.testing.assert_allclose(heights, take(0).T_world_phone[:, 1, 3], atol=1e-12)


@settings(max_examples=8, deadline=None)
@given(seed=seeds, rows=st.sampled_from([3, 4]))
def test_nerfstudio_undoes_what_was_applied(take, seed: int, rows: int):
    """Whatever turned the source: z of the file is up, and an ARKit world comes back as it was."""
    session = take(seed)
    rng = np.random.default_rng(seed)
    y_to_z = Rotation.from_euler("x", 90, degrees=True)
    A = np.eye(4)
    A[:3, :3] = (Rotation.from_euler("z", rng.uniform(0, 6)) * y_to_z).as_matrix()
    A[:3, 3] = rng.normal(size=3)
    with tempfile.TemporaryDirectory() as name:
        folder = nerfstudio.write(session, Path(name))
        frames = json.loads((folder / "transforms.json").read_text())["frames"]
        for frame, T in zip(frames, A @ session.T_world_phone, strict=True):
            frame["transform_matrix"] = T.tolist()
        _transforms(folder, frames=frames, applied_transform=A[:rows].tolist())
        back = nerfstudio.read(folder)
    np.testing.assert_allclose(back.T_world_phone, session.T_world_phone, atol=1e-9)


@pytest.mark.parametrize("order", [(1, 0, 2), (0, 2, 1)])
def test_nerfstudio_source_that_is_y_down(take, tmp_path: Path, order):
    """Worlds of OpenCV, as nerfstudio's own converters bring them to z up."""
    A = np.eye(4)[list(order)]
    A[2] *= -1
    folder = nerfstudio.write(take(0), tmp_path)
    saved = [
        np.array(frame["transform_matrix"])
        for frame in json.loads((folder / "transforms.json").read_text())["frames"]
    ]
    back = nerfstudio.read(_transforms(folder, applied_transform=A.tolist()))
    climb = np.diff([T[2, 3] for T in saved])
    np.testing.assert_allclose(np.diff(back.T_world_phone[:, 1, 3]), climb, atol=1e-12)


def test_nerfstudio_times_from_fps(take, tmp_path: Path):
    folder = nerfstudio.write(take(0), tmp_path)
    frames = json.loads((folder / "transforms.json").read_text())["frames"]
    for frame in frames:
        del frame["timestamp"]
    _transforms(folder, frames=frames)
    with pytest.raises(InputError) as caught:
        nerfstudio.read(folder)
    assert caught.value.code == "log-no-times"
    assert '"timestamp"' in caught.value.fix
    assert '"fps"' in caught.value.fix
    session = nerfstudio.read(_transforms(folder, fps=20))
    np.testing.assert_allclose(np.diff(session.times), 0.05)


def test_nerfstudio_common_camera_for_frames_without_their_own(take, tmp_path: Path):
    folder = nerfstudio.write(replace(take(0), intrinsics=None), tmp_path)
    assert nerfstudio.read(folder).intrinsics is None
    camera = {"fl_x": 1400, "fl_y": 1401, "cx": 950, "cy": 710, "w": 1920, "h": 1440}
    session = nerfstudio.read(_transforms(folder, **camera))
    assert session.intrinsics[5].tolist() == [1400, 1401, 950, 710]
    assert session.image_size == (1920, 1440)


def test_images_outside_the_folder_are_not_there(take, tmp_path: Path):
    session = _with_pictures(take(0), tmp_path / "pictures")
    folder = nerfstudio.write(session, tmp_path / "take")
    frames = json.loads((folder / "transforms.json").read_text())["frames"]
    frames[0]["file_path"] = "../pictures/0.png"
    frames[3]["file_path"] = str(tmp_path / "pictures" / "3.png")
    frames[6]["file_path"] = "x" * 5000 + "\0"
    images = nerfstudio.read(_transforms(folder, frames=frames)).images
    assert [image.name for image in images[:2]] == ["frame_00009.png", "frame_00012.png"]
