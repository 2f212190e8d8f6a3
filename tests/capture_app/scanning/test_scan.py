"""From a film to an object's mesh: right, where it says it is, and whole or not at all."""

import json
import shutil
from pathlib import Path

import igl
import numpy as np
import pytest
import torch

from benchmarks.scan_chair import agreement
from capture_app.commands.scan import ScanRequest
from capture_app.scanning.scan_folder import MODEL, tidy
from capture_app.scanning.scan_object import scan_object
from ingest.calibration.scan_landmarks import read_landmarks
from ingest.colmap import pycolmap, read_model
from ingest.mesh import load_mesh
from ingest.scan.scan_types import no_progress
from omomo_core.errors import InputError
from omomo_core.geometry.distance_field import distance_field


def _off(points, vertices, faces):
    """Metres from points to a surface."""
    return np.sqrt(igl.point_mesh_squared_distance(points, vertices, faces)[0])


def test_the_mesh_is_the_box_where_it_stood(scanned):
    request, film = scanned.scan.request, scanned.film
    mesh = load_mesh(request.output)
    T = np.array(json.loads((request.work / "report.json").read_text())["T_world_object"])
    true = film.scene.mesh.vertices @ film.T_scan_object[:3, :3].T + film.T_scan_object[:3, 3]
    off = _off(mesh.vertices @ T[:3, :3].T + T[:3, 3], true, film.scene.mesh.faces)
    assert np.median(off) < 0.005
    assert mesh.vertices[:, 2].min() == pytest.approx(0, abs=1e-4)
    assert np.abs(mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0))[:2].max() < 0.02


def test_a_motion_can_tell_inside_from_outside(scanned):
    field = distance_field(load_mesh(scanned.scan.request.output))
    points = torch.tensor([[0.0, 0.0, 0.15], [0.0, 0.0, 1.0]], dtype=torch.float32)
    inside, outside = field.at(points).tolist()
    assert inside < -0.05
    assert outside > 0.4


def test_the_model_beside_it_is_in_the_frame_of_the_mesh(scanned):
    request = scanned.scan.request
    mesh = load_mesh(request.output)
    landmarks = read_landmarks(request.work / "model", request.work / "images")
    sides = np.abs(mesh.vertices).max(axis=0)
    above = (landmarks.points[:, 2] > 0.05) & (np.abs(landmarks.points) < sides + 0.01).all(axis=1)
    on = landmarks.points[above]
    assert len(on) > 20
    assert np.median(_off(on, mesh.vertices, mesh.faces)) < 0.006


def test_what_is_written_beside_the_mesh(scanned):
    work = scanned.scan.request.work
    page = (work / "report.html").read_text()
    assert "data:image/jpeg;base64" in page
    assert 'src="http' not in page
    data = json.loads((work / "report.json").read_text())
    assert data["pictures"]["registered"] == data["pictures"]["picked"]
    assert {"registered", "all around", "scale", "texture", "closed", "size"} <= {
        check["name"] for check in data["checks"]
    }
    assert set(data["seconds"]) >= {"features", "cameras", "fusion", "clean"}
    assert all((work / name).stat().st_size > 10_000 for name in ("views.png", "outline.png"))


def test_progress_goes_on_within_the_long_stages(scanned):
    heard: dict[str, list[float]] = {}
    for stage, done in scanned.told:
        heard.setdefault(stage, []).append(done)
    for stage, parts in heard.items():
        assert parts == sorted(parts), stage
        assert parts[-1] == 1.0, stage
    assert all(len(set(heard[stage])) > 3 for stage in ("look", "frames", "cameras", "fusion"))


def test_what_was_made_is_not_made_again(scanned, tmp_path):
    T = scanned.scan.cleaned.T_world_object
    low, high = T[:3, 3] - [0.1, 0.1, 0.0], T[:3, 3] + [0.1, 0.1, 0.5]
    update = {"box": (*low, *high), "vertices": 800, "replace": True}
    request = scanned.scan.request.model_copy(update=update)
    told: list[str] = []
    again = scan_object(request, lambda stage, done: told.append(stage))
    assert not {"features", "match"} & set(told)
    assert {"features", "match"} <= {stage for stage, _ in scanned.told}
    assert len(again.cleaned.mesh.vertices) < 1000


def test_a_mesh_of_that_name_stays(scanned):
    request = scanned.scan.request.model_copy(update={"replace": False})
    before = request.output.read_bytes()
    with pytest.raises(InputError) as caught:
        scan_object(request, lambda stage, done: None)
    assert caught.value.code == "output-exists"
    assert request.output.read_bytes() == before


