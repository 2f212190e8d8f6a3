"""Contacts: written by a run, given to a run, and corrected in a result."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from capture_app.cli.app import invoke
from capture_app.commands.run import ResolveRequest, RunRequest
from capture_app.pipeline import run_take
from capture_app.replay.scene_pack import pack_people
from capture_app.resolve import resolve_result, tried_correction
from capture_app.result import Result, load_result
from capture_app.simulator.demo_take import DEMO, MESH, MOUNT, SESSION
from capture_app.solve_samples import solved_result
from omomo_core.contact.contact_file import read_contacts
from omomo_core.errors import InputError
from omomo_core.geometry.surface import sample_surface
from tests.capture_app.replay.made import read_pack
from tests.capture_app.test_cli import assert_refused

Inputs = Any
Contacts = dict[str, Any]


def silent(stage: str, fraction: float) -> None:
    """Nobody listens."""


@pytest.fixture(scope="module")
def demo(tmp_path_factory: pytest.TempPathFactory) -> Result:
    """The demonstration take with the shipped weights, quickly."""
    request = RunRequest(
        session=DEMO / SESSION,
        object=DEMO / MESH,
        mount=DEMO / MOUNT,
        output=tmp_path_factory.mktemp("demo") / "result",
        samples=2,
        steps=4,
        video_size=None,
    )
    return run_take(request, silent)


@pytest.fixture
def contacts(demo: Result) -> Contacts:
    """Those of the result, to be corrected."""
    return json.loads((demo.folder / "contacts.json").read_text())


def correct(demo: Result, contacts: Contacts, folder: Path) -> Result:
    edited = folder / "edited.json"
    edited.write_text(json.dumps(contacts))
    request = ResolveRequest(
        result=demo.folder, contacts=edited, output=folder / "new", video_size=None
    )
    return resolve_result(request, silent)


def test_any_sample_is_corrected_when_it_is_named(demo: Result, tmp_path: Path) -> None:
    other = 1 - demo.manifest.chosen
    edited = tmp_path / "edited.json"
    edited.write_text(
        '{"version": 1, "fps": 30, "frames": FRAMES, "segments": []}'.replace(
            "FRAMES", str(len(demo.object_motion.valid))
        )
    )
    request = ResolveRequest(
        result=demo.folder,
        contacts=edited,
        sample=other + 1,
        output=tmp_path / "new",
        video_size=None,
    )
    made = resolve_result(request, silent)
    assert made.manifest.correction is not None
    assert made.manifest.correction.sample == other
    before = solved_result(demo, [other]).people[other]
    np.testing.assert_allclose(made.people[0].human.root, before.human.root, atol=0.1)
    with pytest.raises(InputError, match="no sample 3"):
        resolve_result(request.model_copy(update={"sample": 3, "output": tmp_path / "x"}), silent)


def test_contacts_are_tried_without_a_trace(
    demo: Result, contacts: Contacts, tmp_path: Path
) -> None:
    contacts["segments"][0]["stop"] -= 5
    edited = tmp_path / "edited.json"
    edited.write_text(json.dumps(contacts))
    request = ResolveRequest(result=demo.folder, contacts=edited, output=tmp_path / "none")
    there = sorted(demo.folder.rglob("*"))
    tried = tried_correction(request)
    assert sorted(demo.folder.rglob("*")) == there
    assert list(tmp_path.iterdir()) == [edited]
    kept = correct(demo, contacts, tmp_path).people[0]
    shown = tried.people[demo.manifest.chosen]
    np.testing.assert_allclose(shown.human.root, kept.human.root, atol=1e-6)
    other = 1 - demo.manifest.chosen
    assert tried.people[other] is not shown
    header, _ = read_pack(pack_people(tried))
    assert header["contacts"][demo.manifest.chosen][0]["stop"] == contacts["segments"][0]["stop"]


def test_a_run_writes_the_contacts_of_its_chosen_sample(demo: Result) -> None:
    assert "contacts.json" in demo.manifest.files
    surface = sample_surface(demo.object_motion.mesh)
    path, person = demo.folder / "contacts.json", demo.people[demo.manifest.chosen]
    spans = read_contacts(path, len(demo.object_motion.valid), surface)
    assert len(spans) > 0
    for read, held in zip(spans, person.segments, strict=True):
        assert (read.hand, read.start, read.stop) == (held.hand, held.start, held.stop)
        weight = person.human.hand_contact[held.start : held.stop, held.hand]
        assert weight.min() > 0.99


def test_written_contacts_are_accepted_and_obeyed_and_rerun(demo: Result, tmp_path: Path) -> None:
    given = tmp_path / "contacts.json"
    given.write_text((demo.folder / "contacts.json").read_text())
    words = ["run", str(DEMO / SESSION), "--object", str(DEMO / MESH), "--mount", str(DEMO / MOUNT)]
    words += ["--samples", "2", "--steps", "2", "--seed", "5", "--no-video"]
    assert invoke([*words, "--contacts", str(given), "-o", str(tmp_path / "out")]) == 0
    made = load_result(tmp_path / "out")
    assert (made.folder / "contacts.json").read_text() == given.read_text()
    for person in made.people:
        assert len(person.segments) == len(demo.people[demo.manifest.chosen].segments)
    assert {"contacts"} < {item.role for item in made.manifest.inputs}

    assert invoke(["rerun", str(made.folder), "-o", str(tmp_path / "again")]) == 0
    first = (made.folder / "motion.npz").read_bytes()
    assert (tmp_path / "again" / "motion.npz").read_bytes() == first


def test_changed_contacts_are_not_run_again_silently(
    capsys: pytest.CaptureFixture[str], inputs: Inputs, weights: Path
) -> None:
    given = inputs.folder / "given.json"
    given.write_text('{"version": 1, "fps": 30, "frames": 91, "segments": []}')
    made = run_take(inputs.request(weights).model_copy(update={"contacts": given}), silent)
    assert not any(person.human.hand_contact.any() for person in made.people)
    given.write_text(given.read_text() + "\n")
    words = ["rerun", str(made.folder), "-o", str(inputs.folder / "again")]
    assert_refused(capsys, inputs.folder, words, "input-changed")


@pytest.mark.parametrize("published", [["--contact", "paper"], ["--config", "paper"]])
def test_the_published_rule_takes_no_contacts(
    capsys: pytest.CaptureFixture[str], inputs: Inputs, weights: Path, published: list[str]
) -> None:
    given = inputs.folder / "given.json"
    given.write_text('{"version": 1, "fps": 30, "frames": 91, "segments": []}')
    words = ["run", str(inputs.session), "--object", str(inputs.mesh), "--mount", "identity"]
    words += ["--weights", str(weights), "-o", str(inputs.output), "--contacts", str(given)]
    assert_refused(capsys, inputs.folder, [*words, *published], "contacts-unused")


def test_contacts_of_another_take_are_refused_before_anything_is_made(
    capsys: pytest.CaptureFixture[str], inputs: Inputs, weights: Path
) -> None:
    given = inputs.folder / "given.json"
    given.write_text('{"version": 1, "fps": 30, "frames": 90, "segments": []}')
    words = ["run", str(inputs.session), "--object", str(inputs.mesh), "--mount", "identity"]
    words += ["--weights", str(weights), "-o", str(inputs.output), "--contacts", str(given)]
    assert_refused(capsys, inputs.folder, words, "contacts-frames")


def test_a_palm_goes_where_its_anchor_is_put(
    demo: Result, contacts: Contacts, tmp_path: Path
) -> None:
    last = max(contacts["segments"], key=lambda s: s["stop"])
    x = last["anchor"][0]
    last["anchor"][0] = round(x - 0.1 if x > 0 else x + 0.1, 5)
    made = correct(demo, contacts, tmp_path)
    hand = ("left", "right").index(last["hand"])
    rows = slice(last["start"], last["stop"])
    T = made.object_motion.T_world_object[rows]
    place = T[:, :3, :3] @ last["anchor"] + T[:, :3, 3]
    palm = made.motions[0].joints[rows, 22 + hand]
    assert np.linalg.norm(palm - place, axis=1).max() < 0.01

    stays = np.ones(len(made.object_motion.valid), bool)
    stays[max(rows.start - 19, 0) : rows.stop + 19] = False
    assert stays.sum() > 20
    chosen = demo.manifest.chosen
    with np.load(demo.folder / "motion.npz") as old, np.load(made.folder / "motion.npz") as new:
        for key in ("root", "joints", "rotations_xyzw", "fingers_xyzw", "hand_contact", "inside"):
            np.testing.assert_array_equal(new[key][0, stays], old[key][chosen, stays])
    assert json.loads((made.folder / "contacts.json").read_text()) == contacts


@pytest.mark.runs("resolve")
def test_a_corrected_result_says_where_it_comes_from(
    capsys: pytest.CaptureFixture[str], demo: Result, contacts: Contacts, tmp_path: Path
) -> None:
    taken_out = contacts["segments"].pop()
    made = correct(demo, contacts, tmp_path)
    hand = ("left", "right").index(taken_out["hand"])
    rows = slice(taken_out["start"], taken_out["stop"])
    assert not made.motions[0].hand_contact[rows, hand].any()

    names = ["contacts.json", "manifest.json", "motion.glb", "motion.npz"]
    assert sorted(path.name for path in made.folder.iterdir()) == names
    origin, manifest = made.manifest.correction, made.manifest
    assert origin is not None
    assert (origin.result, origin.sample) == (str(demo.folder), demo.manifest.chosen)
    assert origin.contacts == str(tmp_path / "edited.json")
    assert len(made.people) == len(manifest.scores) == 1
    assert (manifest.inputs, manifest.weights) == (demo.manifest.inputs, demo.manifest.weights)
    assert list(manifest.timings) == ["read", "solve", "export"]

    words = ["render", str(made.folder), "--still", "1", "--size", "96x64"]
    assert invoke([*words, "-o", str(tmp_path / "still.png")]) == 0
    capsys.readouterr()
    words = ["rerun", str(made.folder), "-o", str(tmp_path / "again")]
    assert_refused(capsys, tmp_path, words, "result-corrected")
    # What was corrected may be corrected again.
    words = ["resolve", str(made.folder), "--contacts", str(demo.folder / "contacts.json")]
    assert invoke([*words, "-o", str(tmp_path / "third"), "--no-video"]) == 0
    assert "contacts.json" in capsys.readouterr().out


def same(contacts: Contacts) -> None:
    """As they were."""


def two_places(contacts: Contacts) -> None:
    contacts["segments"].append(contacts["segments"][0])


def far_off(contacts: Contacts) -> None:
    contacts["segments"][0]["anchor"][2] += 1.0


def too_long(contacts: Contacts) -> None:
    contacts["segments"][0]["stop"] = contacts["frames"] + 1


def another_take(contacts: Contacts) -> None:
    contacts["frames"] += 1


def no_hand(contacts: Contacts) -> None:
    contacts["segments"][0]["hand"] = "foot"


@pytest.mark.parametrize(
    ("spoil", "code"),
    [
        (same, "contacts-same"),
        (two_places, "contacts-overlap"),
        (far_off, "contacts-off-surface"),
        (too_long, "contacts-range"),
        (another_take, "contacts-frames"),
        (no_hand, "contacts-hand"),
    ],
)
def test_bad_corrections_are_refused(
    capsys: pytest.CaptureFixture[str],
    demo: Result,
    contacts: Contacts,
    tmp_path: Path,
    spoil: Callable[[Contacts], None],
    code: str,
) -> None:
    spoil(contacts)
    edited = tmp_path / "edited.json"
    edited.write_text(json.dumps(contacts))
    words = ["resolve", str(demo.folder), "--contacts", str(edited), "-o", str(tmp_path / "new")]
    assert_refused(capsys, tmp_path, words, code)


def test_bad_places_are_refused(
    capsys: pytest.CaptureFixture[str], demo: Result, contacts: Contacts, tmp_path: Path
) -> None:
    contacts["segments"].pop()
    edited = tmp_path / "edited.json"
    edited.write_text(json.dumps(contacts))
    taken = tmp_path / "taken"
    taken.mkdir()
    for result, file, output, code in (
        (tmp_path, edited, tmp_path / "new", "result-missing"),
        (demo.folder, tmp_path / "none.json", tmp_path / "new", "contacts-missing"),
        (demo.folder, edited, taken, "output-exists"),
        (demo.folder, edited, demo.folder, "output-is-input"),
    ):
        words = ["resolve", str(result), "--contacts", str(file), "-o", str(output)]
        assert_refused(capsys, tmp_path, words, code)


def test_a_result_of_the_published_rule_has_no_contacts_to_correct(
    capsys: pytest.CaptureFixture[str], inputs: Inputs, weights: Path
) -> None:
    made = run_take(
        inputs.request(weights).model_copy(update={"samples": 1, "steps": 2, "contact": "paper"}),
        silent,
    )
    assert not (made.folder / "contacts.json").exists()
    words = ["resolve", str(made.folder), "--contacts", "x.json", "-o", str(inputs.folder / "new")]
    assert_refused(capsys, inputs.folder, words, "result-without-contacts")


@pytest.mark.parametrize("stage", ["solve", "export"])
def test_an_interrupted_correction_leaves_nothing(
    demo: Result, contacts: Contacts, tmp_path: Path, stage: str
) -> None:
    def interrupt(heard: str, fraction: float) -> None:
        if heard == stage:
            raise KeyboardInterrupt

    contacts["segments"].pop()
    edited = tmp_path / "edited.json"
    edited.write_text(json.dumps(contacts))
    request = ResolveRequest(
        result=demo.folder, contacts=edited, output=tmp_path / "new", video_size=(96, 64)
    )
    with pytest.raises(KeyboardInterrupt):
        resolve_result(request, interrupt)
    assert list(tmp_path.iterdir()) == [edited]
