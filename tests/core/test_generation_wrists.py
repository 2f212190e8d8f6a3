"""Wrists turn so that palms face what they hold."""

import numpy as np
import torch
import trimesh
from scipy.spatial.transform import Rotation

from omomo_core.contact.segment import ContactSegment
from omomo_core.generation.decoding import face_palms
from omomo_core.generation.solving.solving_config import WRIST
from omomo_core.geometry.surface import sample_surface
from omomo_core.motion import ObjectMesh


def test_a_palm_looks_at_the_face_that_it_holds_and_a_free_one_stays():
    box = trimesh.creation.box((0.4, 0.3, 0.2))
    surface = sample_surface(ObjectMesh(np.array(box.vertices), np.array(box.faces), "box"))
    T = np.tile(np.eye(4), (10, 1, 1))
    T[:, :3, :3] = Rotation.from_euler(
        "z", np.linspace(0, 90, 10)[:, None], degrees=True
    ).as_matrix()
    wrists = torch.from_numpy(
        np.tile(Rotation.from_euler("xyz", [40, -70, 20], degrees=True).as_matrix(), (10, 2, 1, 1))
    )
    held = ContactSegment(hand=0, start=2, stop=8, anchor=np.array([0.22, 0.05, 0.0]))
    turned = face_palms(wrists, [held], surface, T)
    # The palm looks along -y of the wrist; the face looks along x of the object.
    into = -torch.from_numpy(T[2:8, :3, 0])

    def off(R: torch.Tensor) -> torch.Tensor:
        return torch.acos((-R[2:8, 0, :, 1] * into).sum(dim=-1).clamp(-1, 1))

    wanted = torch.maximum(off(wrists) - WRIST.farthest, torch.tensor(WRIST.tolerance))
    # The surface is known at points that are a centimetre or two apart.
    torch.testing.assert_close(off(turned), torch.minimum(wanted, off(wrists)), atol=0.2, rtol=0)
    torch.testing.assert_close(turned[:, 1], wrists[:, 1])
    torch.testing.assert_close(turned[:2, 0], wrists[:2, 0])
