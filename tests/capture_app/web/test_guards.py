"""Other web sites in the same browser, and others on the network, are kept out; its own page is not."""

import httpx
import pytest

from capture_app.web.app import ListenAddress
from capture_app.web.guards import Token
from omomo_core.errors import InputError
from tests.capture_app.web.raw import ask, exchange
from tests.capture_app.web.talk import Live, problem

TOKEN = "a-token-for-this-test"
EXAMPLE = "/api/uploads"


@pytest.mark.parametrize(
    "host",
    [
        *("evil.example", "evil.example:8765", "127.0.0.1.evil.example", "localhost.evil.example"),
        *("10.0.0.5", "user@127.0.0.1", "", None),
    ],
)
def test_a_name_that_is_not_ours_is_refused(live: Live, host: str | None):
    """DNS rebinding: a web site points its own name to this machine."""
    assert ask(live, Host=host) in (400, 403)
    assert ask(live, "/", Host=host) in (400, 403)


def test_two_names_are_refused(live: Live):
    head = f"GET /api/health HTTP/1.1\nHost: 127.0.0.1:{live.port}\nHost: evil.example"
    assert exchange(live, head)[0] == 400


@pytest.mark.parametrize(
    "origin",
    [
        *("null", "http://evil.example", "https://127.0.0.1.evil.example", "http://127.0.0.1:1"),
        *("http://localhost:3000", "file://", "chrome-extension://abcdef", "http://"),
    ],
)
@pytest.mark.parametrize("method", ["POST", "DELETE", "PATCH", "PUT"])
def test_another_origin_changes_nothing(live: Live, origin: str, method: str):
    assert ask(live, EXAMPLE, method, Origin=origin) == 403
    # Not even when the rest looks right.
    same = "same-origin"
    assert ask(live, EXAMPLE, method, Origin=origin, Sec_Fetch_Site=same) == 403


@pytest.mark.parametrize(
    ("method", "headers"),
    [
        ("GET", {"Sec_Fetch_Site": "cross-site", "Sec_Fetch_Mode": "cors"}),
        ("GET", {"Sec_Fetch_Site": "cross-site", "Sec_Fetch_Mode": "no-cors"}),
        (
            "GET",
            {
                "Sec_Fetch_Site": "cross-site",
                "Sec_Fetch_Mode": "navigate",
                "Sec_Fetch_Dest": "iframe",
            },
        ),
        (
            "POST",
            {
                "Sec_Fetch_Site": "cross-site",
                "Sec_Fetch_Mode": "navigate",
                "Sec_Fetch_Dest": "document",
            },
        ),
        ("POST", {"Sec_Fetch_Site": "same-site", "Sec_Fetch_Mode": "cors"}),
        ("OPTIONS", {"Sec_Fetch_Site": "cross-site", "Origin": "http://evil.example"}),
    ],
)
def test_another_site_gets_nothing(live: Live, method: str, headers: dict[str, str]):
    assert ask(live, EXAMPLE, method, **headers) == 403


def test_no_site_is_told_that_it_may_read(client: httpx.Client):
    answer = client.get("/api/health", headers={"Origin": "http://evil.example"})
    assert not [name for name in answer.headers if name.startswith("access-control")]
    assert answer.headers["cross-origin-resource-policy"] == "same-origin"


@pytest.fixture(scope="module")
def guarded(open_site, serve) -> Live:
    """A server beyond this machine, also shown by a proxy."""
    site = open_site(Token(TOKEN))
    return serve(site, ListenAddress("0.0.0.0", ("omocap.example.org",)))


@pytest.mark.parametrize(
    ("target", "headers"),
    [
        ("/api/health", {}),
        ("/api/health", {"Authorization": "Bearer wrong-token-wrong"}),
        ("/api/health", {"Authorization": f"Basic {TOKEN}"}),
        ("/api/health", {"Cookie": "omocap-{port}=wrong"}),
        ("/api/health", {"Cookie": f"omocap-{{port}}={TOKEN}"}),
        (f"/api/health?token={TOKEN}", {}),
        ("/api/openapi.json", {"Cookie": "omocap-{port}="}),
    ],
)
def test_who_does_not_know_the_token_gets_nothing(guarded: Live, target: str, headers):
    headers = {name: value.format(port=guarded.port) for name, value in headers.items()}
    assert ask(guarded, target, **headers) == 401
    assert ask(guarded, "/api/jobs", "POST", **headers) == 401


