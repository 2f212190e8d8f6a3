"""What a run is told in place of what its recording lacks, and what its report is told alike."""

import json

import httpx
import numpy as np
import pytest

from capture_app.commands.run import RunRequest
from capture_app.web.site import Site
from ingest.trajectory.trajectory_config import AS_LOGGED, Reading
from omomo_core.errors import InputError
from tests.capture_app.web.talk import problem, upload

SAID = {"floor": -0.7, "segment": 1, "format": "Stray Scanner", "stitch": True, "closure": True}
"""Nonsense for the example: a run of it has to be forced."""


@pytest.fixture(scope="module")
def example(client: httpx.Client) -> dict[str, str]:
    return client.post("/api/example").json()


@pytest.fixture(scope="module")
def thrown(client: httpx.Client, tmp_path_factory: pytest.TempPathFactory) -> str:
    """Id of an object's own motion."""
    file = tmp_path_factory.mktemp("own") / "thrown.npz"
    np.savez(file, T_world_object=np.tile(np.eye(4), (60, 1, 1)), fps=30)
    return upload(client, {"thrown.npz": file.read_bytes()}, "session")


def report(client: httpx.Client, session: str, **said: object) -> dict:
    answer = client.get(f"/api/sessions/{session}/report", params=said)
    assert answer.status_code == 200, answer.text
    return answer.json()


def ordered(client: httpx.Client, site: Site, **wanted: object) -> RunRequest:
    """The order as its worker reads it; the job is forgotten again."""
    answer = client.post("/api/jobs", json={"kind": "run", **wanted})
    assert answer.status_code == 201, answer.text
    id_ = answer.json()["id"]
    with site.queue._database.begin() as c:
        text = c.exec_driver_sql("SELECT [order] FROM omocap_jobs WHERE id = ?", (id_,)).scalar()
    client.post(f"/api/jobs/{id_}/cancel")
    assert client.delete(f"/api/jobs/{id_}").status_code == 204
    return RunRequest.model_validate(json.loads(text or ""))


def test_a_phones_recording_without_a_mount_is_refused_before_a_job_is_made(
    client: httpx.Client, site: Site, example: dict[str, str]
):
    before = len(site.queue.list())
    order = {"kind": "run", "session": example["session"], "object": example["object"]}
    error = problem(client.post("/api/jobs", json=order), 422)
    assert (error["code"], error["where"]) == ("mount-needed", "mount")
    assert '"mount": "identity"' in error["fix"]
    assert len(site.queue.list()) == before


def test_the_phones_own_frame_is_taken_where_it_is_said(
    client: httpx.Client, site: Site, example: dict[str, str]
):
    both = {"session": example["session"], "object": example["object"]}
    order = ordered(client, site, **both, mount="identity", options={"force": True})
    assert (order.mount, order.animated) == (None, False)
    assert ordered(client, site, **example).mount is not None
    wrong = {"kind": "run", **both, "mount": "Identity"}
    assert problem(client.post("/api/jobs", json=wrong), 422)["code"] == "request-invalid"


def test_a_run_may_be_asked_to_refuse_what_is_usable_with_limits(
    client: httpx.Client, site: Site, example: dict[str, str]
):
    assert not ordered(client, site, **example).strict
    assert ordered(client, site, **example, options={"strict": True}).strict


def test_an_objects_own_motion_needs_no_mount_and_takes_none(
    client: httpx.Client, site: Site, example: dict[str, str], thrown: str
):
    order = ordered(client, site, session=thrown, object=example["object"])
    assert (order.mount, order.animated) == (None, True)
    given = {"kind": "run", "session": thrown, "object": example["object"]}
    for mount in (example["mount"], "identity"):
        refused = problem(client.post("/api/jobs", json={**given, "mount": mount}), 422)
        assert refused["code"] == "mount-unused"
    told = report(client, thrown, object=example["object"])
    assert (told["verdict"], told["animated"], told["checks"]) == ("not judged", True, [])
    page = client.get(f"/api/sessions/{thrown}/report.html")
    assert problem(page, 404)["code"] == "report-none"


@pytest.mark.parametrize(("up", "word"), [("object:-y", "object:-y"), ([0, 1, 0], "0,1,0")])
def test_a_run_and_its_report_are_told_the_same(
    client: httpx.Client, site: Site, example: dict[str, str], monkeypatch, up: object, word: str
):
    order = ordered(client, site, **example, options={**SAID, "up": up, "force": True})
    asked: list[Reading] = []

    async def run(_: object, seen, data):
        asked.append(seen.reading)
        raise RuntimeError

    monkeypatch.setattr(type(site.sandbox), "run", lambda self, *given: run(*given))
    at = f"/api/sessions/{example['session']}/report"
    client.get(
        at, params={k: v for k, v in example.items() if k != "session"} | SAID | {"up": word}
    )
    assert asked == [order.reading]
    assert all(getattr(asked[0], key) != getattr(AS_LOGGED, key) for key in vars(AS_LOGGED))


def test_the_verdict_follows_what_is_said_and_gives_its_reason(
    client: httpx.Client, example: dict[str, str]
):
    ids = {key: example[key] for key in ("object", "mount")}
    good = report(client, example["session"], **ids)
    assert (good["verdict"], good["reason"], good["animated"]) == ("good", "", False)
    high = report(client, example["session"], **ids, floor=5.0)
    assert high["verdict"] != "good"
    assert high["reason"].startswith("floor: ")
    gone = report(client, example["session"], **ids, segment=9)
    assert (gone["verdict"], gone["problem"]["code"]) == ("not usable", "segment-missing")
    assert gone["reason"] == gone["problem"]["what"]
    other = report(client, example["session"], **ids, format="no such app")
    assert other["problem"]["code"] == "format-unknown"
    assert report(client, example["session"], **ids) == good


@pytest.mark.parametrize(
    "said", [{"up": "upwards"}, {"up": "nan,1,0"}, {"floor": "inf"}, {"segment": 0}]
)
def test_what_is_said_wrongly_is_refused(
    client: httpx.Client, example: dict[str, str], said: dict[str, object]
):
    answer = client.get(f"/api/sessions/{example['session']}/report", params=said)
    assert problem(answer, 422)["fix"]


@pytest.mark.parametrize(("code", "status"), [("disk-full", 507), ("output-not-writable", 422)])
def test_a_report_that_cannot_be_written_is_no_fault_of_the_recording(
    client: httpx.Client, site: Site, example: dict[str, str], monkeypatch, code: str, status: int
):
    async def run(*_: object):
        raise InputError(code, "It cannot be written.", fix="Make room.")

    monkeypatch.setattr(type(site.sandbox), "run", run)
    at = f"/api/sessions/{example['session']}/report?floor=-0.123"
    assert problem(client.get(at), status)["code"] == code
