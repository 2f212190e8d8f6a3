"""What a job waits for, and what stays because it does."""

from collections.abc import Iterator

import httpx
import pytest

from capture_app.jobs.worker_store import WorkerStore
from capture_app.web.site import Site
from tests.capture_app.overlay.taken import Watched, phone_take, standing
from tests.capture_app.web.talk import problem
from tests.simulator.wiggle import wiggle_motion
from tests.simulator.witness import tripod

TAKE, OTHER = "00000000000000aa", "00000000000000ab"


@pytest.fixture(scope="module")
def take(client: httpx.Client, site: Site) -> dict[str, str]:
    """Ids of the recording and the mount in the library that a result was made from."""
    example = client.post("/api/example").json()
    motion = wiggle_motion("all axes", seconds=14.0, seed=3)
    watched = Watched(motion, standing(len(motion.valid), -0.5), tripod(distance=1.6))
    made = phone_take(watched, site.library.root / "taken")
    text = (made.folder / "manifest.json").read_text()
    for role in ("session", "mount"):
        path = next(given.path for given in made.manifest.inputs if given.role == role)
        ours = site.library.shelves[role].content(example[role])
        text = text.replace(path, str(ours))
    for id_ in (TAKE, OTHER):
        folder = site.library.results.place(id_)
        folder.mkdir()
        (folder / "manifest.json").write_text(text)
    return {role: example[role] for role in ("session", "mount")}


@pytest.fixture
def overlay(client: httpx.Client) -> Iterator[str]:
    """A job that draws into what the phone filmed, and that no worker begins."""
    answer = client.post("/api/jobs", json={"kind": "overlay", "result": TAKE})
    assert answer.status_code == 201, answer.text
    yield answer.json()["id"]
    client.post(f"/api/jobs/{answer.json()['id']}/cancel")


def test_what_a_queued_overlay_draws_into_stays(
    client: httpx.Client, take: dict[str, str], overlay: str
):
    for role, id_ in (*take.items(), ("result", TAKE)):
        refused = problem(client.delete(f"/api/{role}s/{id_}"), 409)
        assert (refused["code"], refused["where"]) == ("in-use", overlay)
    assert client.delete(f"/api/results/{OTHER}").status_code == 204


def test_nothing_stays_for_a_job_that_is_over(client: httpx.Client, take: dict[str, str]):
    mount = client.post("/api/mounts", json={"method": "identity", "name": "one"}).json()["id"]
    assert client.delete(f"/api/mounts/{mount}").status_code == 204
    assert client.get(f"/api/sessions/{take['session']}").status_code == 200


def test_a_queued_job_says_that_no_worker_is_there(client: httpx.Client, take, overlay: str):
    assert "No worker is there yet" in client.get(f"/api/jobs/{overlay}").json()["waits"]
    assert client.post(f"/api/jobs/{overlay}/cancel").json()["waits"] is None


def test_a_queued_job_says_that_others_are_done_first(
    client: httpx.Client, site: Site, take, overlay: str
):
    ledger = WorkerStore(site.queue._database, "worker-1")
    ledger.join()
    other = client.post("/api/jobs", json={"kind": "overlay", "result": TAKE}).json()["id"]
    with site.queue._database.begin() as c:
        workflow = c.exec_driver_sql(
            "SELECT workflow FROM omocap_jobs WHERE id = ?", (other,)
        ).scalar()
    assert ledger.claim(other, str(workflow)) is not None
    told = client.get(f"/api/jobs/{overlay}").json()
    assert told["waits"] == "The workers are busy: 1 running, 1 waiting with this one."
    assert client.get(f"/api/jobs/{other}").json()["waits"] is None
    ledger.leave()
    client.post(f"/api/jobs/{other}/cancel")
