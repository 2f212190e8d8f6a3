"""The views: what each keeps in its picture, and what is drawn for them."""

import numpy as np
import pytest
import torch
import trimesh
from scipy.spatial.transform import Rotation

from omomo_core.body.kinematics import forward_kinematics
from omomo_core.body.model import load_body
from omomo_core.contact.segment import ContactSegment
from omomo_core.errors import InputError
from omomo_core.motion import HumanMotion, ObjectMesh, ObjectMotion
from render import third_person
from render.cameras import look_at, pinhole, quarter_turns
from render.overlay import composite, wiped
from render.props import Actor, poses_at, retimed, rigid_object
from render.scene import Drawable
from render.third_person import facing, held_places, object_corners, subject
from render.views import Eye, View, share_shown, shot

FRAMES, W, H = 240, 320, 180


@pytest.fixture(scope="module")
def human() -> HumanMotion:
    """A T-pose that walks a quarter circle, facing where it goes."""
    body = load_body()
    turn = np.linspace(0.0, np.pi / 2, FRAMES)
    heading = Rotation.from_euler("z", turn[:, None]).as_matrix()
    facing_x = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
    rotations = np.repeat((heading @ facing_x)[:, None], 22, axis=1)
    root = np.stack([2 * np.sin(turn), 2 - 2 * np.cos(turn), np.full(FRAMES, 0.95)], axis=1)
    joints = forward_kinematics(body, torch.as_tensor(root), torch.as_tensor(rotations)).numpy()
    fingers = np.tile(body.relaxed_fingers.numpy(), (FRAMES, 1, 1, 1))
    return HumanMotion(root, rotations, fingers, joints, np.ones((FRAMES, 2)), np.ones((FRAMES, 4)))


@pytest.fixture(scope="module")
def moved(human: HumanMotion) -> ObjectMotion:
    """A box carried half a metre before the person."""
    box = trimesh.creation.box((0.3, 0.4, 0.2))
    T = np.tile(np.eye(4), (FRAMES, 1, 1))
    T[:, :3, :3] = human.rotations[:, 0] @ human.rotations[0, 0].T
    T[:, :3, 3] = human.root + 0.5 * human.rotations[:, 0, :, 2] + [0, 0, 0.1]
    mesh = ObjectMesh(np.array(box.vertices), np.array(box.faces), "box")
    return ObjectMotion(mesh, T, np.ones(FRAMES, bool))


def test_the_holding_hand_is_in_every_picture_of_the_hands(
    human: HumanMotion, moved: ObjectMotion
) -> None:
    cameras = shot("hands", human, moved, W, H).cameras
    for frame in range(0, FRAMES, 12):
        seen = cameras[frame].project(human.joints[frame, 22:])
        u, v, depth = seen.T
        assert ((u > 0) & (u < W) & (v > 0) & (v < H) & (depth > 0.2)).any()


def test_hands_behind_a_board_are_seen_from_its_other_side(human: HumanMotion) -> None:
    """The board lies above both hands, where the camera would stand otherwise."""
    board = trimesh.creation.box((0.6, 1.8, 0.01))
    T = np.tile(np.eye(4), (FRAMES, 1, 1))
    T[:, :3, :3] = human.rotations[:, 0] @ human.rotations[0, 0].T
    T[:, :3, 3] = human.joints[:, 22:].mean(axis=1) + np.array([0, 0, 0.05])
    mesh = ObjectMesh(np.array(board.vertices), np.array(board.faces), "board")
    moved = ObjectMotion(mesh, T, np.ones(FRAMES, bool))
    cameras = shot("hands", human, moved, W, H).cameras
    assert all(c.T_world_camera[2, 3] < pose[2, 3] for c, pose in zip(cameras, T, strict=True))


@pytest.mark.parametrize("view", ["third", "orbit", "follow", "top"])
def test_person_and_object_are_whole_in_every_picture(
    human: HumanMotion, moved: ObjectMotion, view: View
) -> None:
    cameras = shot(view, human, moved, W, H).cameras
    assert len(cameras) == FRAMES
    points = subject(human, moved)
    for frame in range(0, FRAMES, 12):
        u, v, depth = cameras[frame].project(points[frame]).T
        assert depth.min() > 0.3
        assert (u.min(), v.min()) > (0, 0)
        assert u.max() < W
        assert v.max() < H


