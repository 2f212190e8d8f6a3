"""A first visit by the keyboard alone: bring a folder, look, choose a sample, correct a contact, export."""

import re
import shutil
from pathlib import Path

import pytest
from playwright.sync_api import expect

from tests.capture_app.page.conftest import DEMO

NAME = """() => {
    const one = document.activeElement;
    return (one.ariaLabel ?? (one.labels?.[0] ?? one).textContent ?? "").trim();
}"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """What `omocap simulate` writes."""
    folder = tmp_path / "A box moved"
    shutil.copytree(DEMO / "session", folder / "session")
    for name in ("box.obj", "mount.json"):
        shutil.copy(DEMO / name, folder)
    return folder


def _to(page, name: str, key: str = "Tab") -> None:
    """Go on by a key until what has this name has the focus."""
    for _ in range(90):
        page.keyboard.press(key)
        if re.search(name, page.evaluate(NAME)):
            return
    raise AssertionError(f"the keyboard does not reach {name}")


def _typed(page, name: str, text: str) -> None:
    _to(page, name)
    page.keyboard.press("Control+a")
    page.keyboard.type(text)


def _ordered(page, of: str) -> None:
    page.keyboard.press("Enter")
    page.wait_for_url(re.compile("#/jobs/"))
    page.wait_for_url(re.compile(of), timeout=120_000)
    expect(page.get_by_role("slider", name="Time")).to_be_visible(timeout=90_000)


def _move(page) -> None:
    """Move the hand on the object, whichever way there is room."""
    for key in ("ArrowDown", "ArrowUp", "ArrowRight", "ArrowLeft"):
        page.keyboard.press(key)
        if page.evaluate(
            "Object.keys(localStorage).some((name) => name.startsWith('contacts of'))"
        ):
            return
        page.wait_for_timeout(200)
    raise AssertionError("the hand does not move")


def test_a_first_visit_by_keyboard_alone(tabs, server, folder: Path) -> None:
    page = tabs.open(server.url)
    expect(page.locator(".drop").first).to_be_visible()
    _to(page, "^Choose a folder$")
    with page.expect_file_chooser() as chooser:
        page.keyboard.press("Space")
    chooser.value.set_files(folder)
    expect(page.get_by_text("This recording is good")).to_be_visible(timeout=90_000)
    expect(page.get_by_role("heading", level=1)).to_have_text("A box moved")
    _typed(page, "^Samples$", "2")
    _to(page, "^More options$")
    page.keyboard.press("Enter")
    _typed(page, "^Steps of the sampler$", "2")
    _to(page, "^Draw a video$")
    page.keyboard.press("Space")
    _to(page, "^Make the motion$")
    _ordered(page, "#/results/")
    motion = page.url[-16:]
    other = 2 - server.ask(f"results/{motion}")["chosen"]
    _to(page, r"^[12]( \(best\))?$")
    page.keyboard.press("ArrowDown" if other == 2 else "ArrowUp")
    expect(page.get_by_text(f"Of sample {other}.", exact=True)).to_be_visible(timeout=60_000)
    _to(page, "^Time$")
    for _ in range(4):
        page.keyboard.press("PageUp")
    _to(page, "hand on the object", "Shift+Tab")
    _move(page)
    said = page.get_by_role("main").get_by_text("This is how they move with these contacts.")
    expect(said).to_be_visible(timeout=60_000)
    _to(page, "^Keep it as a new motion$")
    _ordered(page, f"#/results/(?!{motion})")
    assert server.ask(f"results/{page.url[-16:]}")["manifest"]["correction"]["sample"] == other - 1
    _to(page, "^Make the file$")
    page.keyboard.press("Enter")
    expect(page.get_by_role("status").get_by_role("link").first).to_be_visible(timeout=120_000)
    _to(page, r"\.glb$")
    with page.expect_download() as taken:
        page.keyboard.press("Enter")
    assert taken.value.path().read_bytes()[:4] == b"glTF"