def test_a_folder_of_somebody_else_is_left_alone(scanned, tmp_path):
    other = tmp_path / "thing.scan"
    other.mkdir()
    (other / "letter.txt").write_text("mine")
    request = scanned.scan.request.model_copy(update={"output": tmp_path / "thing.glb"})
    with pytest.raises(InputError) as caught:
        scan_object(request, lambda stage, done: None)
    assert caught.value.code == "scan-folder"
    assert [file.name for file in other.iterdir()] == ["letter.txt"]


def test_nothing_appears_when_a_scan_fails(scanned, tmp_path):
    box = scanned.scan.request.model_copy(update={"output": tmp_path / "thing.glb", "frames": 12})
    nowhere = box.model_copy(update={"source": scanned.film.path / "absent"})
    with pytest.raises(InputError):
        scan_object(nowhere, lambda stage, done: None)
    assert not (tmp_path / "thing.glb").exists()


def test_tidy_leaves_the_report_and_the_model(scanned, tmp_path):
    work = tmp_path / "thing.scan"
    for name in ("model", "images", "stereo"):
        (work / name).mkdir(parents=True)
    for name in ("report.html", "database.db", "frames.json"):
        (work / name).write_text("")
    tidy(scanned.scan.request.model_copy(update={"output": tmp_path / "thing.glb"}))
    assert {file.name for file in work.iterdir()} == {"model", "images", "report.html"}


@pytest.mark.slow
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("kind", ["text", "binary"])
def test_a_model_that_somebody_made_becomes_the_same_mesh(scanned, tmp_path, kind):
    model = pycolmap.Reconstruction(scanned.scan.request.work / "model")
    (tmp_path / "model").mkdir()
    (model.write_text if kind == "text" else model.write)(tmp_path / "model")
    request = ScanRequest(
        source=tmp_path / "model",
        output=tmp_path / "again.glb",
        images=scanned.scan.request.work / "images",
        metric=True,
    )
    made = scan_object(request, lambda stage, done: None)
    assert made.found.method == "stereo"
    # The model is in the frame of the mesh that was made last beside it.
    beside = json.loads((scanned.scan.request.work / "report.json").read_text())
    T = np.array(beside["T_world_object"]) @ made.cleaned.T_world_object
    points = load_mesh(request.output).vertices @ T[:3, :3].T + T[:3, 3]
    film = scanned.film
    true = film.scene.mesh.vertices @ film.T_scan_object[:3, :3].T + film.T_scan_object[:3, 3]
    assert np.median(_off(points, true, film.scene.mesh.faces)) < 0.006
    assert np.ptp(points[:, 2]) == pytest.approx(0.41, abs=0.02)


def test_a_clamped_phone_is_compared_with_the_features_that_the_scan_has_kept(
    scanned, tmp_path: Path
):
    """They lie beside its model; those of another model are not taken for them."""
    work = scanned.scan.request.work
    before = (work / "database.db").read_bytes()
    found = read_landmarks(work / MODEL)
    assert (work / "database.db").read_bytes() == before
    assert sum(len(sighting.points) for sighting in found.sightings) > len(found.points)
    (tmp_path / MODEL).mkdir()
    shutil.copy(work / "database.db", tmp_path)
    model = read_model(work / MODEL)
    for image in model.images.values():
        for point in image.points2D:
            point.xy = point.xy + 2.0
    model.write(tmp_path / MODEL)
    with pytest.raises(InputError, match="model-images"):
        read_landmarks(tmp_path / MODEL)
    damaged = tmp_path / "database.db"
    damaged.write_bytes(b"no database" * 1000)
    with pytest.raises(InputError, match="model-images"):
        read_landmarks(tmp_path / MODEL)
    with pytest.raises(InputError, match="model-database"):
        read_landmarks(work / MODEL, database=damaged)


@pytest.mark.slow
def test_a_draft_of_a_real_chair_has_its_legs_and_armrests(shared: Path, tmp_path: Path):
    """Its outline is that of masks that were checked by hand."""
    film, mesh = shared / "data" / "scan" / "chair_3d_scanner_app", tmp_path / "chair.glb"
    scan_object(ScanRequest(source=film, output=mesh, draft=True), no_progress)
    union, thin = np.mean([row[1:] for row in agreement(mesh, None)], axis=0)
    assert union > 0.9
    assert thin > 0.75
