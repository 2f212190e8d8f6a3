"""A headless Chromium without a network, and pages of replay in it."""

from collections.abc import Callable, Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser, Page, expect, sync_playwright

from capture_app.replay.share import share_page
from tests.capture_app.replay.made import make_result, pack_of

CHROMIUM = Path("/usr/bin/chromium")
_FLAGS = [
    "--no-sandbox",
    "--disable-background-networking",
    "--disable-component-update",
    "--use-angle=gl-egl",  # Mesa draws several times faster than the browser's own software
    "--ignore-gpu-blocklist",
]

OpenPage = Callable[..., Page]


# Playwright runs an event loop while it lives: other files could not have one of their own.
@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    if not CHROMIUM.is_file():
        pytest.skip("Debian's chromium is not installed")
    with sync_playwright() as playwright:
        running = playwright.chromium.launch(executable_path=str(CHROMIUM), args=_FLAGS)
        yield running
        running.close()


@pytest.fixture(scope="session")
def packs(tmp_path_factory: pytest.TempPathFactory) -> tuple[bytes, bytes]:
    """Scene packs of two results."""
    folder = tmp_path_factory.mktemp("results")
    return pack_of(folder / "carry"), pack_of(folder / "again")


@pytest.fixture(scope="session")
def made(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """The result that both packs show."""
    return make_result(tmp_path_factory.mktemp("result"))


@pytest.fixture
def open_page(browser: Browser, tmp_path: Path) -> Iterator[OpenPage]:
    """Opens scene packs as a shared file; in the end no script has failed and nothing was fetched."""
    faults: list[str] = []
    pages: list[Page] = []

    def opened(*packs: bytes, still: bool = True, **context: Any) -> Page:
        file = tmp_path / "shared.html"
        file.write_text(share_page(packs, "Shared"), encoding="utf-8")
        motion = "reduce" if still else "no-preference"
        size = {"width": 640, "height": 600}
        room = browser.new_context(
            offline=True, reduced_motion=motion, **{"viewport": size, **context}
        )
        page = room.new_page()
        pages.append(page)
        page.on("pageerror", lambda error: faults.append(f"{error}"))
        page.on("console", lambda told: faults.append(told.text) if told.type == "error" else None)
        page.on("request", lambda asked: faults.append(asked.url) if _outside(asked.url) else None)
        page.goto(file.as_uri())
        expect(page.locator("#wait")).not_to_have_text("Loading.")
        return page

    yield opened
    for page in pages:
        page.context.close()
    assert faults == []


def _outside(url: str) -> bool:
    return not url.startswith(("file:", "blob:"))


def canvas_of(page: Page) -> np.ndarray:
    """What the canvas shows, as numbers (height, width, 3)."""
    page.evaluate("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
    data = page.locator("#view").screenshot()
    return np.asarray(Image.open(BytesIO(data)).convert("RGB")).astype(float)
