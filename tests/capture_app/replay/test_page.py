"""The replay page in a real browser: a shared file, opened from the disk without a network."""

import json
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread

import numpy as np
import pytest
import torch
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, Page, expect

from capture_app.inspection import inspect_take
from capture_app.replay import VIEWER
from capture_app.replay.scene_pack import pack_session
from capture_app.result import body_of
from capture_app.simulator.demo_take import DEMO, SESSION
from omomo_core.body.kinematics import full_kinematics
from omomo_core.motion import FPS
from tests.capture_app.replay.conftest import OpenPage, canvas_of
from tests.capture_app.replay.made import FRAMES, human_of

LAST = (FRAMES - 1) / FPS


def _time(page: Page) -> float:
    return page.evaluate("replay.viewer.time")


def _differ(a: np.ndarray, b: np.ndarray) -> int:
    """Pixels that are clearly not the same."""
    return int((np.abs(a - b).max(axis=2) > 24).sum())


def test_person_is_where_python_has_them(open_page: OpenPage, packs, made) -> None:
    page = open_page(packs[0])
    frame = 25
    page.evaluate(f"replay.viewer.seek({frame / FPS})")
    human, body = human_of(made), body_of(made)
    parts = (torch.tensor(x[frame]).double() for x in (human.root, human.rotations, human.fingers))
    theirs = full_kinematics(body, *parts)[0].numpy()
    found = np.reshape(page.evaluate("Array.from(replay.viewer.joints(0))"), (52, 3))
    np.testing.assert_allclose(found, theirs, atol=3e-4)
    page.evaluate("replay.viewer.show({contacts: false, path: false, trail: false, phone: false})")
    shown = canvas_of(page)
    page.evaluate("replay.viewer.show({body: false, shadow: false})")
    empty = canvas_of(page)
    spots = [page.evaluate(f"replay.viewer.project({theirs[j].tolist()})") for j in (0, 4, 5, 15)]
    for spot in spots:
        v, u = round(spot["y"]), round(spot["x"])
        assert np.abs(shown[v, u] - empty[v, u]).max() > 40
        red, _, blue = shown[v, u]
        assert blue > red + 15


def test_scrubbing_changes_the_picture(open_page: OpenPage, packs) -> None:
    page = open_page(packs[0])
    before = canvas_of(page)
    assert len(np.unique(before.reshape(-1, 3), axis=0)) > 300
    scrubber = page.get_by_role("slider", name="Time")
    scrubber.scroll_into_view_if_needed()
    box = scrubber.bounding_box()
    assert box is not None
    page.mouse.click(box["x"] + 0.8 * box["width"], box["y"] + 8)
    assert _time(page) == pytest.approx(0.8 * LAST, abs=0.05)
    page.evaluate("replay.viewer.camera('orbit')")
    there = canvas_of(page)
    page.evaluate("replay.viewer.seek(0)")
    assert _differ(there, canvas_of(page)) > 500


def test_playing_goes_on_and_stops(open_page: OpenPage, packs) -> None:
    page = open_page(packs[0], still=False)
    expect(page.get_by_role("button", name="Pause")).to_be_visible()
    expect(page.get_by_role("slider", name="Time")).not_to_have_attribute("aria-valuenow", "0")
    page.get_by_role("button", name="Pause").click()
    rest = _time(page)
    calls = """async () => { let n = 0; const ask = window.requestAnimationFrame;
        window.requestAnimationFrame = (f) => { n++; return ask.call(window, f); };
        await new Promise((done) => setTimeout(done, 250)); return n; }"""
    assert page.evaluate(calls) == 0
    assert _time(page) == rest
    page.get_by_label("Loop").uncheck()
    page.evaluate(
        f"replay.viewer.speed = 4; replay.viewer.seek({LAST - 0.1}); replay.viewer.play()"
    )
    expect(page.get_by_role("button", name="Play")).to_be_visible()
    assert _time(page) == pytest.approx(LAST)


def test_all_goes_by_keyboard(open_page: OpenPage, packs) -> None:
    page = open_page(packs[0])
    page.keyboard.press("End")
    assert _time(page) == pytest.approx(LAST)
    page.keyboard.press(",")
    page.keyboard.press("ArrowLeft")
    assert _time(page) == pytest.approx(LAST - 2 / FPS)
    page.keyboard.press("Space")
    assert page.evaluate("replay.viewer.playing")
    page.keyboard.press("Space")
    page.keyboard.press("Home")
    assert _time(page) == 0
    seen = set()
    for _ in range(60):
        page.keyboard.press("Tab")
        seen.add(page.evaluate("document.activeElement.id || document.activeElement.textContent"))
        if page.evaluate("document.activeElement.id") == "edit":
            break
    assert {"Follow the person", "From above", "sample", "compare", "view", "play"} <= seen
    page.keyboard.press("Enter")
    page.get_by_role("slider", name="Time").focus()
    page.keyboard.press("PageUp")
    page.keyboard.press("Tab")
    page.keyboard.press("Tab")
    page.keyboard.press("ArrowRight")
    page.keyboard.press("Shift+ArrowRight")
    told = page.get_by_role("slider", name="Left hand contact 1, start")
    expect(told).to_be_focused()
    expect(told).to_have_attribute("aria-valuenow", "16")
    page.keyboard.press("Delete")
    left = page.evaluate("replay.timeline.contacts.segments")
    assert [(s["hand"], s["start"], s["stop"]) for s in left] == [("right", 5, 30)]
    page.locator("#view").focus()
    before = page.evaluate("replay.viewer.project([1, 0, 1]).x")
    page.keyboard.press("ArrowLeft")
    assert abs(page.evaluate("replay.viewer.project([1, 0, 1]).x") - before) > 1
    # The playhead went with the end that was moved to frame 16.
    assert _time(page) == pytest.approx(16 / FPS)


