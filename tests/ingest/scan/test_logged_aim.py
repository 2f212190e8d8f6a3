"""Poses that look at no one place are told of before pictures are matched."""

from pathlib import Path

import numpy as np
import pytest

from ingest.scan.region import check_logged_aim
from ingest.scan.scan_types import Frame
from omomo_core.errors import InputError
from tests.ingest.scan.orbiting import SIZE, ring

FLIP = np.diag([1.0, -1.0, -1.0, 1.0])


def _frames(poses):
    return [Frame(f"{k}.jpg", Path(f"{k}.jpg"), SIZE, None, T) for k, T in enumerate(poses)]


def _walk():
    """Straight on through a room, looking ahead."""
    poses = np.tile(np.eye(4), (20, 1, 1))
    poses[:, 2, 3] = np.linspace(0, 4, 20)
    return poses


def test_a_round_has_an_aim_whatever_its_axes_are():
    check_logged_aim(_frames(ring([0.0, 0.0, 0.4])))
    check_logged_aim(_frames(ring([0.0, 0.0, 0.4]) @ FLIP))


def test_a_walk_through_a_room_has_none():
    with pytest.raises(InputError) as refused:
        check_logged_aim(_frames(_walk()))
    assert refused.value.code in ("scan-no-aim", "scan-no-orbit")


def test_poses_that_are_lost_tell_nothing():
    poses = list(_walk())
    check_logged_aim(_frames([None] * 10 + poses[:10]))
    check_logged_aim([])
