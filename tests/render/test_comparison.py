"""Comparisons: one camera and clock for all, strips and heat where the truth says."""

from dataclasses import replace

import numpy as np
import pytest
import torch
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as some

from omomo_core.body.kinematics import forward_kinematics
from omomo_core.body.model import BodyModel, load_body
from omomo_core.errors import InputError
from omomo_core.motion import HumanMotion, ObjectMesh, ObjectMotion
from render.comparison import (
    Contender,
    Number,
    clock,
    difference_scale,
    heat_color,
    heat_scale,
    shared_camera,
    views,
)
from render.comparison_plate import PlateStyle, comparison_frames, comparison_sheet
from render.lettering import HOLDS, TRUE, Held, contact_strip, fitted, text_width, write
from render.third_person import subject

FRAMES = 24
SMALL = {"width": 128, "height": 96, "markers": False, "time_code": False}
UPRIGHT = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])


@pytest.fixture(scope="module")
def body() -> BodyModel:
    return load_body()


@pytest.fixture(scope="module")
def one(body: BodyModel) -> Contender:
    """A T-pose that glides along -y behind a box."""
    rotations = np.tile(UPRIGHT, (FRAMES, 22, 1, 1))
    root = np.zeros((FRAMES, 3))
    root[:, 1] = -0.02 * np.arange(FRAMES)
    root[:, 2] = float(body.rest_joints[0, 1] - body.vertices[:, 1].min())
    joints = forward_kinematics(body, torch.as_tensor(root), torch.as_tensor(rotations)).numpy()
    fingers = np.tile(body.relaxed_fingers.numpy(), (FRAMES, 1, 1, 1))
    contact = np.zeros((FRAMES, 2), bool)
    contact[6:18, 0] = True
    human = HumanMotion(root, rotations, fingers, joints, contact * 1.0, np.ones((FRAMES, 4)))
    T = np.tile(np.eye(4), (FRAMES, 1, 1))
    T[:, :3, 3] = root + np.array([0.0, -0.6, 0.0])
    box = trimesh.creation.box((0.3, 0.2, 0.2))
    mesh = ObjectMesh(np.array(box.vertices), np.array(box.faces), "box")
    moved = ObjectMotion(mesh, T, np.ones(FRAMES, bool))
    return Contender("one", human, moved, body, contact)


def shifted(c: Contender, way: tuple[float, float, float], label: str = "other") -> Contender:
    human = replace(c.human, root=c.human.root + way, joints=c.human.joints + way)
    return replace(c, human=human, label=label)


def test_the_same_motion_gives_the_same_picture_and_another_does_not(one: Contender) -> None:
    far = shifted(one, (0.4, 0.0, 0.0))
    ((a, b, c),) = views([one, one, far], [5], **SMALL)
    assert (a == b).all()
    assert (np.abs(a.astype(int) - c).max(axis=-1) > 40).mean() > 0.01


def test_the_camera_keeps_everybody_and_their_objects_in_view(one: Contender) -> None:
    others = [one, shifted(one, (1.5, 0.5, 0.0)), replace(one, begin=7)]
    cameras = shared_camera(others, 160, 90)
    assert len(cameras) == clock(others) == FRAMES + 7
    for tick, camera in enumerate(cameras):
        for c in others:
            u, v, depth = camera.project(subject(c.human, c.object_motion)[c.frame(tick)]).T
            assert depth.min() > 0
            for pixels, size in ((u, 160), (v, 90)):
                assert pixels.min() >= -0.5
                assert pixels.max() <= size - 0.5


def test_who_has_ended_stands_still_and_pale(one: Contender) -> None:
    late = replace(one, begin=10)
    (before, last) = views([one, late], [FRAMES - 1, FRAMES + 9], **SMALL)
    assert [one.lasts(t) for t in (FRAMES - 1, FRAMES)] == [True, False]
    assert [late.lasts(t) for t in (9, 10)] == [False, True]
    assert (one.frame(0), one.frame(FRAMES + 9), late.frame(3)) == (0, FRAMES - 1, 0)
    contrast = [picture[0].astype(float).std() for picture in (before, last)]
    assert contrast[1] < 0.6 * contrast[0]


def test_heat_is_pale_where_nothing_differs_and_dark_where_all_does(one: Contender) -> None:
    scale = 0.5
    far = shifted(one, (0.0, 0.0, 0.5))
    ((_, same, other),) = views([one, one, far], [3], heat=scale, **SMALL)
    ((_, plain, _),) = views([one, one, far], [3], **SMALL)
    body = (plain[..., 2].astype(int) - plain[..., 0]) > 25
    box = (plain[..., 0].astype(int) - plain[..., 2]) > 60
    assert body.sum() > 60
    assert box.sum() > 20
    spread = np.ptp(same[body].astype(int), axis=1)
    assert np.median(spread) < 12  # grey: no hue
    assert (same[box] == plain[box]).all()  # only bodies are tinted
    wine = (other[..., 0].astype(int) - other[..., 1] > 30) & (other.max(axis=-1) < 130)
    assert wine.sum() > 60


