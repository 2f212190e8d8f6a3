"""Cameras of a scan: by a phone's poses, by pictures alone, by a model; scale and up."""

import shutil
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pycolmap
import pytest
from scipy.spatial.transform import Rotation

from ingest.calibration.scan_landmarks import read_landmarks
from ingest.formats.still_images import load_millimetres
from ingest.scan.cameras.features import CameraOptions
from ingest.scan.cameras.metric_scale import looked_at, to_phone, upright
from ingest.scan.cameras.pose_agreement import as_read, readings
from ingest.scan.cameras.register import register
from ingest.scan.scan_pictures import pick_frames
from ingest.scan.scan_sources import read_source
from ingest.scan.scan_types import Frames, Registered, ScanSource
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse
from tests.ingest.scan.filmed import film_box, off, truth
from tests.simulator.scan_film import ScanFilm


@dataclass(frozen=True)
class Scanned:
    film: ScanFilm
    source: ScanSource
    frames: Frames
    folder: Path
    found: Registered


@pytest.fixture(scope="module")
def scanned(tmp_path_factory: pytest.TempPathFactory) -> Scanned:
    folder = tmp_path_factory.mktemp("scan")
    film = film_box(folder / "session", depth=True)
    source = read_source(film.path)
    frames = pick_frames(source, folder / "work")
    return Scanned(film, source, frames, folder, register(source, frames, folder / "work"))


def _again(scanned: Scanned, folder: Path) -> Path:
    """A copy of the work folder with its features and matches, its cameras still to be found."""
    shutil.copytree(scanned.folder / "work", folder)
    (folder / "cameras.json").unlink()
    return folder


def test_a_session_is_registered_in_its_own_world_and_metres(scanned: Scanned):
    found = scanned.found
    assert len(found.views) == len(scanned.frames.frames)
    assert found.left_out == ()
    scale, shape = off(scanned.film, found)
    assert abs(scale) < 0.005
    assert shape < 0.002
    T, real = np.array([v.T_world_camera for v in found.views]), truth(scanned.film, found)
    assert np.median(np.linalg.norm(T[:, :3, 3] - real[:, :3, 3], axis=1)) < 0.02
    turn = Rotation.from_matrix(T[:, :3, :3] @ real[:, :3, :3].swapaxes(1, 2)).magnitude()
    assert np.degrees(np.median(turn)) < 0.4
    assert found.up == "arkit"
    assert found.scale.by == "arkit"
    assert abs(scale) < 3 * found.scale.sigma < 0.02
    assert found.reprojection < 1.0


def test_the_sparse_points_lie_on_what_was_filmed(scanned: Scanned):
    found = scanned.found
    T = inverse(scanned.film.T_scan_object)
    local = found.points @ T[:3, :3].T + T[:3, 3]
    on_box = (np.abs(local[:, :2]) < [0.27, 0.20]).all(axis=1) & (local[:, 2] > 0.05)
    on_box &= local[:, 2] < 0.45
    assert on_box.sum() > 50
    sides = np.abs(np.abs(local[on_box]) - [0.25, 0.18, 0.32]).min(axis=1)
    assert np.median(sides) < 0.01
    point, view = found.observed.T
    assert (np.bincount(point) >= 2).all()
    assert view.max() == len(found.views) - 1
    assert found.colours.std() > 5


def test_depth_comes_along_and_agrees_with_the_points(scanned: Scanned):
    found, ratios = scanned.found, []
    for k, view in list(enumerate(found.views))[::6]:
        assert view.depth is not None
        depth = load_millimetres(view.depth)
        T = inverse(view.T_world_camera)
        seen = found.points[found.observed[found.observed[:, 1] == k, 0]]
        local = seen @ T[:3, :3].T + T[:3, 3]
        pixel = local[:, :2] / local[:, 2:] * view.intrinsics[:2] + view.intrinsics[2:]
        at = ((pixel + 0.5) * depth.shape[1] / view.size[0] - 0.5).round().astype(int)
        measured = depth[at[:, 1].clip(0, 191), at[:, 0].clip(0, 255)]
        known = measured > 0
        ratios += (measured[known] / local[known, 2]).tolist()
    assert len(ratios) > 100
    assert abs(np.median(ratios) - 1) < 0.01


def test_the_model_beside_it_serves_the_calibration(scanned: Scanned):
    database = scanned.found.model.parent / "database.db"
    landmarks = read_landmarks(scanned.found.model, database=database)
    assert scanned.found.images == scanned.found.model.parent / "images"
    assert len(landmarks.points) == len(scanned.found.points)
    assert sum(len(s.points) for s in landmarks.sightings) > 500


def test_a_finished_scan_is_not_made_again(scanned: Scanned):
    told: list[str] = []
    again = register(
        scanned.source,
        pick_frames(scanned.source, scanned.folder / "work"),
        scanned.folder / "work",
        progress=lambda stage, done: told.append(stage),
    )
    assert told == []
    np.testing.assert_array_equal(again.points, scanned.found.points)
    assert again.scale == scanned.found.scale


