"""Pictures that COLMAP placed apart are brought in where that can be; else the true reason is said."""

from pathlib import Path

import numpy as np
import pytest

from ingest.colmap import pycolmap
from ingest.scan.cameras.metric_scale import Similarity
from ingest.scan.cameras.reconstruction import (
    joined,
    laid,
    names_of,
    poses_of,
    refine,
    triangulated,
)
from ingest.scan.cameras.register import missing
from ingest.scan.scan_types import Frame
from ingest.uncertainty import rotation

ELSEWHERE = Similarity(2.3, rotation(np.array([0.3, -0.8, 0.5])), np.array([4.0, -1.0, 2.0]))


@pytest.fixture
def scene(tmp_path: Path) -> tuple[pycolmap.Reconstruction, Path]:
    """A reconstruction of twelve pictures that all see the same points, and its database."""
    options = pycolmap.SyntheticDatasetOptions()
    options.num_rigs, options.num_frames_per_rig, options.num_points3D = 1, 12, 200
    database = tmp_path / "database.db"
    with pycolmap.Database.open(database) as opened:
        return pycolmap.synthesize_dataset(options, opened), database


def _part(model: pycolmap.Reconstruction, kept: list[str]) -> pycolmap.Reconstruction:
    part = pycolmap.Reconstruction(model)
    for image in list(part.images.values()):
        if image.name not in kept:
            part.deregister_frame(image.frame_id)
    return part


def test_models_that_share_pictures_are_joined(
    scene: tuple[pycolmap.Reconstruction, Path], tmp_path: Path
):
    model, database = scene
    names = names_of(model)
    main, second, third = (_part(model, names[a:b]) for a, b in ((0, 7), (4, 10), (7, 12)))
    laid(second, ELSEWHERE)
    laid(third, Similarity(0.4, ELSEWHERE.R.T, -ELSEWHERE.t))
    found = joined([main, second, third])
    assert found is not None
    assert sorted(found.T_model_camera) == names
    together = np.array([found.T_model_camera[name] for name in names])
    np.testing.assert_allclose(together, poses_of(model, names), atol=1e-3)
    (tmp_path / "out").mkdir()
    whole = triangulated(
        database, tmp_path, tmp_path / "out", found.T_model_camera, 8.0, found.cameras
    )
    refine(whole, intrinsics=False)
    assert names_of(whole) == names
    assert whole.num_points3D() > 150


def test_a_model_that_shares_no_picture_stays_apart(scene: tuple[pycolmap.Reconstruction, Path]):
    model, _ = scene
    names = names_of(model)
    assert joined([_part(model, names[:7]), _part(model, names[7:])]) is None
    assert joined([model]) is None


def _matched(path: Path, pairs: dict[tuple[int, int], int], count: int) -> list[Frame]:
    """A database of pictures with so many verified matches, and the frames."""
    camera = pycolmap.Camera.create_from_model_name(1, "PINHOLE", 500.0, 640, 480)
    with pycolmap.Database.open(path) as database:
        number = database.write_camera(camera)
        frames = [Frame(f"{k:05d}.jpg", path, (640, 480)) for k in range(count)]
        numbers = [
            database.write_image(pycolmap.Image(name=frame.name, camera_id=number))
            for frame in frames
        ]
        for (a, b), matches in pairs.items():
            geometry = pycolmap.TwoViewGeometry()
            geometry.inlier_matches = np.zeros((matches, 2), np.uint32)
            database.write_two_view_geometry(numbers[a], numbers[b], geometry)
    return frames


def test_the_reason_is_that_of_each_picture(tmp_path: Path):
    pairs = {(0, 1): 200, (0, 2): 80, (3, 4): 120, (3, 0): 9, (5, 1): 12}
    frames = _matched(tmp_path / "database.db", pairs, 6)
    model = pycolmap.Reconstruction()
    model.add_camera_with_trivial_rig(
        pycolmap.Camera.create_from_model_name(1, "PINHOLE", 500.0, 640, 480)
    )
    for k in range(2):
        image = pycolmap.Image(name=frames[k].name, camera_id=1, image_id=k + 1)
        model.add_image_with_trivial_frame(image, pycolmap.Rigid3d())
    left_out, notes = missing(model, frames, tmp_path / "database.db")
    reasons = {one.name: one.reason for one in left_out}
    assert "contradicts" in reasons["00002.jpg"]
    assert "80 matches with those that are placed" in reasons["00002.jpg"]
    assert "only with pictures that are left out too (00004.jpg)" in reasons["00003.jpg"]
    assert "9 matches" in reasons["00003.jpg"]
    assert reasons["00005.jpg"] == "it shares too little with the other pictures (12 matches)"
    assert [note.name for note in notes] == ["registered"]
