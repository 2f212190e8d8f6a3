"""Silhouettes and depth together: what is open, what is solid, and what is only thin."""

import cv2
import numpy as np
import pytest

from ingest.scan.dense.visual_hull import VisualHull, outline_distance, thin_parts
from ingest.scan.dense.volume import Box, open_places
from omomo_core.geometry.transforms import inverse
from tests.ingest.scan.orbiting import SIZE, K, ring

VOXEL = 0.01


def _matrix():
    fx, fy, cx, cy = K
    return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])


def _ball_mask(T_world_camera, radius):
    """What a camera sees of a ball that floats at (0, 0, 0.3)."""
    T = inverse(T_world_camera)
    x, y, z = T[:3, :3] @ [0.0, 0.0, 0.3] + T[:3, 3]
    u, v = np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1]))
    centre = _matrix() @ [x / z, y / z, 1.0]
    return (np.hypot(u - centre[0], v - centre[1]) < K[0] * radius / z).astype(np.uint8)


def _box(half=0.25, height=0.6):
    return Box.of(np.array([-half, -half, 0.0]), np.array([half, half, height]), VOXEL)


def test_silhouettes_alone_carve_a_ball_and_few_wrong_ones_do_not_matter():
    box, poses = _box(), ring([0.0, 0.0, 0.3], elevations=(-0.4, 0.2, 0.8))
    hull = VisualHull(box, len(poses))
    for index, T in enumerate(poses):
        mask = _ball_mask(T, 0.1)
        if index in (3, 11):
            mask[:] = 0  # These two pictures miss the ball altogether.
        hull.add(mask, np.zeros(mask.shape, np.float32), _matrix(), inverse(T))
    solid = hull.outside() < 0
    assert solid.sum() * VOXEL**3 == pytest.approx(4 / 3 * np.pi * 0.1**3, rel=0.2)
    assert (hull.backed(np.zeros(box.shape, np.float32)) == solid).all()


def test_what_depth_shows_something_before_is_not_backed():
    box, poses = _box(), ring([0.0, 0.0, 0.3])
    hull = VisualHull(box, len(poses))
    for T in poses:
        mask = _ball_mask(T, 0.1)
        hull.add(mask, np.full(mask.shape, 0.5, np.float32) * mask, _matrix(), inverse(T))
    assert not hull.backed(np.zeros(box.shape, np.float32)).any()
    assert hull.hidden().max() == len(poses)


@pytest.mark.parametrize("rim", [3, 12])
def test_only_what_is_wider_than_an_edge_is_backed_beside_depth(rim):
    box, poses = _box(), ring([0.0, 0.0, 0.3])
    hull = VisualHull(box, len(poses))
    for T in poses:
        mask = _ball_mask(T, 0.1)
        measured = cv2.erode(mask, np.ones((2 * rim + 1, 2 * rim + 1), np.uint8))
        hull.add(mask, measured.astype(np.float32), _matrix(), inverse(T))
    assert (hull.backing().max() > 0) == (rim > 10)


def test_distances_from_an_outline_change_their_sign_at_it():
    mask = np.zeros((40, 40), np.uint8)
    mask[:, :20] = 1
    row = outline_distance(mask)[20]
    assert (np.diff(row[10:30]) > 0).all()
    assert row[18] < 0 < row[21]


def test_air_under_a_seat_is_open_and_the_inside_of_a_box_is_not():
    blocked = np.zeros((40, 40, 40), np.bool_)
    unseen = np.zeros_like(blocked)
    # A seat on which cameras look down, and the air below it that they cannot see.
    blocked[20:22, 5:35, 5:35] = True
    unseen[4:20, 10:30, 10:30] = True
    assert open_places(unseen, blocked, 0.012)[unseen].mean() > 0.95
    # A box with the same top, and sides that were seen too.
    for side in (
        np.s_[:22, 5, 5:35],
        np.s_[:22, 34, 5:35],
        np.s_[:22, 5:35, 5],
        np.s_[:22, 5:35, 34],
    ):
        blocked[side] = True
    unseen[:20, 6:34, 6:34] = True
    assert not open_places(unseen, blocked, 0.012).any()


def test_fine_voxels_open_the_same_places():
    blocked = np.zeros((60, 60, 60), np.bool_)
    unseen = np.zeros_like(blocked)
    blocked[40:44, 8:52, 8:52] = True
    unseen[6:40, 14:46, 14:46] = True
    found = open_places(unseen, blocked, 0.004)
    assert found.shape == unseen.shape
    assert not found[blocked].any()
    assert found[unseen].mean() > 0.9


def test_bars_are_thin_and_blocks_are_not():
    solid = np.zeros((60, 60, 60), np.bool_)
    solid[:30, 10:13, 10:13] = True
    solid[:30, 30:50, 30:50] = True
    thin = thin_parts(solid, 0.01, 0.025)
    assert thin[:30, 10:13, 10:13].all()
    assert thin[4:26, 34:46, 34:46].mean() == 0
    assert not thin[~solid].any()


def test_a_bar_that_some_pictures_miss_stays_and_a_thick_thing_is_not_fattened():
    box, poses = _box(), ring([0.0, 0.0, 0.3], elevations=(-0.4, 0.2, 0.8))
    sizes = []
    for missed in (0, 5):
        hull = VisualHull(box, len(poses))
        for index, T in enumerate(poses):
            mask = _ball_mask(T, 0.015)
            if index < missed:
                mask[:] = 0
            hull.add(mask, np.zeros(mask.shape, np.float32), _matrix(), inverse(T))
        sizes.append((hull.outside() < 0).sum())
    assert sizes[0] > 0
    assert 0.3 * sizes[0] < sizes[1] <= 1.5 * sizes[0]


def test_what_is_as_thin_as_a_bar_is_not_made_thicker():
    box = Box.of(np.array([-0.05, -0.05, 0.25]), np.array([0.05, 0.05, 0.35]), 0.003)
    poses = ring([0.0, 0.0, 0.3], elevations=(-0.4, 0.2, 0.8))
    hull = VisualHull(box, len(poses))
    for T in poses:
        mask = _ball_mask(T, 0.018)
        hull.add(mask, np.zeros(mask.shape, np.float32), _matrix(), inverse(T))
    share = (hull.outside() < 0).sum() * 0.003**3 / (4 / 3 * np.pi * 0.018**3)
    assert 0.8 < share < 1.35
