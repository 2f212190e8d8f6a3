"""Pages can be read and found: README is short, lines are short, and the index leads to every page."""

import re
from pathlib import Path

import pytest

from tests.conftest import REPO
from tests.docs.pages import markdown, text_of

_LONGEST = 120
_LINK = re.compile(r"\]\(([\w\-]+\.md)[)#]")


def long_lines(text: str) -> list[int]:
    """Numbers of the lines that are too long, from 1; rows of tables may be."""
    lines = enumerate(text.splitlines(), start=1)
    return [number for number, line in lines if len(line) > _LONGEST and not line.startswith("|")]


def test_the_readme_is_short():
    assert len(text_of("README.md").splitlines()) <= 80


@pytest.mark.parametrize("page", markdown())
def test_lines_of_a_page_are_short(page: str):
    assert long_lines(text_of(page)) == []


def test_the_index_leads_to_every_page():
    there = {path.name for path in Path(REPO / "docs").glob("*.md")} - {"index.md"}
    assert there - set(_LINK.findall(text_of("docs/index.md"))) == set()
