"""The picture of a mount: the phone is seen where the mount puts it."""

import numpy as np
import trimesh

from omomo_core.motion import ObjectMesh
from render.mount_view import mount_picture

BODY = (0.0715, 0.1467, 0.0077)
CUBE = trimesh.creation.box((0.4, 0.4, 0.4))
T_PHONE_BODY = np.array([[0, -1, 0, 0.05], [1, 0, 0, -0.02], [0, 0, 1, 0.007], [0, 0, 0, 1.0]])


def _drawn(away: float, label: str = "") -> np.ndarray:
    """A phone `away` metres along the object's x, looking out."""
    T_object_phone = np.eye(4)
    T_object_phone[:3, :3] = [[0, 0, -1], [1, 0, 0], [0, -1, 0]]
    T_object_phone[:3, 3] = [away, 0, 0]
    mesh = ObjectMesh(np.asarray(CUBE.vertices), np.asarray(CUBE.faces), "cube")
    T = np.linalg.inv(T_object_phone)
    return mount_picture(mesh, T, T_PHONE_BODY, BODY, label=label, side=160, backend="raycast")


def _dark(picture: np.ndarray) -> int:
    return int((picture.max(axis=-1) < 80).sum())


def test_a_phone_on_the_object_is_seen_and_one_within_is_not() -> None:
    outside, within = _drawn(0.22), _drawn(0.05)
    assert outside.shape == (160, 3 * 160 + 8, 3)
    assert _dark(outside) > 150
    assert _dark(within) < 20


def test_the_label_is_on_the_first_view_only() -> None:
    plain, named = _drawn(0.22), _drawn(0.22, "board: 3 mm")
    changed = (plain != named).any(axis=(0, 2))
    assert changed[:160].any()
    assert not changed[164:].any()
