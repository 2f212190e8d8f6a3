"""The third-person view and the phone's view, with the shipped body."""

import numpy as np
import pytest
import torch
import trimesh

from omomo_core.body.kinematics import forward_kinematics
from omomo_core.body.model import BodyModel, load_body
from omomo_core.errors import InputError
from omomo_core.motion import HumanMotion, ObjectMesh, ObjectMotion
from render import phone_view, third_person
from render.backends import open_renderer
from render.cameras import look_at
from render.scene import Scene

FRAMES = 40
CUBE = np.array(trimesh.creation.box((2.0, 2.0, 2.0)).vertices)
CUBE_FACES = np.array(trimesh.creation.box().faces)


@pytest.fixture(scope="module")
def body() -> BodyModel:
    return load_body()


@pytest.fixture(scope="module")
def human(body: BodyModel) -> HumanMotion:
    """A T-pose facing -y that glides along -y."""
    upright = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    rotations = np.tile(upright, (FRAMES, 22, 1, 1))
    root = np.zeros((FRAMES, 3))
    root[:, 1] = -0.03 * np.arange(FRAMES)
    root[:, 2] = float(body.rest_joints[0, 1] - body.vertices[:, 1].min())
    joints = forward_kinematics(body, torch.as_tensor(root), torch.as_tensor(rotations)).numpy()
    fingers = np.tile(body.relaxed_fingers.numpy(), (FRAMES, 1, 1, 1))
    contact = np.tile([0.0, 1.0], (FRAMES, 1))
    return HumanMotion(root, rotations, fingers, joints, contact, np.ones((FRAMES, 4)))


@pytest.fixture(scope="module")
def carried(human: HumanMotion) -> ObjectMotion:
    T = np.tile(np.eye(4), (FRAMES, 1, 1))
    T[:, :3, 3] = human.root + np.array([0.0, -0.5, 0.2])
    mesh = ObjectMesh(CUBE * [0.2, 0.15, 0.1], CUBE_FACES, "box")
    return ObjectMotion(mesh, T, np.ones(FRAMES, bool))


@pytest.mark.parametrize("backend", ["pyrender", "raycast"])
def test_third_person_shows_person_and_object(
    body: BodyModel, human: HumanMotion, carried: ObjectMotion, backend: str
) -> None:
    movie = third_person.frames(
        human, carried, body, width=320, height=180, backend=backend, markers=False
    )
    first = next(movie)
    movie.close()
    assert first.shape == (180, 320, 3)
    red, blue = first[..., 0].astype(int), first[..., 2].astype(int)
    person, thing = blue - red > 30, red - blue > 50
    assert person.mean() > 0.01
    assert thing.mean() > 0.005
    for seen in (person, thing):  # nothing is cut off at the rim
        assert not seen[[0, -1]].any()
        assert not seen[:, [0, -1]].any()


def test_skin_is_the_same_in_and_across_chunks(body: BodyModel, human: HumanMotion) -> None:
    vertices = third_person.skinned_body(human, body).vertices
    assert vertices is not None
    for frame in (0, 31, 32, 39, 5):
        moved = vertices(frame) - vertices(0)
        assert np.allclose(moved, human.root[frame] - human.root[0], atol=1e-4)
    assert vertices(0)[:, 2].min() == pytest.approx(0.0, abs=1e-4)


def test_all_frames_come(body: BodyModel, human: HumanMotion, carried: ObjectMotion) -> None:
    movie = third_person.frames(human, carried, body, width=96, height=54, samples=0)
    assert sum(1 for _ in movie) == FRAMES


def test_one_frame_alone_looks_as_it_does_in_the_video(
    body: BodyModel, human: HumanMotion, carried: ObjectMotion
) -> None:
    whole = list(third_person.frames(human, carried, body, width=160, height=96))
    (alone,) = third_person.frames(human, carried, body, width=160, height=96, only=[3])
    assert np.abs(whole[3].astype(int) - alone.astype(int)).mean() < 1.0


def test_motions_of_different_length_are_refused(
    body: BodyModel, human: HumanMotion, carried: ObjectMotion
) -> None:
    short = ObjectMotion(carried.mesh, carried.T_world_object[:9], carried.valid[:9])
    with pytest.raises(InputError, match="40 frames, the object 9"):
        next(third_person.frames(human, short, body))


def test_the_phone_sees_detail_wherever_it_looks_and_the_person(
    body: BodyModel, human: HumanMotion
) -> None:
    eye = np.array([0.0, -2.0, 1.3])
    ways = ([0.0, 1, 0], [1, 0, 0], [-1, 0, 0], [0, -1, 0], [0.0, 0.3, -1], [0, 0.3, 1])
    T = np.stack([look_at(eye, eye + np.array(way, float)) for way in ways])
    intrinsics = {"fx": 130.0, "fy": 130.0, "cx": 79.5, "cy": 59.5, "width": 160, "height": 120}
    empty = list(phone_view.frames(T, **intrinsics, seed=1))
    assert len(empty) == len(ways)
    for picture in empty:
        assert picture.astype(float).std(axis=(0, 1)).min() > 12.0
    actors = [third_person.skinned_body(human, body)]
    peopled = next(phone_view.frames(T[:1], **intrinsics, seed=1, actors=actors))
    assert (np.abs(peopled.astype(int) - empty[0]).max(axis=-1) > 20).mean() > 0.05
    again = next(phone_view.frames(T[:1], **intrinsics, seed=1))
    assert (again == empty[0]).all()
    assert (next(phone_view.frames(T[:1], **intrinsics, seed=2)) != empty[0]).any()


def test_both_backends_agree_on_a_body(body: BodyModel, human: HumanMotion) -> None:
    camera = third_person.follow_motion(
        human,
        ObjectMotion(
            ObjectMesh(CUBE, CUBE_FACES, "box"),
            np.tile(np.eye(4), (FRAMES, 1, 1)),
            np.ones(FRAMES, bool),
        ),
        320,
        240,
    )[10]
    depths = []
    for backend in ("pyrender", "raycast"):
        with open_renderer(320, 240, backend) as renderer:
            actor = third_person.skinned_body(human, body)
            renderer.show(Scene([actor.drawable]))
            actor.pose(renderer, 10)
            depths.append(renderer.draw(camera)[1])
    a, b = depths
    assert ((a > 0) == (b > 0)).mean() > 0.98
    assert np.median(np.abs(a - b)[(a > 0) & (b > 0)]) < 0.01
