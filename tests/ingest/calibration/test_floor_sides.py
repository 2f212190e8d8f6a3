"""The sides that an object can stand on."""

import numpy as np
import pytest
import trimesh

from ingest.calibration.floor_contacts import flat_sides
from omomo_core.motion import ObjectMesh
from tests.ingest.calibration.floor_takes import crate


def solid(mesh: trimesh.Trimesh) -> ObjectMesh:
    return ObjectMesh(np.asarray(mesh.vertices), np.asarray(mesh.faces), "solid")


def test_flat_sides_of_boxes_chairs_and_round_things():
    sides = flat_sides(crate())
    assert len(sides) == 6
    for side in sides:
        assert np.abs(side.down).max() == pytest.approx(1)
    below = next(side for side in sides if side.down[2] < -0.9)
    np.testing.assert_allclose(below.centre, 0, atol=1e-9)
    cylinder = solid(trimesh.creation.cylinder(0.2, 0.5, sections=64))
    assert sorted(round(side.down[2]) for side in flat_sides(cylinder)) == [-1, 1]
    assert flat_sides(solid(trimesh.creation.icosphere(3))) == []
    legs = [[x, y, 0.002 * np.sign(x * y)] for x in (-0.2, 0.2) for y in (-0.2, 0.2)]
    seat = [[x, y, z] for x in (-0.2, 0.2) for y in (-0.22, 0.2) for z in (0.45,)]
    back = [[x, -0.25, 0.9] for x in (-0.2, 0.2)]
    chair = ObjectMesh(np.array([*legs, *seat, *back]), np.array([[0, 1, 2]]), "chair")
    feet = [side for side in flat_sides(chair) if side.down[2] < -0.9]
    assert len(feet) == 1
    # One leg is too short: the plane is known less well than that of a true chair.
    assert np.radians(0.3) < feet[0].sd < np.radians(2)
    np.testing.assert_allclose(feet[0].down, [0, 0, -1], atol=0.02)
