"""Some samples stand on the other side of the object, where it has a surface there."""

import numpy as np
import torch
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from omomo_core.generation.object_clip import ObjectClip, ObjectModel
from omomo_core.generation.selection.plausibility import add_opposite_side, move_to_lighter_side
from omomo_core.generation.selection.selection_config import OPPOSITE_SIDE
from omomo_core.motion import ObjectMesh

FRAMES, LONG = 12, 40


def _scene(solid: trimesh.Trimesh, scale: float) -> ObjectClip:
    T = np.tile(np.eye(4), (FRAMES, 1, 1))
    T[:, 0, 3] = np.linspace(0, 2, FRAMES)
    T[:, 2, 3] = 0.6
    mesh = ObjectMesh(np.array(solid.vertices), np.array(solid.faces), "thing")
    return ObjectModel(mesh, scale).clip(T)


def _beside(clip: ObjectClip, samples: int, noise: float) -> torch.Tensor:
    """Both hands on the face towards +x of what is 0.4 m long, held throughout."""
    centre = torch.tensor([0.2, 0.1, 0.0, 0.2, -0.1, 0.0]) * clip.scale
    palms = centre + noise * torch.randn(samples, FRAMES, 6)
    return torch.cat([palms, torch.ones(samples, FRAMES, 2)], dim=-1)


@given(samples=st.integers(1, 23), scale=st.floats(0.8, 1.2), seed=st.integers(0, 99))
@settings(max_examples=25)
def test_one_in_five_changes_sides_around_a_box(samples: int, scale: float, seed: int):
    torch.manual_seed(seed)
    clip = _scene(trimesh.creation.box((0.4, 0.3, 0.3)), scale)
    before = _beside(clip, samples, 0.01)
    after = add_opposite_side(before, clip)
    some = samples // OPPOSITE_SIDE.one_in
    assert after.shape == before.shape
    torch.testing.assert_close(after[: samples - some], before[: samples - some])
    for new, old in zip(after[samples - some :], before[:some], strict=True):
        old, new = old[:, :6].unflatten(-1, (2, 3)), new[:, :6].unflatten(-1, (2, 3))
        torch.testing.assert_close(new[..., :2], -old[..., :2])
        torch.testing.assert_close(new[..., 2], old[..., 2])
        # The left hand is the left one of who faces the box, before and after.
        sides = [torch.linalg.cross(x[:, 0], x[:, 1])[:, 2].sign() for x in (old, new)]
        torch.testing.assert_close(sides[0], sides[1])


def test_nobody_holds_the_air_on_the_other_side():
    """An upright board at one end of a rod on the floor: all is low on the other side."""
    board = trimesh.creation.box((0.04, 0.4, 0.8))
    rod = trimesh.creation.box((1.5, 0.02, 0.02))
    rod.apply_translation([-0.75, 0, -0.39])
    clip = _scene(trimesh.util.concatenate([board, rod]), 1.0)
    origin = torch.from_numpy(clip.trained.motion.T_world_object[:, :3, 3]).float()
    top = origin[:, None] + torch.tensor([[0.0, 0.1, 0.4], [0.0, -0.1, 0.4]])
    palms = top - torch.from_numpy(clip.trained.centre).float()[:, None]
    held = torch.cat([palms.flatten(-2), torch.ones(FRAMES, 2)], dim=-1).expand(10, -1, -1)
    torch.testing.assert_close(add_opposite_side(held, clip), held)
    free = torch.cat([held[..., :6], -held[..., 6:]], dim=-1)
    assert not torch.equal(add_opposite_side(free, clip), free)


def _raised(tilt: float) -> ObjectClip:
    """A low table top, its edge towards +x off the floor and the other on it."""
    solid = trimesh.creation.box((1.2, 0.8, 0.3))
    c, s = np.cos(tilt), np.sin(tilt)
    T = np.tile(np.eye(4), (LONG, 1, 1))
    T[:, :3, :3] = np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]])
    T[:, 2, 3] = -(np.asarray(solid.vertices) @ T[0, 2, :3]).min()
    return ObjectModel(
        ObjectMesh(np.array(solid.vertices), np.array(solid.faces), "top"), 1.0
    ).clip(T)


def _at(x: float, samples: int) -> torch.Tensor:
    palms = torch.tensor([x, 0.2, 0.0, x, -0.2, 0.0]).expand(samples, LONG, 6)
    return torch.cat([palms, torch.ones(samples, LONG, 2)], dim=-1)


def test_who_lifts_an_edge_from_the_edge_it_stands_on_changes_sides():
    clip = _raised(0.3)
    both = torch.cat([_at(-0.6, 4), _at(0.6, 4)])
    torch.testing.assert_close(
        move_to_lighter_side(both, clip)[..., [0, 3]], torch.full((8, LONG, 2), 0.6)
    )
    # And nobody is sent to where it is heavy.
    torch.testing.assert_close(add_opposite_side(_at(0.6, 10), clip), _at(0.6, 10))


def test_what_lies_flat_is_held_from_any_side():
    clip, both = _raised(0.0), torch.cat([_at(-0.6, 2), _at(0.6, 2)])
    torch.testing.assert_close(move_to_lighter_side(both, clip), both)


def test_where_both_sides_bear_as_much_nobody_changes():
    """From the ends of the edge that stays on the floor's other side: half a turn weighs the same."""
    clip = _raised(0.3)
    palms = torch.tensor([0.0, 0.4, 0.0, 0.0, 0.4, 0.0]).expand(4, LONG, 6)
    held = torch.cat([palms, torch.ones(4, LONG, 2)], dim=-1)
    torch.testing.assert_close(move_to_lighter_side(held, clip), held)
