"""The 3D view: it fills the window, plays, and is ruled by mouse, fingers and keys alike."""

import io
import re
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import expect

TIME = "Time"
CANVAS = ".stage.full .stage-frame canvas"
DRAWN = """() => [...document.querySelectorAll(".sample canvas")].map((one) => {
    const { data } = one.getContext("2d").getImageData(0, 0, one.width, one.height);
    return data.reduce((sum, value, k) => (sum * 31 + value * (k % 97)) % 1000003, 0);
})"""
"""A number of what is drawn in the picture of each sample."""


@pytest.fixture
def page(tabs, server, motion):
    page = tabs.open(server.at(f"/results/{motion}"))
    expect(page.get_by_role("slider", name=TIME)).to_be_visible(timeout=90_000)
    return page


def _until(page, condition: str) -> None:
    for _ in range(300):
        if page.evaluate(condition):
            return
        page.wait_for_timeout(100)
    raise TimeoutError(condition)


def _box(page, part: str) -> dict[str, float]:
    return page.locator(part).first.bounding_box()


def _frame(page) -> int:
    return int(page.get_by_role("slider", name=TIME).get_attribute("aria-valuenow"))


def _picture(page) -> np.ndarray:
    shot = page.locator(CANVAS).screenshot()
    return np.asarray(Image.open(io.BytesIO(shot)).convert("RGB"), int)


def _differ(a: np.ndarray, b: np.ndarray) -> float:
    return float((np.abs(a - b).max(axis=2) > 24).mean())


@pytest.mark.parametrize(
    ("width", "height", "least"),
    [(1440, 900, 350), (1920, 1080, 500), (2560, 1440, 850), (1024, 768, 250), (390, 844, 180)],
)
def test_the_view_fills_the_window_with_its_timeline(page, width: int, height: int, least: int):
    page.set_viewport_size({"width": width, "height": height})
    page.mouse.wheel(0, -5000)
    stage, tracks = _box(page, ".stage"), _box(page, ".stage-tracks")
    assert stage["width"] >= width - 60
    assert tracks["y"] + tracks["height"] <= height
    assert _box(page, CANVAS)["height"] >= least
    assert _box(page, CANVAS)["y"] >= 50
    expect(page.get_by_role("slider", name=TIME)).to_be_in_viewport(ratio=1)
    for name in ("Camera", "Speed"):
        expect(page.get_by_role("combobox", name=name, exact=True)).to_be_visible()
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")


def test_full_screen_by_key_and_by_button(page):
    page.keyboard.press("f")
    _until(page, "document.fullscreenElement?.matches('.stage')")
    size = page.evaluate("[innerWidth, innerHeight]")
    stage = _box(page, ".stage")
    assert (stage["width"], stage["height"]) == tuple(size)
    expect(page.get_by_role("slider", name=TIME)).to_be_in_viewport(ratio=1)
    page.get_by_role("button", name="Full screen").click()
    _until(page, "!document.fullscreenElement")


def test_a_browser_without_full_screen_fills_the_window(page):
    page.evaluate("Element.prototype.requestFullscreen = undefined")
    page.get_by_role("button", name="Full screen").click()
    box = _box(page, ".stage")
    assert (box["x"], box["y"], box["height"]) == (0, 0, page.viewport_size["height"])
    page.keyboard.press("f")
    expect(page.locator(".stage.whole")).to_have_count(0)


@pytest.fixture
def moving(browser: Any, server, motion) -> Iterator[Any]:
    """The page of a visitor with a touch screen who did not ask for less motion."""
    context = browser.new_context(
        viewport={"width": 390, "height": 844}, has_touch=True, reduced_motion="no-preference"
    )
    page = context.new_page()
    page.set_default_timeout(60_000)
    page.goto(server.at(f"/results/{motion}"))
    expect(page.get_by_role("slider", name=TIME)).to_be_visible(timeout=90_000)
    yield page
    context.close()


def test_a_motion_plays_when_it_opens(moving):
    expect(moving.get_by_role("button", name="Pause", exact=True)).to_be_visible()
    expect(moving.locator(".clock")).not_to_have_text(re.compile(r"^0\.0 /"))


