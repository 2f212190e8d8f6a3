"""nerfstudio: which way is up, the transform that was applied, times and cameras that it may lack."""

import json
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from ingest.formats import nerfstudio
from tests.ingest.formats.logs import MakeTake, edit_json, error_of, seeds
from tests.log_writers import write_session


def _matrices(folder: Path) -> np.ndarray:
    """The poses as they are in the file: frames, 4, 4."""
    frames = json.loads((folder / "transforms.json").read_text())["frames"]
    return np.array([frame["transform_matrix"] for frame in frames])


def test_its_world_is_z_up(take: MakeTake, tmp_path: Path):
    saved = _matrices(write_session(nerfstudio, take(0), tmp_path))
    np.testing.assert_allclose(saved[:, 2, 3], take(0).T_world_phone[:, 1, 3], atol=1e-12)


@settings(max_examples=8)
@given(seed=seeds, rows=st.sampled_from([3, 4]))
def test_it_undoes_what_was_applied(take: MakeTake, seed: int, rows: int):
    """Whatever turned the source: z of the file is up, and an ARKit world comes back as it was."""
    session = take(seed)
    rng = np.random.default_rng(seed)
    y_to_z = Rotation.from_euler("x", 90, degrees=True)
    A = np.eye(4)
    A[:3, :3] = (Rotation.from_euler("z", rng.uniform(0, 6)) * y_to_z).as_matrix()
    A[:3, 3] = rng.normal(size=3)

    def apply(values: Any) -> None:
        for frame, T in zip(values["frames"], A @ session.T_world_phone, strict=True):
            frame["transform_matrix"] = T.tolist()
        values["applied_transform"] = A[:rows].tolist()

    with tempfile.TemporaryDirectory() as name:
        folder = write_session(nerfstudio, session, Path(name))
        edit_json(folder / "transforms.json", apply)
        back = nerfstudio.read(folder)
    np.testing.assert_allclose(back.T_world_phone, session.T_world_phone, atol=1e-9)


@pytest.mark.parametrize("order", [(1, 0, 2), (0, 2, 1)])
def test_a_source_that_is_y_down(take: MakeTake, tmp_path: Path, order: tuple[int, int, int]):
    """Worlds of OpenCV, as nerfstudio's own converters bring them to z up."""
    A = np.eye(4)[[*order, 3]]
    A[2] *= -1
    folder = write_session(nerfstudio, take(0), tmp_path)
    climb = np.diff(_matrices(folder)[:, 2, 3])
    edit_json(folder / "transforms.json", lambda v: v.update(applied_transform=A[:3].tolist()))
    back = nerfstudio.read(folder)
    np.testing.assert_allclose(np.diff(back.T_world_phone[:, 1, 3]), climb, atol=1e-12)


def test_times_from_fps(take: MakeTake, tmp_path: Path):
    folder = write_session(nerfstudio, take(0), tmp_path)
    log = folder / "transforms.json"
    edit_json(log, lambda values: [frame.pop("timestamp") for frame in values["frames"]])
    error = error_of(folder)
    assert error.code == "log-no-times"
    assert '"timestamp"' in error.fix
    assert '"fps"' in error.fix
    edit_json(log, lambda values: values.update(fps=20))
    np.testing.assert_allclose(np.diff(nerfstudio.read(folder).times), 0.05)


def test_the_common_camera_for_frames_without_their_own(take: MakeTake, tmp_path: Path):
    folder = write_session(nerfstudio, replace(take(0), intrinsics=None), tmp_path)
    assert nerfstudio.read(folder).intrinsics is None
    camera = {"fl_x": 1400, "fl_y": 1401, "cx": 950, "cy": 710, "w": 1920, "h": 1440}
    edit_json(folder / "transforms.json", lambda values: values.update(camera))
    session = nerfstudio.read(folder)
    assert session.intrinsics[5].tolist() == [1400, 1401, 950, 710]
    assert session.image_size == (1920, 1440)


@pytest.mark.parametrize(
    ("change", "code"),
    [
        (lambda v: v.update(applied_transform=(2 * np.eye(4)).tolist()), "pose-not-rigid"),
        (lambda v: v.update(applied_transform=[[1, 0, 0, 0]]), "log-damaged"),
        (lambda v: v["frames"][3].update(colmap_im_id=4), "session-no-metres"),
        (lambda v: v["frames"][3].update(file_path=4), "log-damaged"),
        (lambda v: v.update(frames={}), "log-damaged"),
    ],
)
def test_faults(take: MakeTake, tmp_path: Path, change, code: str):
    log = write_session(nerfstudio, take(0), tmp_path) / "transforms.json"
    edit_json(log, change)
    error = error_of(log, nerfstudio.read)
    assert error.code == code
    assert "transforms.json" in error.where