def test_the_orbit_circles_steadily(human: HumanMotion, moved: ObjectMotion) -> None:
    cameras = shot("orbit", human, moved, W, H).cameras
    back = np.stack([c.T_world_camera[:2, 2] for c in cameras])
    turned = np.diff(np.unwrap(np.arctan2(back[:, 1], back[:, 0])))
    assert turned.sum() == pytest.approx(np.pi, rel=0.01)  # 8 of 16 seconds
    assert np.ptp(turned) < 1e-6


def test_the_follower_stays_behind(human: HumanMotion, moved: ObjectMotion) -> None:
    cameras = shot("follow", human, moved, W, H).cameras
    way = facing(human)
    for frame in range(0, FRAMES, 20):
        toward = cameras[frame].T_world_camera[:2, 3] - human.root[frame, :2]
        cosine = toward @ way[frame] / np.linalg.norm(toward) / np.linalg.norm(way[frame])
        assert cosine < -0.6


def test_the_map_has_north_up_and_a_true_scale(human: HumanMotion, moved: ObjectMotion) -> None:
    seen = shot("top", human, moved, W, H)
    assert seen.pixels_per_metre is not None
    assert [track.drawable.name for track in seen.tracks] == ["walked"]
    origin, east, north = seen.cameras[0].project(np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]))
    scale = seen.pixels_per_metre
    np.testing.assert_allclose(east[:2] - origin[:2], [scale, 0], atol=1e-6)
    np.testing.assert_allclose(north[:2] - origin[:2], [0, -scale], atol=1e-6)


def test_an_eye_on_the_object_sees_what_a_phone_there_sees(
    human: HumanMotion, moved: ObjectMotion
) -> None:
    """It looks back at the person; the phone stands on its head, the picture does not."""
    T_object_camera = look_at(np.array([0.3, 0, 0.2]), np.array([-0.5, 0, 0.2]))
    T_object_camera[:3, :2] *= -1
    cameras = shot("object", human, moved, W, H, Eye(T_object_camera)).cameras
    assert quarter_turns(moved.T_world_object @ T_object_camera) == 2
    for frame in (0, 100, 239):
        place = moved.T_world_object[frame] @ T_object_camera
        np.testing.assert_allclose(cameras[frame].T_world_camera[:3, 3], place[:3, 3], atol=1e-9)
        assert cameras[frame].T_world_camera[2, 1] > 0.9  # its up is up
    assert share_shown(human.joints, cameras, W, H) == 1.0
    corner = np.array([[0.0, 0], [W - 1, H - 1]])
    rays = (corner - [cameras[0].cx, cameras[0].cy]) / cameras[0].fx
    ends = np.concatenate([rays, np.ones((2, 1))], axis=1)
    cosine = ends[0] @ ends[1] / np.linalg.norm(ends[0]) / np.linalg.norm(ends[1])
    assert np.degrees(np.arccos(cosine)) == pytest.approx(78, abs=0.5)


def test_an_eye_that_looks_away_gives_way_to_one_that_sees_the_person(
    human: HumanMotion, moved: ObjectMotion
) -> None:
    away = Eye(look_at(np.array([0.3, 0, 0]), np.array([1.0, 0, 0])))
    for eye in (None, away):
        cameras = shot("object", human, moved, W, H, eye).cameras
        assert share_shown(human.joints, cameras, W, H) == 1.0
        assert share_shown(object_corners(moved), cameras, W, H) == 1.0
        in_object = np.linalg.inv(moved.T_world_object) @ np.stack(
            [camera.T_world_camera for camera in cameras]
        )
        assert np.ptp(in_object, axis=0).max() < 1e-9  # it rides on the object


@pytest.mark.parametrize("turn", [0, 90, 180, 270, 20, -60])
def test_pictures_are_turned_upright(turn: float) -> None:
    T = look_at(np.array([2.0, 0, 1]), np.array([0.0, 0, 0.8]))
    T[:3, :3] = T[:3, :3] @ Rotation.from_euler("z", turn, degrees=True).as_matrix()
    foot, top = pinhole(T, 0.8, 101, 101).project(np.array([[0.0, 0, 0.8], [0, 0, 1.1]]))
    picture = np.zeros((101, 101))
    u, v = top[:2].round().astype(int)
    picture[v, u] = 1.0
    (v, u), *_ = np.argwhere(np.rot90(picture, quarter_turns(T[None])))
    assert 50 - v > abs(u - 50)
    assert np.abs(foot[:2] - 50).max() < 1