def test_a_motion_waits_for_who_asked_for_less_motion(page):
    expect(page.get_by_role("button", name="Play", exact=True)).to_be_visible()
    assert _frame(page) == 0


def _swipe(page, fingers: list[tuple[float, float]], by: tuple[float, float]) -> None:
    """Fingers that go from their places by so many pixels."""
    session = page.context.new_cdp_session(page)
    for share in np.linspace(0, 1, 8):
        touches = [{"x": x + share * by[0], "y": y + share * by[1]} for x, y in fingers]
        kind = "touchMove" if share else "touchStart"
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": touches})
        page.wait_for_timeout(30)
    session.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    page.wait_for_timeout(300)


def test_one_finger_scrolls_and_two_turn_the_view(moving):
    page = moving
    page.get_by_role("button", name="Pause", exact=True).click()
    box = _box(page, CANVAS)
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    before = _picture(page)
    _swipe(page, [(x - 60, y), (x + 20, y)], (70, 0))
    turned = _picture(page)
    assert _differ(before, turned) > 0.02
    assert page.evaluate("scrollY") == 0
    _swipe(page, [(x, y)], (0, -150))
    assert page.evaluate("scrollY") > 50
    page.evaluate("scrollTo(0, 0)")
    assert _differ(turned, _picture(page)) < 0.005
    page.get_by_role("button", name="Full screen").click()
    _until(page, "Boolean(document.fullscreenElement)")
    page.wait_for_timeout(300)
    whole = _picture(page)
    box = _box(page, CANVAS)
    _swipe(page, [(box["width"] / 2, box["height"] / 2)], (120, 0))
    assert _differ(whole, _picture(page)) > 0.02


def test_the_wheel_scrolls_until_the_view_has_the_focus(page):
    canvas = page.locator(CANVAS)
    canvas.hover()
    page.mouse.wheel(0, 200)
    _until(page, "scrollY > 50")
    page.evaluate("scrollTo(0, 0)")
    before = _picture(page)
    canvas.click()
    page.mouse.wheel(0, 200)
    page.wait_for_timeout(500)
    assert page.evaluate("scrollY") == 0
    assert _differ(before, _picture(page)) > 0.01


def test_the_surface_of_a_video_is_dark_in_the_dark(page):
    page.emulate_media(color_scheme="dark")
    page.evaluate("document.querySelector('main').append(Object.assign("
                  "document.createElement('video'), {className: 'film'}))")  # fmt: skip
    color = page.locator("video.film").evaluate("(one) => getComputedStyle(one).backgroundColor")
    assert max(map(int, re.findall(r"\d+", color)[:3])) < 64
    look = "(one) => getComputedStyle(one).filter"
    assert page.locator("video.film").evaluate(look) == "brightness(0.82)"
    page.emulate_media(color_scheme="light")
    assert page.locator("video.film").evaluate(look) == "none"


def test_a_picture_is_loaded_when_it_is_drawn(tabs, server, motion, example):
    page = tabs.context.new_page()
    page.set_viewport_size({"width": 1280, "height": 4000})
    answers: list[int] = []
    page.on("response", lambda r: answers.append(r.status) if "picture" in r.url else None)
    page.goto(server.at("/library"))
    expect(page.locator("img:not(.none)").first).to_be_visible(timeout=90_000)
    expect(page.locator("img.none")).to_have_count(0, timeout=90_000)
    assert 404 not in answers


def test_the_person_is_seen_from_each_side_and_from_near(page):
    camera = page.get_by_role("combobox", name="Camera", exact=True)
    names = camera.locator("option").all_text_contents()
    assert names[:6] == [
        *("Follow the person", "From the front", "From the side", "From above"),
        *("On the hands", "On the feet"),
    ]
    seen = []
    for mode in ("follow", "front", "side", "top", "hands", "feet"):
        camera.select_option(mode)
        page.wait_for_timeout(200)
        seen.append(_picture(page))
    pairs = [_differ(a, b) for k, a in enumerate(seen) for b in seen[k + 1 :]]
    assert min(pairs) > 0.01