def test_two_results_side_by_side_and_over_each_other(open_page: OpenPage, packs) -> None:
    page = open_page(*packs)
    names = page.locator("#panes span")
    expect(names).to_have_text(["carry", "again"])
    panes = page.evaluate("replay.viewer.panes()")
    spots = [page.evaluate(f"replay.viewer.project([0.2, 0, 1], {k})") for k in (0, 1)]
    assert spots[1]["x"] - spots[0]["x"] == pytest.approx(panes[1]["x"], abs=1.5)
    page.get_by_label("Shown").select_option("over")
    over = [page.evaluate(f"replay.viewer.project([0.2, 0, 1], {k})") for k in (0, 1)]
    assert over[0] == over[1]
    page.get_by_label("Compare with").select_option("sample:1")
    expect(names).to_have_text(["Sample 1 (best)", "Sample 2"])
    apart = (
        "Math.hypot(...[0, 1].map(k => replay.viewer.joints(0)[k] - replay.viewer.joints(1)[k]))"
    )
    assert page.evaluate(apart) == pytest.approx(0.12, abs=1e-3)
    page.get_by_label("Compare with").select_option("")
    assert page.evaluate("replay.viewer.header(1)") is None


def test_session_without_a_result(open_page: OpenPage, tmp_path: Path) -> None:
    page = open_page(pack_session(inspect_take(DEMO / SESSION)))
    assert page.evaluate("replay.viewer.header(0).kind") == "session"
    expect(page.get_by_role("img", name="What the phone filmed")).to_be_visible()
    first = page.locator("#film img").get_attribute("src")
    page.keyboard.press("End")
    assert page.locator("#film img").get_attribute("src") != first
    decoded = """async () => { const picture = document.querySelector("#film img");
        await picture.decode(); return picture.naturalWidth; }"""
    assert page.evaluate(decoded) > 50
    assert page.get_by_role("button", name="Correct the contacts").count() == 0
    page.get_by_role("button", name="The phone's eye", exact=True).click()
    shown = canvas_of(page)
    page.evaluate("replay.viewer.show({path: false})")
    assert _differ(shown, canvas_of(page)) > 50


def test_picture_comes_back_with_a_lost_context(open_page: OpenPage, packs) -> None:
    page = open_page(packs[0])
    before = canvas_of(page)
    page.evaluate(
        """async () => { const canvas = document.getElementById("view");
        const lose = canvas.getContext("webgl2").getExtension("WEBGL_lose_context");
        const heard = (kind) => new Promise((done) => canvas.addEventListener(kind, done, {once: true}));
        const lost = heard("webglcontextlost"); lose.loseContext(); await lost;
        await new Promise((done) => setTimeout(done, 0));
        const back = heard("webglcontextrestored"); lose.restoreContext(); await back; }"""
    )
    assert _differ(before, canvas_of(page)) < 50


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_nobody_is_shut_out(open_page: OpenPage, packs, scheme: str) -> None:
    page = open_page(*packs, color_scheme=scheme)
    page.get_by_role("button", name="Correct the contacts").click()
    page.locator("summary").click()
    found = Axe().run(page).response["violations"]
    assert [(f["id"], [n["html"] for n in f["nodes"]]) for f in found] == []


def test_page_is_whole_on_a_phone(open_page: OpenPage, packs) -> None:
    page = open_page(packs[0], viewport={"width": 390, "height": 800}, device_scale_factor=3)
    wide = page.evaluate("document.documentElement.scrollWidth")
    assert wide <= 390
    size = page.evaluate("[document.getElementById('view').width, innerWidth * 2]")
    assert size[0] == size[1]


def test_saved_words_of_a_result_are_no_markup(open_page: OpenPage, packs) -> None:
    data = packs[0]
    length = int.from_bytes(data[:4], "little")
    header = json.loads(data[4 : 4 + length])
    trick = "</script><img src=x onerror=alert(1)>"
    header["notes"], header["name"] = [trick], trick
    text = json.dumps(header).encode()
    first = (4 + length + 7) // 8 * 8
    raw = len(text).to_bytes(4, "little") + text
    page = open_page(raw + bytes(-len(raw) % 8) + data[first:])
    expect(page.locator("#report li")).to_have_text([trick])
    assert page.locator("img").count() == 0


def test_page_of_a_server_shows_its_scene(browser: Browser, packs) -> None:
    class Answer(SimpleHTTPRequestHandler):
        def do_GET(self) -> None:
            name = self.path.split("?")[0].lstrip("/")
            body = packs[0] if name == "carry.pack" else (VIEWER / name).read_bytes()
            kinds = {".js": "text/javascript", ".css": "text/css", ".html": "text/html"}
            self.send_response(200)
            self.send_header(
                "Content-Type", kinds.get(Path(name).suffix, "application/octet-stream")
            )
            self.send_header("Content-Security-Policy", "default-src 'self'; img-src 'self' blob:")
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, *_: object) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Answer) as server:
        Thread(target=server.serve_forever, daemon=True).start()
        room = browser.new_context(reduced_motion="reduce")
        page = room.new_page()
        address = f"http://127.0.0.1:{server.server_address[1]}/replay.html"
        page.goto(f"{address}?scene=/carry.pack")
        expect(page.get_by_role("heading", level=1)).to_have_text("carry")
        expect(page.locator("#wait")).to_be_empty()
        page.goto(f"{address}?scene=https://example.org/x")
        expect(page.locator("#wait")).to_contain_text("another server")
        room.close()
        server.shutdown()
