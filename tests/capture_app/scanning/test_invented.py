"""What a scan only closed is marked in its mesh, and a run tells of palms that rest on it."""

import numpy as np
import pytest
import trimesh

from capture_app.pipeline import invented_notes
from ingest.mesh import load_mesh
from ingest.scan.clean_mesh import INVENTED, CleanMesh, save_mesh
from ingest.scan.scan_types import ScanMesh
from omomo_core.contact.segment import ContactSegment


@pytest.fixture
def marked(tmp_path):
    """A box whose half at x < 0 no picture shows."""
    box = trimesh.creation.box((0.5, 0.4, 0.6)).subdivide().subdivide().subdivide()
    vertices = np.asarray(box.vertices, np.float64)
    mesh = ScanMesh(vertices, np.asarray(box.faces, np.int64), None, "box")
    clean = CleanMesh(
        mesh, np.asarray(box.vertex_normals, np.float64), np.eye(4), vertices[:, 0] > 0, True
    )
    path = tmp_path / "box.glb"
    save_mesh(clean, path)
    return path


def _holds(hand, x):
    return ContactSegment(hand, 10, 40, np.array([x, 0.0, 0.05]))


def test_the_mesh_says_which_vertices_are_invented(marked):
    (part,) = trimesh.load_scene(marked, process=False).geometry.values()
    said = np.asarray(part.vertex_attributes[INVENTED]).reshape(-1)
    assert ((said > 0.5) == (np.asarray(part.vertices)[:, 0] <= 0)).all()
    assert len(load_mesh(marked).vertices) == len(said)


def test_a_palm_on_invented_surface_is_told_of(marked):
    notes = invented_notes(marked, 1.0, [_holds(0, -0.27), _holds(1, 0.27)])
    (note,) = notes
    assert note.startswith("The left palm rests on surface that no picture")
    assert "10 to 40" in note


def test_seen_surface_and_other_meshes_say_nothing(marked, tmp_path):
    assert invented_notes(marked, 1.0, [_holds(1, 0.27)]) == ()
    plain = tmp_path / "plain.glb"
    trimesh.creation.box().export(plain)
    assert invented_notes(plain, 1.0, [_holds(0, -0.5)]) == ()
    assert invented_notes(None, 1.0, [_holds(0, -0.5)]) == ()


def test_the_other_side_of_a_seat_is_not_held(tmp_path):
    """Under a seat nothing is shown: a palm on it is told of, one on its upper side is not."""
    seat = trimesh.creation.box((0.4, 0.4, 0.02)).subdivide().subdivide().subdivide().subdivide()
    vertices = np.asarray(seat.vertices, np.float64)
    mesh = ScanMesh(vertices, np.asarray(seat.faces, np.int64), None, "seat")
    seen = vertices[:, 2] > 0.005
    path = tmp_path / "seat.glb"
    save_mesh(CleanMesh(mesh, np.asarray(seat.vertex_normals), np.eye(4), seen, True), path)
    above, below = (ContactSegment(0, 0, 9, np.array([0.05, 0.05, z])) for z in (0.04, -0.04))
    assert invented_notes(path, 1.0, [above]) == ()
    assert len(invented_notes(path, 1.0, [below])) == 1
