"""No block of a page hides from the tests: what is not run says why."""

import re

import pytest

from tests.docs.pages import blocks, pages

_OURS = re.compile(r"^\s*(omocap|\./run|blender|python|torchrun|curl) ", re.MULTILINE)
_ALLOWED = (
    "another program",
    "another machine",
    "hours of training",
    "questions",
    "third-party data",
    "./run test --slow",
)


@pytest.mark.parametrize("page", pages())
def test_a_block_that_is_not_for_a_shell_holds_no_command(page: str):
    hidden = [block for block in blocks(page) if not block.shell and _OURS.search(block.text)]
    assert hidden == []


@pytest.mark.parametrize("page", pages())
def test_what_is_not_run_says_why(page: str):
    reasons = [block.reason for block in blocks(page) if block.reason is not None]
    assert [reason for reason in reasons if not any(word in reason for word in _ALLOWED)] == []