def test_steps_by_single_frames_with_buttons_and_keys(page):
    page.get_by_role("button", name="A frame on").click()
    assert _frame(page) == 1
    page.keyboard.press(".")
    page.keyboard.press(".")
    assert _frame(page) == 3
    page.keyboard.press(",")
    page.get_by_role("button", name="A frame back").click()
    assert _frame(page) == 1


def test_a_stretch_is_played_over_and_over(page):
    time = page.get_by_role("slider", name=TIME)
    time.focus()
    page.keyboard.press("PageUp")
    page.keyboard.press("[")
    for _ in range(6):
        page.keyboard.press("ArrowRight")
    page.keyboard.press("]")
    told = page.locator("summary", has_text="Loop")
    expect(told).to_have_text("Loop 1.0 to 1.2 s")
    page.keyboard.press("Space")
    frames = set()
    for _ in range(12):
        page.wait_for_timeout(100)
        frames.add(_frame(page))
    assert len(frames) > 1
    assert frames <= set(range(30, 37))
    page.keyboard.press("Space")
    told.click()
    page.get_by_role("button", name="The whole motion").click()
    expect(told).to_have_text("Loop")
    # The same with the mouse.
    lane = _box(page, ".tl-scrubber")
    page.keyboard.down("Shift")
    page.mouse.move(lane["x"] + lane["width"] * 0.25, lane["y"] + 10)
    page.mouse.down()
    page.mouse.move(lane["x"] + lane["width"] * 0.5, lane["y"] + 10, steps=3)
    page.mouse.up()
    page.keyboard.up("Shift")
    expect(told).to_have_text(re.compile(r"Loop \d\.\d to \d\.\d s"))


def test_each_sample_is_seen_small_and_shown_by_one_click(page, server, motion):
    item = server.ask(f"results/{motion}")
    _until(page, f"({DRAWN})().every(Boolean)")
    first = page.evaluate(DRAWN)
    assert len(first) == item["samples"]
    assert len(set(first)) == item["samples"]
    time = page.get_by_role("slider", name=TIME)
    time.focus()
    page.keyboard.press("PageUp")
    page.keyboard.press("PageUp")
    page.wait_for_function(
        f"(before) => ({DRAWN})().every((one, k) => one !== before[k])", arg=first
    )
    other = 1 - item["chosen"]
    page.locator(".sample canvas").nth(other).click()
    expect(page.get_by_text(re.compile(f"^Of sample {other + 1}\\."))).to_be_attached(
        timeout=60_000
    )
    expect(page.get_by_label(f"{other + 1}", exact=True)).to_be_checked()


def test_the_keyboard_alone_reaches_everything(page):
    wanted = {
        *("Play", "A frame back", "A frame on", "Speed", "Camera", "Loop", "Show", "Full screen"),
        *("Time", "All side by side"),
    }
    page.locator(CANVAS).focus()
    name = """() => {
        const one = document.activeElement;
        const label = one.labels?.[0]?.querySelector("span");
        return (one.ariaLabel ?? (label ?? one).textContent).trim();
    }"""
    reached = set()
    for _ in range(20):
        page.keyboard.press("Tab")
        reached.add(page.evaluate(name))
        if page.evaluate("document.activeElement.type") == "radio":
            page.keyboard.press("ArrowUp")
            page.keyboard.press("ArrowUp")
            reached.add(page.evaluate(name))
    assert wanted <= reached


def test_the_page_is_light(tabs, server, motion):
    page = tabs.context.new_page()
    sizes: list[int] = []

    def heard(answer: Any) -> None:
        if "/api/" not in answer.url:
            sizes.append(int(answer.headers.get("content-length", 0)))

    page.on("response", heard)
    page.goto(server.at(f"/results/{motion}"))
    expect(page.get_by_role("slider", name=TIME)).to_be_visible(timeout=90_000)
    assert len(sizes) < 90
    assert sum(sizes) < 330_000
