"""The plane of symmetry of what was filmed from one side."""

import numpy as np
import pytest

from ingest.scan.dense.dense import find_mirror, mirrored
from ingest.scan.dense.visual_hull import Evidence
from ingest.scan.dense.volume import Box
from ingest.scan.scan_quality import one_sided
from ingest.scan.scan_types import Region
from tests.ingest.scan.orbiting import registered, ring

TURN, OFFSET = 0.7, 0.04
VOXEL = 0.01


def _half_chair(rng, lopsided=0.0):
    """Points of a seat with two arms, in the frame of its plane of symmetry; the left is seen in part."""
    seat = np.column_stack(
        [rng.uniform(-0.25, 0.25, 3000), rng.uniform(-0.3, 0.2, 3000), np.full(3000, 0.4)]
    )
    back = np.column_stack(
        [rng.uniform(-0.25, 0.25, 2000), np.full(2000, -0.3), rng.uniform(0.4, 0.9, 2000)]
    )
    arm = np.column_stack(
        [np.full(1500, 0.28), rng.uniform(-0.3, 0.2, 1500), rng.uniform(0.55, 0.65, 1500)]
    )
    other = (arm * [-1, 1, 1] + [0.0, 0.0, lopsided])[arm[:, 1] > -0.05]
    return np.concatenate([seat, back, arm, other])


def _evidence(points, air):
    """Everything is air that is not near the points, or nothing is known where there is none."""
    box = Box.of(np.array([-0.6, -0.6, 0.0]), np.array([0.6, 0.6, 1.0]), VOXEL)
    field = np.full(box.shape, 1.0 if air else -1.0, np.float32)
    at = np.rint((points - box.low) / VOXEL).astype(int)
    for shift in np.indices((5, 5, 5)).reshape(3, -1).T - 2:
        x, y, z = (at + shift).T
        field[z, y, x] = 0.0
    return Evidence(box, field, np.zeros(box.shape, np.float32))


def _turned(points):
    c, s = np.cos(TURN), np.sin(TURN)
    return points @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T + OFFSET * np.array([c, s, 0])


def test_the_plane_is_found_to_millimetres():
    points = _turned(_half_chair(np.random.default_rng(1)))
    mirror = find_mirror(_evidence(points, air=False), points)
    assert mirror is not None
    truth = mirrored(points, TURN, OFFSET)
    found = points @ mirror.reflection[:3, :3].T + mirror.reflection[:3, 3]
    assert np.abs(found - truth).max() < 0.008
    assert mirror.agrees > 0.95
    assert mirror.larger(2.0).reflection[:3, 3] == pytest.approx(2 * mirror.reflection[:3, 3])


def test_an_object_whose_halves_differ_has_none():
    rng = np.random.default_rng(2)
    blob = np.concatenate(
        [
            rng.normal(size=(1500, 3)) * [0.02, 0.15, 0.02] + [0.2, 0.1, 0.3],
            rng.normal(size=(1500, 3)) * [0.12, 0.02, 0.02] + [-0.1, -0.15, 0.6],
            rng.normal(size=(1500, 3)) * [0.02, 0.02, 0.12] + [0.0, 0.25, 0.75],
        ]
    ).clip([-0.5, -0.5, 0.05], [0.5, 0.5, 0.95])
    assert find_mirror(_evidence(blob, air=True), blob) is None


def test_too_few_points_tell_nothing():
    points = _half_chair(np.random.default_rng(3))[:100]
    assert find_mirror(_evidence(points, air=False), points) is None


@pytest.mark.parametrize(("turn", "expected"), [(2 * np.pi, False), (np.pi, True)])
def test_a_film_of_one_side_is_told_from_one_all_around(turn, expected):
    views = registered(ring([0, 0, 0.5], turn=turn), np.zeros((0, 3))).views
    region = Region(np.eye(4), np.array([-0.3, -0.3, 0.0]), np.array([0.3, 0.3, 1.0]))
    assert one_sided(views, region) is expected