def test_an_interrupted_scan_keeps_its_features_and_matches(
    scanned: Scanned, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    def refuse(*_: object, **__: object) -> None:
        raise AssertionError("made again")

    monkeypatch.setattr(pycolmap, "extract_features", refuse)
    monkeypatch.setattr(pycolmap, "match_image_pairs", refuse)
    again = register(scanned.source, scanned.frames, _again(scanned, tmp_path / "work"))
    assert len(again.views) == len(scanned.found.views)


@pytest.mark.slow
def test_without_poses_the_metre_is_that_of_the_depth_until_the_height_is_known(
    scanned: Scanned, tmp_path: Path
):
    options = CameraOptions(poses=False, height=0.41)
    found = register(
        scanned.source, scanned.frames, _again(scanned, tmp_path / "work"), options=options
    )
    assert found.scale.by == "height"
    assert len(found.views) > 25
    assert abs(off(scanned.film, found)[0]) < 0.02


@pytest.mark.parametrize("mistake", ["inverted", "logged-flipped", "turned-left"])
def test_wrong_camera_axes_are_caught_and_named(scanned: Scanned, tmp_path: Path, mistake: str):
    T = np.array([frame.T_world_camera for frame in scanned.frames.frames])
    wrong = readings(T)[mistake]
    right = next(name for name in readings(T) if np.allclose(as_read(wrong, name), T, atol=1e-9))
    frames = replace(
        scanned.frames,
        frames=tuple(
            replace(f, T_world_camera=wrong[k]) for k, f in enumerate(scanned.frames.frames)
        ),
    )
    work = _again(scanned, tmp_path / "work")
    with pytest.raises(InputError) as caught:
        register(scanned.source, frames, work)
    assert caught.value.code == "scan-axes"
    assert f"‹camera_axes› {right}" in caught.value.fix
    if mistake == "inverted":
        found = register(scanned.source, frames, work, options=CameraOptions(axes=right))
        assert len(found.views) == len(scanned.found.views)
        assert abs(off(scanned.film, found)[0]) < 0.005


def test_poses_that_do_not_belong_to_the_pictures(scanned: Scanned, tmp_path: Path):
    frames = scanned.frames.frames
    mixed = np.random.default_rng(0).permutation(len(frames))
    strange = tuple(
        replace(f, T_world_camera=frames[mixed[k]].T_world_camera) for k, f in enumerate(frames)
    )
    with pytest.raises(InputError) as caught:
        register(
            scanned.source,
            replace(scanned.frames, frames=strange),
            _again(scanned, tmp_path / "work"),
        )
    assert caught.value.code == "scan-poses"


def _log(count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """A walk around something, and the same as a phone logs it."""
    rng = np.random.default_rng(seed)
    turn = np.linspace(0, 4 * np.pi, count)
    T = np.tile(np.eye(4), (count, 1, 1))
    T[:, :3, :3] = Rotation.from_euler("z", turn[:, None]).as_matrix()
    T[:, :3, 3] = np.stack([np.cos(turn), np.sin(turn), 0.05 * turn], axis=1)
    logged = T.copy()
    logged[:, :3, 3] += np.cumsum(rng.normal(0, 0.0015, (count, 3)), axis=0)
    logged[:, :3, 3] += rng.normal(0, 0.002, (count, 3))
    jitter = Rotation.from_rotvec(rng.normal(0, np.radians(0.2), (count, 3))).as_matrix()
    logged[:, :3, :3] = jitter @ logged[:, :3, :3]
    return T, logged


def _elsewhere(T: np.ndarray, scale: float) -> np.ndarray:
    R = Rotation.from_rotvec([0.4, -1.0, 2.0]).as_matrix()
    out = T.copy()
    out[:, :3, :3] = R @ T[:, :3, :3]
    out[:, :3, 3] = scale * T[:, :3, 3] @ R.T + [3.0, -1.0, 0.5]
    return out


def test_the_metre_of_a_log_is_found_in_spite_of_its_drift():
    errors = []
    for seed in range(12):
        real, logged = _log(70, seed)
        found = to_phone(logged, _elsewhere(real, 0.31))
        errors.append(found.scale * 0.31 - 1)
        assert abs(errors[-1]) < 3 * found.sigma
        turn = found.R @ Rotation.from_rotvec([0.4, -1.0, 2.0]).as_matrix()
        assert np.degrees(Rotation.from_matrix(turn).magnitude()) < 0.3
    assert np.std(errors) < 0.003


def test_a_phone_that_corrects_its_world_midway_does_not_bend_the_scale():
    real, logged = _log(70, 1)
    logged[30:, :3, 3] += [0.15, -0.1, 0.08]
    found = to_phone(logged, _elsewhere(real, 2.0))
    assert abs(found.scale * 2.0 - 1) < 0.006


def test_up_is_found_by_how_cameras_are_held_and_by_the_floor():
    real, _ = _log(40, 0)
    T = real @ np.array([[0, 0, -1, 0], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1.0]]).T
    # Looking inwards, level, with the picture's x axis to the right.
    ahead = -real[:, :3, 0]
    right = np.cross(ahead, [0, 0, 1.0])
    T[:, :3, :3] = np.stack([right, np.cross(ahead, right), ahead], axis=2)
    T[:, 2, 3] += 0.6
    rng = np.random.default_rng(0)
    floor = np.concatenate([rng.uniform(-1, 1, (300, 2)), rng.normal(0, 0.002, (300, 1))], axis=1)
    thing = rng.uniform([-0.2, -0.2, 0], [0.2, 0.2, 0.5], (300, 3))
    R = Rotation.from_rotvec([1.0, 0.3, -0.4]).as_matrix()
    T[:, :3, :3], T[:, :3, 3] = R @ T[:, :3, :3], T[:, :3, 3] @ R.T
    found = upright(T, np.concatenate([floor, thing]) @ R.T)
    assert found.by == "floor"
    again = found.similarity.points(floor @ R.T)
    np.testing.assert_allclose(again[:, 2], 0, atol=0.01)
    alone = upright(T, thing[:20] @ R.T)
    assert alone.by == "cameras"
    tilt = np.degrees(np.arccos((alone.similarity.R @ R)[2, 2]))
    assert tilt < 3
    np.testing.assert_allclose(looked_at(T)[:3] @ R, [0, 0, 0.6 + 0.1 * np.pi], atol=0.2)
