"""Poses in npz and TUM text."""

import zipfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from ingest.animated.detect import is_animation, read_animation

SETTINGS = settings(max_examples=10, suppress_health_check=[HealthCheck.function_scoped_fixture])


def walk(seed: int, count: int) -> np.ndarray:
    """Poses that wander smoothly."""
    rng = np.random.default_rng(seed)
    clock = np.arange(count)[:, None] / 30
    T = np.tile(np.eye(4), (count, 1, 1))
    T[:, :3, 3] = rng.uniform(-1, 1, 3) * np.sin(clock * rng.uniform(0.5, 2, 3))
    turns = rng.uniform(-2, 2, 3) * np.sin(clock * rng.uniform(0.5, 2, 3))
    T[:, :3, :3] = Rotation.from_rotvec(turns).as_matrix()
    return T


def write_tum(path: Path, times: np.ndarray, T: np.ndarray, *comments: str) -> Path:
    rows = np.concatenate(
        [times[:, None], T[:, :3, 3], Rotation.from_matrix(T[:, :3, :3]).as_quat()], axis=1
    )
    lines = [" ".join(f"{x:.9f}" for x in row) for row in rows]
    path.write_text("\n".join([*comments, *lines, ""]))
    return path


@given(st.integers(0, 1000), st.integers(31, 70), st.sampled_from("yz"))
@SETTINGS
def test_poses_at_30_fps_come_back_from_every_kind(tmp_path, seed, count, up):
    T = walk(seed, count)
    xyzw = Rotation.from_matrix(T[:, :3, :3]).as_quat()
    xyzw *= np.where(np.arange(count) % 3 == 1, -1, 1)[:, None]
    np.savez(tmp_path / "a.npz", T_world_object=T, fps=30, up=up)
    np.savez(tmp_path / "b.npz", obj_pos=T[:, :3, 3], obj_rot_xyzw=xyzw, fps=30.0, up=up)
    tum = write_tum(tmp_path / "c.txt", np.arange(count) / 30, T, f"# up: {up}")
    for path in (tmp_path / "a.npz", tmp_path / "b.npz", tum):
        read = read_animation(path)
        assert read.up == up
        assert read.mesh is None
        assert read.valid.all()
        np.testing.assert_allclose(read.T_file_object, T, atol=1e-6)


def test_other_rates_are_resampled_by_time(tmp_path):
    T = np.tile(np.eye(4), (121, 1, 1))
    T[:, 0, 3] = np.arange(121) / 120
    angle = np.arange(121) / 120 * 2
    T[:, :3, :3] = Rotation.from_rotvec(np.outer(angle, [0, 0, 1])).as_matrix()
    np.savez(tmp_path / "a.npz", T_world_object=T, fps=120)
    read = read_animation(tmp_path / "a.npz")
    assert read.up == "z"
    np.testing.assert_allclose(read.T_file_object[:, 0, 3], np.arange(31) / 30, atol=1e-9)
    turned = Rotation.from_matrix(read.T_file_object[:, :3, :3]).as_rotvec()[:, 2]
    np.testing.assert_allclose(turned, np.arange(31) / 15, atol=1e-9)


def test_a_gap_in_a_recorded_motion_is_not_bridged(tmp_path):
    times, T = np.arange(90) / 30, walk(1, 90)
    keep = (times < 1.2) | (times > 1.8)
    read = read_animation(write_tum(tmp_path / "a.txt", times[keep], T[keep]))
    assert len(read.valid) == 90
    assert not read.valid[37:54].any()
    assert read.valid[:36].all()
    assert read.valid[56:].all()


def test_tum_is_a_phones_log_only_with_a_mount(tmp_path, refused):
    tum = write_tum(tmp_path / "a.txt", np.arange(40) / 30, walk(0, 40))
    assert is_animation(tum, mounted=False)
    assert not is_animation(tum, mounted=True)
    np.savez(tmp_path / "a.npz", T_world_object=walk(0, 40), fps=30)
    assert is_animation(tmp_path / "a.npz", mounted=False)
    refused("mount-unused", is_animation, tmp_path / "a.npz", mounted=True)


def test_other_things_are_no_animation(tmp_path, refused):
    np.savez(tmp_path / "weights.npz", a=np.ones(3))
    (tmp_path / "log.csv").write_text("timestamp, frame, x, y, z, qx, qy, qz, qw\n")
    (tmp_path / "notes.txt").write_text("hello\n")
    (tmp_path / "empty").write_bytes(b"")
    for path in (*tmp_path.iterdir(), tmp_path, tmp_path / "nowhere"):
        assert not is_animation(path, mounted=False)
    told = refused("animation-unknown", read_animation, tmp_path / "notes.txt")
    for kind in ("GLB", "USD", "CSV", "npz", "TUM"):
        assert kind in told


def bad_poses() -> dict[str, dict[str, object]]:
    T, one = walk(0, 40), np.tile([0.0, 0, 0, 1], (40, 1))
    hole, scaled, growing, moved = T.copy(), T.copy(), T.copy(), T.swapaxes(1, 2).copy()
    hole[17, 0, 3] = np.nan
    scaled[:, :3, :3] *= 2
    growing[20:, :3, :3] *= 1.5
    moved[:, 3, :3] = [1, 2, 3]
    zero = one.copy()
    zero[5] = 0
    return {
        "pose-not-finite": {"T_world_object": hole, "fps": 30},
        "animation-scaled": {"T_world_object": scaled, "fps": 30},
        "animation-stretched": {"T_world_object": growing, "fps": 30},
        "animation-not-affine": {"T_world_object": moved, "fps": 30},
        "quaternion-not-unit": {"obj_pos": T[:, :3, 3], "obj_rot_xyzw": zero, "fps": 30},
        "animation-one-key": {"T_world_object": T[:1], "fps": 30},
    }


@pytest.mark.parametrize("code", list(bad_poses()))
def test_bad_poses_are_named(tmp_path, refused, code):
    np.savez(tmp_path / "a.npz", **bad_poses()[code])
    refused(code, read_animation, tmp_path / "a.npz")


@pytest.mark.parametrize(
    "arrays",
    [
        {"T_world_object": np.eye(4), "fps": 30},
        {"T_world_object": walk(0, 40)},
        {"T_world_object": walk(0, 40), "fps": 0},
        {"T_world_object": walk(0, 40), "fps": 30, "up": "x"},
        {"obj_pos": np.zeros((40, 3)), "fps": 30},
        {"obj_pos": np.zeros((40, 3)), "obj_rot_xyzw": np.ones((39, 4)), "fps": 30},
    ],
)
def test_npz_of_another_layout_is_explained(tmp_path, refused, arrays):
    np.savez(tmp_path / "a.npz", **arrays)
    assert "T_world_object (T, 4, 4)" in refused("npz-keys", read_animation, tmp_path / "a.npz")


def test_pickles_and_damaged_archives_are_not_opened(tmp_path, refused):
    np.savez(tmp_path / "a.npz", T_world_object=np.array([{}], dtype=object), fps=30)
    refused("npz-damaged", read_animation, tmp_path / "a.npz")
    with zipfile.ZipFile(tmp_path / "b.npz", "w") as archive:
        archive.writestr("T_world_object.npy", b"no array")
    refused("npz-keys", read_animation, tmp_path / "b.npz")