def test_heat_says_how_far_each_part_is(one: Contender) -> None:
    """A person whose one arm hangs down differs there, and is the same in the legs."""
    turned = one.human.rotations.copy()
    down = np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    turned[:, [16, 18, 20]] = UPRIGHT @ down
    other = replace(one, human=replace(one.human, rotations=turned))
    ((_, seen),) = views([one, other], [0], heat=0.4, **SMALL)
    hot = seen[..., 0].astype(int) - seen[..., 2] > 60
    box = np.zeros_like(hot)
    ((_, bare),) = views([one, other], [0], **SMALL)
    box |= bare[..., 0].astype(int) - bare[..., 2] > 60
    rows = np.nonzero(hot & ~box)[0]
    body_rows = np.nonzero(bare[..., 2].astype(int) - bare[..., 0] > 25)[0]
    assert len(rows) > 8
    # Nothing below the knees is hot.
    assert rows.max() < body_rows.min() + 0.75 * np.ptp(body_rows)


def test_heat_wants_one_mesh(one: Contender) -> None:
    other = replace(one, body=replace(one.body, faces=one.body.faces[:-1]), label="stranger")
    with pytest.raises(InputError, match="same body mesh") as caught:
        difference_scale([one, other])
    assert (caught.value.code, caught.value.where) == ("heat-bodies-differ", "stranger")
    assert difference_scale([one, shifted(one, (0.25, 0, 0))]) == 0.3


def test_the_heat_scale_is_read_without_colours() -> None:
    light = heat_color(np.linspace(0, 1, 50)) @ [0.2126, 0.7152, 0.0722]
    assert (np.diff(light) < 0).all()


@given(some.floats(0, 3), some.integers(1, 40))
def test_heat_scales_are_rarely_exceeded(far: float, count: int) -> None:
    end = heat_scale([np.full((count, 24), far)])
    assert end >= min(far, 2.0)
    assert end in (0.02, 0.05, 0.10, 0.15, 0.20, 0.30, 0.40, 0.60, 0.80, 1.0, 1.5, 2.0)


@settings(max_examples=15)
@given(
    start=some.integers(0, 20),
    length=some.integers(5, 20),
    begin=some.integers(0, 30),
    width=some.integers(200, 600),
)
def test_a_strip_shows_when_each_hand_holds(
    start: int, length: int, begin: int, width: int
) -> None:
    contact = np.zeros((45, 2), bool)
    contact[start : start + length, 1] = True
    strip = contact_strip(Held(contact, begin), 80, width, 12.0)
    green = (strip.picture == HOLDS).all(axis=-1)
    rows = np.nonzero(green.any(axis=1))[0]
    assert rows.min() > strip.foot / 2 - 1  # the lower lane, the right hand's
    columns = np.nonzero(green.any(axis=0))[0]
    pixels = (strip.right - strip.left) / 80
    assert abs(columns.min() - (strip.left + (begin + start) * pixels)) <= 1
    assert abs(columns.max() + 1 - (strip.left + (begin + start + length) * pixels)) <= 1


def test_the_truth_stands_above_and_the_cursor_moves() -> None:
    held, truth = np.zeros((60, 2), bool), np.zeros((60, 2), bool)
    held[10:20], truth[30:50] = True, True
    strip = contact_strip(Held(held), 60, 400, 12.0, Held(truth))
    green, dark = ((strip.picture == c).all(axis=-1) for c in (HOLDS, TRUE))
    for column, mask in ((15, green), (40, dark)):
        assert mask[:, strip.column(column)].any()
    top = [np.nonzero(mask.any(axis=1))[0].min() for mask in (dark, green)]
    assert top[0] < top[1]
    moved = [np.abs(strip.at([k]).astype(int) - strip.picture).max(axis=(0, 2)) for k in (5, 55)]
    assert np.argmax(moved[1]) - np.argmax(moved[0]) == strip.column(55.5) - strip.column(5.5)


def test_a_plate_holds_all_and_the_columns_decide_its_shape(one: Contender) -> None:
    numbers = (Number("jerk", "3 m/s3", True), Number("foot sliding", "0.2 cm"))
    cast = [replace(one, numbers=numbers), replace(one, label="two", truth=True), one]
    style = PlateStyle(96, 72, columns=3)
    (row,) = comparison_frames(cast, style, [4])
    (stack,) = comparison_frames(cast, replace(style, columns=1), [4])
    gap = max(2, round(0.3 * style.unit))
    plate = row.shape[0]
    assert row.shape[1] == 3 * 96 + 2 * gap
    assert stack.shape[:2] == (3 * plate + 2 * gap, 96)
    assert plate > 72 + 3 * style.unit
    below = row[-round(3 * style.unit) :].astype(int)
    best = ((below[..., 1] - below[..., 0]) > 40).any(axis=0)
    assert best[:96].any()  # the best figure is green
    assert not best[96 + gap : 2 * 96].any()


def test_a_sheet_has_a_row_for_each(one: Contender) -> None:
    style = PlateStyle(96, 72)
    sheet = comparison_sheet([one, replace(one, label="two")], style, 3)
    assert sheet.shape[1] == 3 * 96 + 2 * 4
    assert sheet.shape[0] > 2 * 72
    assert sheet.shape[0] % 2 == 0


def test_a_lettered_line_fits() -> None:
    long = "a name that is much too long to stand above a picture of this width"
    short = fitted(long, 14.0, 120.0)
    assert short.endswith("...")
    assert text_width(short, 14.0) <= 120.0
    assert fitted("short", 14.0, 120.0) == "short"
    blank = np.full((30, 200, 3), 255, np.uint8)
    write(blank, "words", (190, 15), 14.0, anchor="rm")
    used = np.nonzero((blank < 200).any(axis=(0, 2)))[0]
    assert 195 > used.max() > 180
    assert used.min() > 190 - text_width("words", 14.0) - 4