def test_where_hands_hold_is_marked_on_the_surface_while_they_do(moved: ObjectMotion) -> None:
    left = [
        ContactSegment(0, 10, 60, np.array([0.0, 0.22, 0.0])),
        ContactSegment(0, 90, 120, np.array([0, 0, 0.12])),
    ]
    (patch,) = held_places(left, moved)
    assert patch.T_world is not None
    assert patch.visible is not None
    assert np.flatnonzero(patch.visible).tolist() == [*range(10, 60), *range(90, 120)]
    for frame, middle, normal in ((30, [0, 0.2, 0], [0, 1, 0]), (100, [0, 0, 0.1], [0, 0, 1])):
        T = np.linalg.inv(moved.T_world_object[frame]) @ patch.T_world[frame]
        np.testing.assert_allclose(T[:3, 3], middle, atol=0.015)
        np.testing.assert_allclose(T[:3, 2], normal, atol=1e-6)
    assert held_places([], moved) == []


def test_patches_and_scale_bar_are_drawn(human: HumanMotion, moved: ObjectMotion) -> None:
    body = load_body()
    seen = shot("top", human, moved, W, H)
    marks = held_places([ContactSegment(1, 0, FRAMES, np.array([0.0, 0, 0.12]))], moved)
    how = {"width": W, "height": H, "cameras": seen.cameras, "markers": False, "only": [0]}
    (plain,) = third_person.frames(human, moved, body, **how)
    (marked,) = third_person.frames(
        human, moved, body, **how, extra=marks, pixels_per_metre=seen.pixels_per_metre
    )
    changed = np.abs(plain.astype(int) - marked).max(axis=-1) > 30
    assert changed[H // 2 :, W // 2 :].any()  # the bar in the corner
    u, v, _ = seen.cameras[0].project(moved.T_world_object[0, :3, 3]).round().astype(int)
    green = marked[v, u].astype(int)
    assert green[1] > green[0] + 30


def test_an_object_without_faces_is_refused(moved: ObjectMotion) -> None:
    bare = ObjectMesh(moved.mesh.vertices, np.empty((0, 3), int), "cloud")
    with pytest.raises(InputError, match="no faces"):
        rigid_object(ObjectMotion(bare, moved.T_world_object, moved.valid))


def test_an_actor_between_its_frames() -> None:
    T = np.tile(np.eye(4), (3, 1, 1))
    T[:, 0, 3] = [0.0, 1, 4]
    T[2, :3, :3] = Rotation.from_euler("z", 90, degrees=True).as_matrix()
    flat = Drawable("flat", np.zeros((3, 3)), np.array([[0, 1, 2]]))
    actor = Actor(
        flat,
        vertices=lambda k: np.full((3, 3), float(k)),
        T_world=T,
        visible=np.array([1, 1, 0], bool),
    )
    at = np.array([-1.0, 0.25, 1.5, 2.0 + 1e-12, 9.0])
    other = retimed(actor, at, 3)
    assert other.vertices is not None
    assert [other.vertices(k)[0, 0] for k in range(5)] == [0.0, 0.25, 1.5, 2.0, 2.0]
    assert other.T_world is not None
    assert other.T_world[:, 0, 3].tolist() == [0.0, 0.25, 2.5, 4.0, 4.0]
    half = Rotation.from_matrix(other.T_world[2, :3, :3]).as_euler("xyz", degrees=True)
    np.testing.assert_allclose(half, [0, 0, 45], atol=1e-9)
    assert other.visible is not None
    assert other.visible.tolist() == [True, True, False, False, False]
    assert (poses_at(T[:1], at) == T[0]).all()


def test_a_layer_over_a_picture_keeps_what_it_does_not_cover() -> None:
    rng = np.random.default_rng(0)
    picture = rng.integers(0, 256, (20, 30, 3), np.uint8)
    layer = np.zeros((20, 30, 4), np.uint8)
    layer[5:9, 4:20] = [200, 100, 0, 255]
    layer[12:14, 4:20] = [0, 0, 0, 51]  # a fifth of a shadow
    over = composite(picture, layer)
    assert (over[5:9, 4:20] == [200, 100, 0]).all()
    shadow = picture[12:14, 4:20] * 0.8
    assert np.abs(over[12:14, 4:20] - shadow).max() <= 0.5
    free = layer[..., 3] == 0
    assert (over[free] == picture[free]).all()
    half = composite(picture, layer, 0.5)
    middle = (picture[5:9, 4:20].astype(float) + np.array([200, 100, 0])) / 2
    assert np.abs(half[5:9, 4:20] - middle).max() <= 0.5
    assert (composite(picture, layer, 0.0) == picture).all()
    assert (wiped(picture, over, 0.0)[:, :3] == picture[:, :3]).all()
    assert (wiped(picture, over, 0.0)[:, 4:] == over[:, 4:]).all()