def test_the_link_is_needed_once_and_does_not_stay_in_the_address(guarded: Live):
    with httpx.Client(base_url=guarded.url) as browser:
        opened = browser.get(f"/?token={TOKEN}")
        assert (opened.status_code, opened.headers["location"]) == (303, "/")
        cookie = opened.headers["set-cookie"].lower()
        assert "httponly" in cookie
        assert "samesite=strict" in cookie
        # Browsers send it to every port of the host: it is not the token, and each port has its own.
        assert cookie.startswith(f"omocap-{guarded.port}=")
        assert TOKEN.lower() not in cookie
        assert browser.get("/api/health").status_code == 200


def test_the_page_may_ask_for_the_token(guarded: Live):
    with httpx.Client(base_url=guarded.url) as browser:
        wrong = browser.post("/api/login", json={"token": "not the right one"})
        assert problem(wrong, 401)["code"] == "token-wrong"
        assert browser.get("/api/health").status_code == 401
        assert browser.post("/api/login", json={"token": TOKEN}).status_code == 204
        assert browser.get("/api/health").status_code == 200


@pytest.mark.parametrize("weak", ["", "short", "fifteen-letters", "sechzehn Zeichen Ä"])
def test_a_token_that_can_be_guessed_is_refused(weak: str):
    with pytest.raises(InputError) as caught:
        Token(weak)
    assert caught.value.code == "token-weak"


def _local(live: Live) -> str:
    return f"127.0.0.1:{live.port}"


LINK = {"Sec_Fetch_Mode": "navigate", "Sec_Fetch_Dest": "document"}


@pytest.mark.parametrize(
    ("method", "target", "headers"),
    [
        ("GET", "/", {"Sec_Fetch_Site": "none", **LINK}),  # typed, or a bookmark
        ("GET", "/", {"Sec_Fetch_Site": "cross-site", **LINK}),  # a link in a mail or a wiki
        ("GET", "/api/health", {"Sec_Fetch_Site": "same-origin", "Sec_Fetch_Mode": "cors"}),
        ("POST", "/api/example", {"Origin": "http://{here}", "Sec_Fetch_Site": "same-origin"}),
        ("POST", "/api/example", {"Origin": "http://{here}"}),  # a browser without Sec-Fetch
        ("POST", "/api/example", {}),  # curl, a script
        ("GET", "/api/health", {"Host": "localhost:9000"}),  # ssh -L 9000:localhost:8765
        ("GET", "/api/health", {"Host": "[::1]:8765"}),
    ],
)
def test_what_is_as_it_should_be_passes(live: Live, method: str, target: str, headers):
    here = _local(live)
    filled = {name: value.format(here=here) for name, value in headers.items()}
    assert ask(live, target, method, **filled) == 200


@pytest.mark.parametrize(
    "headers",
    [
        {"Host": "omocap.example.org", "Origin": "https://omocap.example.org"},  # Host passed on
        {"Origin": "https://omocap.example.org"},  # Host rewritten
        {"Host": "192.168.1.20:8765", "Origin": "http://192.168.1.20:8765"},  # from a phone
    ],
)
def test_a_proxy_and_the_local_network_pass(guarded: Live, headers: dict[str, str]):
    known = {"Authorization": f"Bearer {TOKEN}"}
    assert ask(guarded, "/api/example", "POST", **headers, **known) == 200


def test_beyond_this_machine_a_web_sites_name_is_still_refused(guarded: Live):
    assert ask(guarded, Host="evil.example", Authorization=f"Bearer {TOKEN}") == 403


@pytest.mark.parametrize("path", ["/", "/api/health", "/api/nothing", "/static/nothing.js"])
def test_every_answer_tells_the_browser_what_not_to_do(client: httpx.Client, path: str):
    headers = client.get(path).headers
    policy = headers["content-security-policy"]
    assert "default-src 'self'" in policy
    assert "frame-ancestors 'none'" in policy
    assert "unsafe" not in policy
    assert headers["x-content-type-options"] == "nosniff"
    assert headers["referrer-policy"] == "same-origin"


def test_no_socket_is_opened(live: Live):
    head = (
        f"GET /api/health HTTP/1.1\nHost: 127.0.0.1:{live.port}\nUpgrade: websocket\n"
        "Connection: Upgrade\nSec-WebSocket-Key: dGhlIHNhbXBsZQ==\nSec-WebSocket-Version: 13"
    )
    assert exchange(live, head)[0] != 101
