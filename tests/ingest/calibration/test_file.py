"""mount.json: what is written is read, and what is no rigid mount is refused."""

import json
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from ingest.mount import Mount, identity_mount
from ingest.mount_file import load_mount, save_mount
from omomo_core.errors import InputError


@settings(max_examples=20)
@given(seed=st.integers(0, 2**32 - 1))
def test_round_trip(tmp_path_factory: pytest.TempPathFactory, seed: int):
    rng = np.random.default_rng(seed)
    T = np.eye(4)
    T[:3, :3] = Rotation.random(rng=rng).as_matrix()
    T[:3, 3] = rng.uniform(-1, 1, 3)
    mount = Mount(
        T,
        "board",
        covariance=np.diag(rng.random(6)),
        residuals={"rms_mm": 3.2},
        free=("the height",),
        note="chair",
        date="2026-11-21",
        phone="iPhone 15",
        object_id="chair, 52 x 55 x 98 cm from 0 0 0",
        object_scale=1.25,
        picture="mount.png",
    )
    path = tmp_path_factory.mktemp("mount") / "mount.json"
    save_mount(mount, path)
    back = load_mount(path)
    np.testing.assert_allclose(back.T_phone_object, T, rtol=0, atol=1e-15)
    assert back.covariance is not None
    np.testing.assert_array_equal(back.covariance, mount.covariance)
    for name in {f.name for f in fields(Mount)} - {"T_phone_object", "covariance"}:
        assert getattr(back, name) == getattr(mount, name)
    assert [p.name for p in path.parent.iterdir()] == ["mount.json"]


def _load(tmp_path: Path, T: object, **more: object) -> Mount:
    path = tmp_path / "mount.json"
    path.write_text(json.dumps({"T_phone_object": T, "method": "by hand"} | more))
    return load_mount(path)


def _error(tmp_path: Path, T: object, **more: object) -> InputError:
    with pytest.raises(InputError) as caught:
        _load(tmp_path, T, **more)
    return caught.value


def test_identity_and_small_rounding_are_accepted(tmp_path: Path):
    rounded = Rotation.from_rotvec([0.4, -0.3, 0.9]).as_matrix().round(4)
    T = np.eye(4)
    T[:3, :3] = rounded
    R = _load(tmp_path, T.tolist()).T_phone_object[:3, :3]
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(R, rounded, atol=2e-4)
    np.testing.assert_array_equal(identity_mount().T_phone_object, np.eye(4))


def test_not_rigid_gives_the_measured_deviation(tmp_path: Path):
    scaled = np.diag([1.1, 1.1, 1.1, 1.0])
    error = _error(tmp_path, scaled.tolist())
    assert error.code == "mount-not-rigid"
    assert "0.21" in error.what
    assert "1.331" in error.what
    mirrored = np.diag([1.0, 1.0, -1.0, 1.0])
    assert "determinant -1" in _error(tmp_path, mirrored.tolist()).what
    column_major = np.eye(4)
    column_major[3, :3] = [0.1, 0.2, 0.3]
    assert _error(tmp_path, column_major.tolist()).code == "mount-not-rigid"


@pytest.mark.parametrize("bad", [float("nan"), float("inf")])
def test_not_finite(tmp_path: Path, bad: float):
    T = np.eye(4)
    T[0, 3] = bad
    assert _error(tmp_path, T.tolist()).code == "mount-not-finite"


def test_millimetres_are_refused(tmp_path: Path):
    T = np.eye(4)
    T[:3, 3] = [0, 120, 35]
    error = _error(tmp_path, T.tolist())
    assert error.code == "mount-units"
    assert "125 m" in error.what


def test_unreadable_files(tmp_path: Path):
    path = tmp_path / "mount.json"
    with pytest.raises(InputError, match="no mount file"):
        load_mount(path)
    for text in ("", "{", "[1, 2]", '{"method": "x"}', '{"T_phone_object": "identity"}'):
        path.write_text(text)
        with pytest.raises(InputError) as caught:
            load_mount(path)
        assert caught.value.code == "mount-unreadable"
        assert caught.value.where == str(path)
    assert _error(tmp_path, np.eye(3).tolist()).code == "mount-unreadable"
    bad_size = _error(tmp_path, np.eye(4).tolist(), covariance=[[1.0]])
    assert bad_size.code == "mount-unreadable"


def test_a_covariance_that_is_none_is_refused(tmp_path: Path):
    negative = np.diag([1, 1, 1, 1, 1, -1.0])
    lopsided = np.eye(6)
    lopsided[0, 5] = 0.5
    for matrix in (negative, lopsided):
        error = _error(tmp_path, np.eye(4).tolist(), covariance=matrix.tolist())
        assert error.code == "mount-covariance"


def test_a_mount_of_a_way_that_is_gone_still_loads(tmp_path: Path):
    old = {
        "residuals": {"rms_px": 0.4},
        "note": "The size of the picture on the screen was not checked.",
    }
    mount = _load(
        tmp_path, np.eye(4).tolist(), covariance=np.eye(6).tolist(), **old, method="screen"
    )
    assert (mount.method, mount.residuals) == ("screen", old["residuals"])
