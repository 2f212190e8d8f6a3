"""Polycam: its corrected cameras where they are complete; names that are times, images of one size."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np

from ingest.formats import polycam
from tests.ingest.formats.logs import MakeTake, edit_json, error_of, pose_file, with_pictures
from tests.log_writers import write_session


def test_corrected_cameras_only_when_complete(take: MakeTake, tmp_path: Path):
    session = with_pictures(take(0), tmp_path / "pictures")
    moved = session.T_world_phone.copy()
    moved[:, 0, 3] += 1
    folder = write_session(polycam, session, tmp_path / "take") / "keyframes"
    other = (
        write_session(polycam, replace(session, T_world_phone=moved), tmp_path / "other")
        / "keyframes"
    )
    for kind in ("cameras", "images"):
        shutil.copytree(other / kind, folder / f"corrected_{kind}")
    back = polycam.read(folder.parent)
    np.testing.assert_allclose(back.T_world_phone, moved, atol=1e-12)
    assert {image.parent.name for image in back.images} == {"corrected_images"}
    min((folder / "corrected_cameras").iterdir()).unlink()
    back = polycam.read(folder.parent)
    np.testing.assert_allclose(back.T_world_phone, session.T_world_phone, atol=1e-12)
    assert {image.parent.name for image in back.images} == {"images"}


def test_names_and_sizes(take: MakeTake, tmp_path: Path):
    folder = write_session(polycam, take(0), tmp_path)
    log = pose_file(polycam, folder)
    edit_json(log, lambda values: values.update(width=1280))
    error = error_of(folder)
    assert error.code == "image-size"
    assert log.name in error.where
    log.rename(log.with_name("keyframe 7.json"))
    error = error_of(folder)
    assert error.code == "log-no-times"
    assert "keyframe 7.json" in error.where
