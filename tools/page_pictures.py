"""Take the pictures of a first visit to the page of `omocap serve`, wide and on a phone.

    python tools/page_pictures.py docs/pictures

A folder of `omocap simulate` is dropped, looked at, a sample of its motion is chosen, one contact is
corrected, and the motion is exported, in a real browser (Chromium) on a library that is thrown away.
"""

import io
import os
import re
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from pathlib import Path

from PIL import Image
from playwright.sync_api import Browser, Page, ViewportSize, expect, sync_playwright

SIZES = {"wide": (1440, 900), "phone": (390, 844)}
MOST_BYTES = 60_000
CHROMIUM = "/usr/bin/chromium"
OMOCAP = Path(sys.executable).with_name("omocap")
FLAGS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
LONG = 240_000
"""Milliseconds that anything of this may take."""

Shoot = Callable[[str], None]
"""Take the picture of a step, called so."""


def main(pictures: Path) -> None:
    """Go the way once for each size, and say how large the pictures are."""
    expect.set_options(timeout=LONG)
    with tempfile.TemporaryDirectory() as scratch, sync_playwright() as playwright:
        take = Path(scratch, "box-on-the-table")
        _omocap("simulate", "-o", take)
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        for name, size in SIZES.items():
            with _server(Path(scratch, name)) as url:
                _visit(browser, url, take, size, lambda step, n=name: _name(pictures, step, n))
        browser.close()


def _visit(
    browser: Browser, url: str, take: Path, size: tuple[int, int], path: Callable[[str], Path]
) -> None:
    viewport = ViewportSize(width=size[0], height=size[1])
    context = browser.new_context(
        viewport=viewport, reduced_motion="reduce", has_touch=size[0] < 500
    )
    page = context.new_page()
    page.set_default_timeout(LONG)

    def shoot(step: str) -> None:
        page.wait_for_timeout(1500)
        _save(page.screenshot(), path(step))

    page.goto(url)
    _drop(page, take, shoot)
    _make(page)
    _choose(page, shoot)
    _correct(page, shoot)
    _export(page, shoot)
    context.close()


def _drop(page: Page, take: Path, shoot: Shoot) -> None:
    """Drop the folder, and read what is said of it."""
    expect(page.locator(".drop").first).to_be_visible()
    shoot("1-drop")
    page.locator("input[webkitdirectory]").first.set_input_files(take)
    page.wait_for_url(re.compile(r"#/sessions/"))
    expect(page.locator(".verdict-words")).to_contain_text("This recording is")
    expect(page.locator(".take img:not(.none)")).to_be_visible()
    expect(page.locator(".stage-message p")).to_have_count(0)
    shoot("2-look")


def _make(page: Page) -> None:
    page.get_by_role("button", name="Make the motion").click()
    page.wait_for_url(re.compile(r"#/results/"))
    expect(page.get_by_role("slider", name="Time")).to_be_visible()


def _choose(page: Page, shoot: Shoot) -> None:
    """Choose a sample that is not the best one, and wait until it is finished."""
    page.get_by_label(re.compile(r"^\d$")).first.check()
    expect(page.get_by_text(re.compile(r"^Of sample \d\.$"))).to_be_attached()
    page.get_by_role("slider", name="Time").focus()
    for _ in range(4):
        page.keyboard.press("PageUp")
    page.evaluate("document.activeElement.blur()")
    shoot("3-sample")


def _correct(page: Page, shoot: Shoot) -> None:
    """Drag a hand over the object, and wait until the motion is solved again."""
    page.get_by_role("combobox", name="Camera", exact=True).select_option("hands")
    hand = page.get_by_role("button", name=re.compile("hand on the object")).first
    expect(hand).to_be_visible()
    page.wait_for_timeout(500)
    hand.focus()
    for _ in range(5):
        page.keyboard.press("ArrowDown")
        page.wait_for_timeout(300)
    expect(page.get_by_role("main").get_by_text("This is how they move")).to_be_visible()
    shoot("4-correct")
    page.get_by_role("button", name="Keep it as a new motion").click()
    page.wait_for_url(re.compile(r"#/jobs/"))
    page.wait_for_url(re.compile(r"#/results/"))


def _export(page: Page, shoot: Shoot) -> None:
    expect(page.get_by_role("slider", name="Time")).to_be_visible()
    page.get_by_role("button", name="Make the file").click()
    expect(page.get_by_role("status").get_by_role("link").first).to_be_visible()
    page.get_by_role("heading", name="Use it").scroll_into_view_if_needed()
    page.evaluate("document.querySelector('.card').scrollIntoView({block: 'center'})")
    shoot("5-export")


def _name(pictures: Path, step: str, size: str) -> Path:
    return pictures / f"visit-{step}-{size}.webp"


def _save(shot: bytes, path: Path) -> None:
    """Write a picture as small as it has to be."""
    picture = Image.open(io.BytesIO(shot)).convert("RGB")
    for quality in range(80, 10, -10):
        picture.save(path, quality=quality, method=6)
        if path.stat().st_size < MOST_BYTES:
            break
    print(f"{path.name}: {path.stat().st_size / 1000:.0f} kB")


def _omocap(*words: object) -> None:
    subprocess.run([OMOCAP, *map(str, words)], check=True)


@contextmanager
def _server(library: Path) -> Generator[str]:
    """The address of a server on this library."""
    told = library.with_name("told")
    words = ["serve", "--library", str(library), "--port", "8791", "--no-browser"]
    environment = {**os.environ, "PYTHONUNBUFFERED": "1"}
    with told.open("w") as out:
        process = subprocess.Popen([OMOCAP, *words], stdout=out, env=environment)
    try:
        until = time.monotonic() + 120
        while not (found := re.search(r"http://127\.0\.0\.1:\d+/", told.read_text())):
            if time.monotonic() > until:
                raise TimeoutError("the server did not start")
            time.sleep(0.2)
        yield found[0]
    finally:
        process.terminate()
        process.wait()


if __name__ == "__main__":
    main(Path(sys.argv[1]))
