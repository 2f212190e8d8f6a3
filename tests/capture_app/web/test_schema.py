"""Whatever the schema allows, and what it does not, no route answers with a failure of its own."""

import contextlib
from collections.abc import Iterator
from typing import Any

import httpx
import pytest
import requests
import schemathesis
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis.errors import Unsatisfiable
from schemathesis import Case
from schemathesis.generation import GenerationMode
from schemathesis.schemas import APIOperation

from tests.capture_app.web.talk import Live, announce

RESULT = "00000000000000dd"
_QUIET = list(HealthCheck)
_BODIES = ("POST", "PUT", "PATCH")


@pytest.fixture(scope="module")
def known(live: Live, client: httpx.Client) -> dict[str, str]:
    """A thing of each kind, by the first word of the addresses it has."""
    example = client.post("/api/example").json()
    order = {"kind": "run", **example}
    folder = live.site.library.results.place(RESULT)
    folder.mkdir()
    (folder / "manifest.json").write_text("{}")
    return {
        **{f"{kind}s": id_ for kind, id_ in example.items()},
        "results": RESULT,
        "uploads": announce(client, {"a.bin": 10})["id"],
        "jobs": client.post("/api/jobs", json=order).json()["id"],
    }


def _allowed(operation: APIOperation, known: dict[str, str]) -> Iterator[Any]:
    """Strategies of what the schema allows: of anything, and of a thing that is there."""
    yield operation.as_strategy()
    room = operation.path.split("/")[2]
    if "{id}" in operation.path and room in known and operation.method.upper() != "DELETE":
        others = {name: "0" for name in ("index", "name") if f"{{{name}}}" in operation.path}
        yield operation.as_strategy(path_parameters={"id": known[room], **others})


def _forbidden(operation: APIOperation) -> Iterator[Any]:
    """A strategy of what the schema does not allow, where there is anything of that kind."""
    if "{" in operation.path or operation.method.upper() in _BODIES:
        yield operation.as_strategy(generation_mode=GenerationMode.NEGATIVE)


def _try(live: Live, cases: Any, examples: int) -> int:
    session = requests.Session()
    sent = 0

    @settings(
        max_examples=examples,
        derandomize=True,
        database=None,
        suppress_health_check=_QUIET,
        phases=[Phase.generate],
    )
    @given(cases)
    def try_one(case: Case) -> None:
        nonlocal sent
        sent += 1
        answer = case.call(base_url=live.url, session=session, timeout=100)
        if answer.status_code == 507:
            return
        assert answer.status_code < 500, (case.method, case.formatted_path, answer.text)
        if answer.status_code >= 400 and answer.content:
            assert set(answer.json()["error"]) == {"code", "what", "where", "field", "fix"}

    with session:
        try_one()
    return sent


def _operations(live: Live) -> list[APIOperation]:
    schema = schemathesis.openapi.from_dict(live.app.openapi())
    return [found.ok() for found in schema.get_all_operations()]


@pytest.mark.slow
@pytest.mark.timeout(900)
@pytest.mark.parametrize(("examples", "step"), [(1, 7), (100, 1)])
def test_no_route_fails(live: Live, known: dict[str, str], examples: int, step: int):
    """A few routes in the quick tests."""
    operations = _operations(live)[::step]
    sent = [
        _try(live, cases, examples)
        for operation in operations
        for cases in _allowed(operation, known)
    ]
    assert len(operations) >= 50 // step
    assert sum(sent) >= len(operations)


@pytest.mark.slow
@pytest.mark.timeout(1800)
@pytest.mark.parametrize(
    "path", ["/api/jobs", "/api/mounts", "/api/uploads", "/api/calibration/look"]
)
def test_a_thousand_requests_to_the_routes_that_take_most(
    live: Live, known: dict[str, str], path: str
):
    found = [one for one in _operations(live) if one.path == path]
    asked = next(
        one for one in found if one.method.upper() == ("GET" if "look" in path else "POST")
    )
    assert sum(_try(live, cases, 1000) for cases in _allowed(asked, known)) >= 500


@pytest.mark.slow
def test_no_route_fails_on_what_it_does_not_expect(live: Live):
    sent = 0
    for operation in _operations(live):
        for cases in _forbidden(operation):
            # Any text is a name.
            with contextlib.suppress(Unsatisfiable):
                sent += _try(live, cases, 100)
    assert sent > 1000


def test_each_request_has_an_example(live: Live):
    described = live.app.openapi()
    schemas = described["components"]["schemas"]
    bodies = [
        media["schema"]
        for path in described["paths"].values()
        for operation in path.values()
        for kind, media in operation.get("requestBody", {}).get("content", {}).items()
        if kind == "application/json"
    ]
    names = {
        name.rpartition("/")[2]
        for body in bodies
        for name in ([body["$ref"]] if "$ref" in body else _choices(body))
    }
    assert len(names) > 10
    for name in names:
        assert schemas[name]["examples"], name


def _choices(body: dict[str, Any]) -> list[str]:
    return [
        name
        for choice in body.get("oneOf", body.get("anyOf", []))
        for name in ([choice["$ref"]] if "$ref" in choice else _choices(choice))
    ]
