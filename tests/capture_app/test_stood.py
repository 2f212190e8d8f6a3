"""Who says where they stood gets a motion that begins there; a place where nobody stands is refused."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from capture_app.commands.run import RunRequest
from capture_app.commands.text_values import read_place
from capture_app.known_person import known_person
from capture_app.manifest import Segment
from capture_app.pipeline import run_take
from capture_app.rerun import request_of
from capture_app.simulator.demo_take import DEMO, MESH, MOUNT, SESSION
from ingest.mount import Mount
from omomo_core.body.model import load_body
from omomo_core.errors import InputError
from omomo_core.generation.conditioning import Conditioning, PlaceInTime, person_constraint
from omomo_core.generation.generation_options import GenerationOptions
from omomo_core.generation.generator import sample_take
from omomo_core.generation.object_clip import ObjectModel
from omomo_core.motion import ObjectMesh, ObjectMotion
from omomo_core.weights.load import load_stages


def request(output: Path) -> RunRequest:
    """The demonstration: a box that stays for a while, then is carried off."""
    return RunRequest(
        session=DEMO / SESSION,
        object=DEMO / MESH,
        mount=DEMO / MOUNT,
        output=output,
        samples=1,
        video_size=None,
    )


@pytest.mark.parametrize("degrees", [0, 120, 240])
def test_a_person_begins_where_they_stood(tmp_path: Path, degrees: float):
    """From whatever side: three places around the box, with the weights that ship."""
    angle = np.radians(degrees)
    box = np.array([0.0, 0.0])
    place = box + 1.0 * np.array([np.cos(angle), np.sin(angle)])
    stood = (float(place[0]), float(place[1]))
    made = run_take(
        request(tmp_path / "out").model_copy(update={"stood": stood}), lambda stage, done: None
    )
    centre = made.object_motion.T_world_object[0, :2, 3]
    root = made.motions[0].root[0, :2]
    assert np.linalg.norm(root - place) < 0.35
    toward, meant = root - centre, place - centre
    between = np.arccos(toward @ meant / np.linalg.norm(toward) / np.linalg.norm(meant))
    assert np.degrees(between) < 30
    again = request_of(made.manifest, tmp_path / "again")
    assert again.stood == stood
    assert not any("‹stood›" in note for note in made.manifest.notes)


def test_who_could_not_have_come_in_time_is_told_so(inputs: Any, weights: Path) -> None:
    """Farther away than anybody comes from in the time that there is."""
    request = inputs.request(weights).model_copy(update={"stood": (2.5, 1.5), "video_size": None})
    made = run_take(request, lambda stage, done: None)
    root = made.motions[made.manifest.chosen].root[0, :2]
    told = [note for note in made.manifest.notes if "‹stood›" in note]
    off = float(np.linalg.norm(root - request.stood))
    assert [f"{off:.1f} m from where ‹stood›" in note for note in told] == [True] * (off > 0.5)
    assert off > 0.5


def _table(deep: float) -> ObjectMotion:
    """A board at 0.7 m, 1 m long and so deep from its middle to here, on a post."""
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-deep, 0.3) for z in (0.68, 0.7)])
    post = np.array([[x, y, z] for x in (-0.02, 0.02) for y in (-0.02, 0.02) for z in (0, 0.68)])
    faces = np.array([
        [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
        [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
    ])  # fmt: skip
    mesh = ObjectMesh(np.concatenate([corners, post]), np.concatenate([faces, faces + 8]), "table")
    return ObjectMotion(mesh, np.tile(np.eye(4), (30, 1, 1)), np.ones(30, bool))


HERE = Segment(index=1, count=1, start=0, stop=30)
# The phone's camera looks away from -y, its screen faces it.
SCREEN = np.array([[1, 0, 0, 0.1], [0, 0, -1, -0.3], [0, 1, 0, 0.7], [0, 0, 0, 1.0]])


# The same, clamped flat to the far edge: its screen faces the board.
FLAT_ON_IT = SCREEN.copy()
FLAT_ON_IT[1, 3] = 0.32


def _ask(
    stood: Any,
    T_world_phone: Any = SCREEN,
    segment: Segment = HERE,
    deep: float = 0.3,
    **more: Any,
):
    asked = request(Path("nowhere")).model_copy(update={"stood": stood, **more})
    mount = Mount(np.linalg.inv(T_world_phone), "made up")
    return known_person(asked, _table(deep), mount, segment).start


@pytest.mark.parametrize(
    ("place", "code"),
    [
        ((0.3, 0.1), "stood-inside"),
        ((5.0, 0.0), "stood-far"),
        ((float("inf"), 0.0), "stood-invalid"),
    ],
)
def test_nobody_stands_there(place: tuple[float, float], code: str):
    with pytest.raises(InputError) as refused:
        _ask(place)
    assert refused.value.code == code
    assert _ask((0.0, -0.6)) == (0.0, -0.6)
    assert _ask(None) is None


@given(x=st.floats(-0.45, 0.45), y=st.floats(-0.9, 0.9))
@settings(max_examples=10)
def test_nobody_stands_in_a_wardrobe(x: float, y: float):
    box = trimesh.creation.box((1.0, 2.0, 2.0))
    T = np.tile(np.eye(4), (30, 1, 1))
    T[:, 2, 3] = 1.0
    mesh = ObjectMesh(np.array(box.vertices), np.array(box.faces), "wardrobe")
    asked = request(Path("nowhere")).model_copy(update={"stood": (x, y)})
    with pytest.raises(InputError) as refused:
        known_person(asked, ObjectMotion(mesh, T, np.ones(30, bool)), Mount(np.eye(4), ""), HERE)
    assert refused.value.code == "stood-inside"


def test_who_taps_the_phone_stands_before_its_screen():
    assert _ask("phone") == pytest.approx((0.1, -0.8))
    # Above the far edge: the table is between, and the phone is seen over it.
    over = SCREEN.copy()
    over[1:3, 3] = 0.3, 0.9
    assert _ask("phone", over) == pytest.approx((0.1, -0.45))


def test_tracking_may_begin_a_little_after_the_log():
    late = Segment(index=1, count=1, start=29, stop=60)
    assert _ask("phone", segment=late) == _ask("phone")


def test_nobody_taps_a_phone_whose_front_is_all_table():
    over = SCREEN.copy()
    over[:3, 3] = 0.0, 0.29, 0.9
    with pytest.raises(InputError) as refused:
        _ask("phone", over, deep=2.5)
    assert refused.value.code == "stood-hidden"


@pytest.mark.parametrize("text", ["1", "Phone", "1,2,3", "nan,0", "1,inf", ""])
def test_what_is_no_place_is_said_so(text: str):
    with pytest.raises(InputError) as refused:
        read_place(text, "line 3")
    assert (refused.value.code, refused.value.where) == ("place-invalid", "line 3")
    assert read_place(" 0.5,-1", "line 3") == (0.5, -1.0)


@pytest.mark.parametrize(
    ("changed", "code"),
    [
        ({"configuration": "paper"}, "stood-unused"),
        ({"animated": True}, "stood-no-phone"),
        ({"T_world_phone": np.eye(4)}, "stood-level"),
        ({"T_world_phone": FLAT_ON_IT}, "stood-hidden"),
        ({"segment": Segment(index=2, count=2, start=90, stop=120)}, "stood-later"),
    ],
)
def test_a_phone_that_tells_no_side_is_refused(changed: dict[str, Any], code: str):
    with pytest.raises(InputError) as refused:
        _ask("phone", **changed)
    assert refused.value.code == code


def _pushed(way: float = 1.0, lift: float = 0.0) -> ObjectMotion:
    """A box of half a metre that rests for a second, goes along x, and rests again."""
    box = trimesh.creation.box((0.5, 0.5, 0.5))
    T = np.tile(np.eye(4), (120, 1, 1))
    T[:, 2, 3] = 0.25 + lift * np.interp(np.arange(120), [30, 45, 75, 90], [0, 1, 1, 0])
    T[:, 0, 3] = np.interp(np.arange(120), [30, 90], [0.0, way])
    return ObjectMotion(
        ObjectMesh(np.array(box.vertices), np.array(box.faces), "box"), T, np.ones(120, bool)
    )


@pytest.mark.parametrize(
    ("changed", "way", "code"),
    [
        ({"ends": (9.0, 0.0)}, 1.0, "ends-far"),
        ({"ends": (1.0, 0.1)}, 1.0, "ends-inside"),
        ({"side": (0.5, 0.2)}, 1.0, "side-inside"),
        ({"side": (-5.0, 0.0)}, 1.0, "side-far"),
        ({"side": "back"}, 0.05, "side-no-way"),
        ({"hands": "left", "contacts": Path("contacts.json")}, 1.0, "hands-unused"),
        ({"hands": "both", "contact": "paper"}, 1.0, "hands-unused"),
        ({"side": "back", "configuration": "paper"}, 1.0, "side-unused"),
        ({"ends": (2.0, 0.0), "configuration": "paper"}, 1.0, "ends-unused"),
    ],
)
def test_what_nobody_can_do_is_refused(changed: dict[str, Any], way: float, code: str):
    asked = request(Path("nowhere")).model_copy(update=changed)
    with pytest.raises(InputError) as refused:
        known_person(asked, _pushed(way), Mount(np.eye(4), ""), HERE)
    assert refused.value.code == code


@pytest.mark.parametrize(
    ("side", "place"), [("back", (-0.7, 0.0)), ((0.5, -0.8), (0.0, -0.7)), ("left", (0.0, 0.7))]
)
def test_the_person_holds_from_the_side_that_is_said(side: Any, place: tuple[float, float]):
    """Whatever the network would choose; with the weights that ship."""
    motion = _pushed(lift=0.6)
    person = known_person(
        request(Path("nowhere")).model_copy(update={"side": side}),
        motion,
        Mount(np.eye(4), ""),
        HERE,
    )
    known = person.conditioning(None)
    take = sample_take(
        motion, load_body(), load_stages("capture"), GenerationOptions(2), conditioning=known
    )
    for k in range(2):
        human = take.as_sampled(k).human
        off = human.root[30:90, :2] - motion.T_world_object[30:90, :2, 3]
        between = np.degrees(np.angle((off @ [1, 1j]).mean() * np.conj(complex(*place))))
        assert abs(between) < 60
        assert not list(person.notes(human, motion))


@pytest.mark.parametrize(
    ("hands", "used"),
    [("left", {(True, False)}), ("right", {(False, True)}), ("both", {(True, True)})],
)
def test_the_hands_that_are_said_hold_it(hands: str, used: set[tuple[bool, bool]]):
    motion = _pushed()
    known = Conditioning(held_with=hands)  # pyright: ignore[reportArgumentType]
    take = sample_take(
        motion, load_body(), load_stages("capture"), GenerationOptions(3), conditioning=known
    )
    held = [take.as_sampled(k).human.hand_contact.max(axis=0) > 0.5 for k in range(3)]
    assert {tuple(map(bool, h)) for h in held} == used


def test_the_person_ends_where_they_are_said_to():
    motion = _pushed()
    end = np.array([1.0, -0.8])
    known = Conditioning(end_position=end)
    take = sample_take(
        motion, load_body(), load_stages("capture"), GenerationOptions(2), conditioning=known
    )
    for k in range(2):
        assert np.linalg.norm(take.as_sampled(k).human.root[-1, :2] - end) < 0.4


def test_a_side_of_a_later_time_is_told_of_and_not_guessed():
    """What happens after the first chunk says nothing of the hypotheses, which are of the first."""
    late = PlaceInTime(np.array([0.5, -0.8]), 900)
    clip = ObjectModel(_pushed().mesh, 1.0).clip(_pushed().T_world_object)
    assert person_constraint(Conditioning(side=late), clip, last=True).side is None
    still = ObjectModel(_pushed().mesh, 1.0).clip(_pushed(way=0.0).T_world_object)
    assert person_constraint(Conditioning(side="front"), still, last=True).side is None
    assert person_constraint(Conditioning(side="front"), clip, last=True).side == "front"
