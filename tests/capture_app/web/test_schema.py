"""Whatever the schema allows, and what it does not, no route answers with a failure of its own."""

import contextlib
import re
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

from capture_app.web.app import create_app
from capture_app.web.guards import Token
from tests.capture_app.web.conftest import OpenSite
from tests.capture_app.web.talk import Live, announce, problem

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
@pytest.mark.timeout(1800)
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


def _fields(described: dict[str, Any]) -> Iterator[tuple[str, bool, dict[str, Any], str]]:
    """Each field and parameter: its name, whether it must be given, its schema and its description."""
    for name, model in described["components"]["schemas"].items():
        for field, schema in model.get("properties", {}).items():
            needed = field in model.get("required", ())
            yield f"{name}.{field}", needed, schema, " ".join(schema.get("description", "").split())
    for path, operations in described["paths"].items():
        for method, operation in operations.items():
            for asked in operation.get("parameters", ()):
                name = f"{method} {path} {asked['name']}"
                yield name, asked["required"], asked["schema"], asked.get("description", "")


def _has_numbers(schema: dict[str, Any]) -> bool:
    parts = [*schema.get("anyOf", ()), *schema.get("prefixItems", ())]
    parts += [schema["items"]] if isinstance(schema.get("items"), dict) else []
    return schema.get("type") in ("number", "integer") or any(map(_has_numbers, parts))


UNIT = re.compile(
    r"[Mm]etres|mm\b|[Ss]econds?\b|[Bb]ytes|pixels|degrees|percent|quaternion|matrix|T_object|[Ff]actor|[Ff]raction|"
    r"0 to 1|[Nn]umber|[Hh]ow (many|often)|from [01]\b|[Ff]rames|[Ss]teps|"
    r"Poses a|pose of|k1 k2|direction|seed"
)
DEFAULT = re.compile(r"not given|[Ii]nstead of|[Ww]ithout|[Ww]ith \w+:|Not needed|may be left out")


def test_each_field_is_described_with_its_unit_and_what_holds_without_it(live: Live):
    fields = list(_fields(live.app.openapi()))
    assert len(fields) > 300
    bare = [name for name, _, _, text in fields if not text]
    assert bare == []
    numbers = [n for n, _, schema, text in fields if _has_numbers(schema) and not UNIT.search(text)]
    assert numbers == []
    silent = [
        name
        for name, needed, schema, text in fields
        if not needed and "default" not in schema and not DEFAULT.search(text)
    ]
    assert silent == []
    assert [name for name, _, _, text in fields if "--" in text or "‹" in text] == []


def _operations_of(described: dict[str, Any]) -> list[dict[str, Any]]:
    return [one for path in described["paths"].values() for one in path.values()]


def test_the_name_of_an_operation_says_no_address(live: Live):
    names = [operation["operationId"] for operation in _operations_of(live.app.openapi())]
    assert len(set(names)) == len(names)
    assert {"jobs_order", "results_list", "results_scene", "sessions_get"} <= set(names)
    assert [n for n in names if re.search(r"_(api|id|post|put|patch)_|_(post|put|patch)$", n)] == []


def test_each_answer_has_a_type_and_a_file_is_binary(live: Live):
    for operation in _operations_of(live.app.openapi()):
        for kind, media in operation["responses"].get("200", {}).get("content", {}).items():
            schema = media.get("schema", {})
            text = kind in ("application/json", "text/html")
            assert text or schema == {"type": "string", "format": "binary"}, operation


def test_a_token_is_a_security_scheme_where_one_is_asked_for(live: Live, open_site: OpenSite):
    assert "securitySchemes" not in live.app.openapi()["components"]
    described = create_app(open_site(token=Token("a-token-for-this-test"))).openapi()
    (scheme,) = described["components"]["securitySchemes"].items()
    assert (scheme[1]["type"], scheme[1]["scheme"]) == ("http", "bearer")
    assert all([{scheme[0]: []}] == one["security"][:1] for one in _operations_of(described))
    assert described["paths"]["/api/login"]["post"]["security"][1:] == [{}]


def test_a_wrong_kind_is_answered_with_the_kinds(client: httpx.Client):
    what = problem(client.post("/api/jobs", json={"kind": "fly"}), 422)["what"]
    assert "run, resolve, export, render, compare, overlay, scan, calibrate by board" in what
    named = {"kind": "film", "name": "a", "files": []}
    what = problem(client.post("/api/uploads", json=named), 422)["what"]
    assert "'session', 'object', 'mount', 'video', 'contacts' or 'material'" in what
