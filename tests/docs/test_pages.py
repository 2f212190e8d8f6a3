"""Every shell block of the documentation runs as it stands, page by page."""

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.docs import inputs
from tests.docs.pages import blocks, pages
from tests.docs.running import Stage, run_page

PREPARED: dict[str, Callable[[inputs.Given], Stage]] = {
    "docs/batch.md": inputs.batch,
    "docs/blender.md": inputs.blender,
    "docs/calibration.md": inputs.calibration,
    "docs/comparing.md": inputs.comparing,
    "docs/data.md": inputs.data,
    "docs/evaluation.md": inputs.evaluation,
    "docs/format.md": inputs.corrected,
    "docs/garden-chair.md": inputs.garden_chair,
    "docs/hands.md": inputs.a_motion,
    "docs/recording.md": inputs.recording,
    "docs/replay.md": inputs.replay,
    "docs/scan.md": inputs.scan,
    "docs/serve.md": inputs.serve,
    "docs/training.md": inputs.training,
    "docs/unity.md": inputs.a_motion,
    "docs/unreal.md": inputs.unreal,
}
"""What puts the files that a page names into its folder."""
SLOW = ("docs/garden-chair.md",)
"""Pages with minutes of work, for `./run test --slow`."""


def _with_blocks() -> list[str]:
    return [page for page in pages() if any(b.shell and b.reason is None for b in blocks(page))]


def test_every_page_with_a_block_is_run():
    elsewhere = {"README.md"}
    assert set(_with_blocks()) - elsewhere == set(PREPARED)


def _marked(page: str) -> object:
    slow = (pytest.mark.slow, pytest.mark.timeout(900))
    return pytest.param(page, marks=slow) if page in SLOW else page


@pytest.mark.parametrize("page", [_marked(page) for page in sorted(PREPARED)])
def test_the_blocks_of_a_page_run_in_its_order(page: str, given: inputs.Given, preloaded: Path):
    run_page(page, given.place, PREPARED[page](given), preloaded)
