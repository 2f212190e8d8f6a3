"""A finished COLMAP model given for a scan."""

from pathlib import Path

import cv2
import numpy as np
import pycolmap
import pytest

from ingest.scan.mesh_sources import model_in, model_source
from ingest.scan.scan_sources import read_source
from omomo_core.errors import InputError


def _model(folder: Path, *, points: int) -> Path:
    model = pycolmap.Reconstruction()
    camera = pycolmap.Camera(
        model="PINHOLE", width=64, height=48, params=[50, 50, 32, 24], camera_id=1
    )
    model.add_camera_with_trivial_rig(camera)
    for k in (1, 2):
        image = pycolmap.Image(name=f"{k}.png", camera_id=1, image_id=k)
        image.points2D = pycolmap.Point2DList([pycolmap.Point2D([1, 1])] * points)
        pose = pycolmap.Rigid3d(pycolmap.Rotation3d(np.eye(3)), np.array([k, 0.0, 0.0]))
        model.add_image_with_trivial_frame(image, pose)
    for p in range(points):
        track = pycolmap.Track()
        track.add_element(1, p)
        track.add_element(2, p)
        model.add_point3D(np.array([0.0, 0.0, p]), track)
    folder.mkdir(parents=True)
    model.write(folder)
    return folder


def test_a_colmap_model_with_pictures_beside_it(tmp_path: Path):
    _model(tmp_path / "sparse" / "0", points=2)
    big = _model(tmp_path / "sparse" / "1", points=120)
    (tmp_path / "images").mkdir()
    for k in (1, 2):
        cv2.imwrite(str(tmp_path / "images" / f"{k}.png"), np.full((48, 64, 3), 40 * k, np.uint8))
    assert model_in(tmp_path) == big
    source = read_source(tmp_path)
    assert (source.kind, source.model) == ("colmap", big)
    assert list(source.pictures.names) == ["1.png", "2.png"]


def test_a_colmap_model_without_points_or_pictures(tmp_path: Path):
    with pytest.raises(InputError) as caught:
        model_source(_model(tmp_path / "empty", points=0))
    assert caught.value.code == "model-points"
    with pytest.raises(InputError) as caught:
        model_source(_model(tmp_path / "alone", points=120))
    assert caught.value.code == "model-images"
