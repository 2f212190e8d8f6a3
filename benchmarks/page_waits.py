"""Seconds from a click on the page until a motion is there in 3D: made, and solved again.

Each turn is a server of its own with a library of its own, by this checkout and by another one if it is
given, in turns, so that the machine's load falls on both alike. A browser without a window clicks through
the example of twelve seconds, then moves the end of a contact when the video is drawn. Printed are the
medians: until the motion is made; until it is seen with the corrected contact (which a page that solves by
itself shows after a short wait, and an older one after a click on "Solve again"); and until it is kept as
a motion of its own.

Usage: python -m benchmarks.page_waits [--other CHECKOUT] [--turns 3]
"""

import argparse
import os
import re
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from playwright.sync_api import Page, sync_playwright

HERE = Path(__file__).parent.parent
CHROMIUM = "/usr/bin/chromium"
_START = "from capture_app.cli.start import main; main()"
_STARTED = 12.0
"""Seconds that whoever starts the server takes to reach the button."""
_LONG = 120_000
"""Milliseconds."""


@dataclass(frozen=True)
class PageWait:
    """Seconds after a click."""

    result: float
    """Until the page of the result opens."""
    seen: float
    """Until the motion is there in 3D."""


@contextmanager
def server(checkout: Path, library: Path) -> Generator[str]:
    """A server of a checkout; its address."""
    environment = {**os.environ, "PYTHONPATH": str(checkout), "OMP_WAIT_POLICY": "PASSIVE"}
    words = ["serve", "--library", str(library), "--no-browser", "--port", "8900"]
    process = subprocess.Popen(
        [sys.executable, "-P", "-u", "-c", _START, *words],
        cwd=checkout,
        env=environment,
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert process.stdout is not None
        said = (re.search(r"http://\S+", line) for line in process.stdout)
        yield next(found[0] for found in said if found)
    finally:
        process.terminate()
        process.wait()


def clicked(page: Page, button: str) -> PageWait:
    """Click a button that makes a motion, and wait until that is seen."""
    page.get_by_role("button", name=button, disabled=False).wait_for(timeout=_LONG)
    begin = time.perf_counter()
    page.get_by_role("button", name=button).click()
    page.wait_for_url("**#/jobs/**", timeout=_LONG)
    page.wait_for_url("**#/results/**", timeout=_LONG)
    result = time.perf_counter() - begin
    page.get_by_text("Left hand").first.wait_for(timeout=_LONG)
    return PageWait(result, time.perf_counter() - begin)


def waits_of(checkout: Path) -> tuple[PageWait, PageWait, PageWait]:
    """Make the example's motion, correct a contact, and keep the corrected motion."""
    with (
        tempfile.TemporaryDirectory() as library,
        server(checkout, Path(library)) as url,
        sync_playwright() as playwright,
    ):
        time.sleep(_STARTED)
        flags = ["--no-sandbox", "--use-gl=swiftshader", "--enable-unsafe-swiftshader"]
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=flags)
        page = browser.new_page(viewport={"width": 1440, "height": 900})
        page.goto(url)
        page.get_by_role("button", name="Try the example").click()
        made = clicked(page, "Make the motion")
        page.locator("video.film").wait_for(timeout=_LONG)
        page.get_by_role("button", name="Correct the contacts").click()
        page.get_by_role("slider", name=re.compile("hand contact 1, stop")).first.focus()
        begin = time.perf_counter()
        page.keyboard.press("PageDown")
        keep = page.get_by_role("button", name="Keep it as a new motion")
        if keep.count():
            page.get_by_text("This is how they move").first.wait_for(timeout=_LONG)
            shown = PageWait(*[time.perf_counter() - begin] * 2)
            kept = clicked(page, "Keep it as a new motion")
        else:
            shown = kept = clicked(page, "Solve again")
        browser.close()
    return made, shown, kept


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--other", type=Path, help="another checkout of the project")
    parser.add_argument("--turns", type=int, default=3)
    options = parser.parse_args()
    checkouts = {"this checkout": HERE}
    if options.other:
        checkouts["the other"] = options.other.resolve()
    waits: dict[str, list[tuple[PageWait, ...]]] = {name: [] for name in checkouts}
    for _ in range(options.turns):
        for name, checkout in checkouts.items():
            waits[name].append(waits_of(checkout))
    for name, turns in waits.items():
        for what, each in zip(("made", "corrected", "kept"), zip(*turns, strict=True), strict=True):
            result, seen = (
                statistics.median(values)
                for values in zip(*((w.result, w.seen) for w in each), strict=True)
            )
            print(f"{name:14} {what:13} result after {result:4.1f} s, in 3D after {seen:4.1f} s")


if __name__ == "__main__":
    main()
