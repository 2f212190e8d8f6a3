"""The parser of blocks finds what is to be run, and no block hides from it."""

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

PAGE = """Text

```
omocap formats
```

*Not run by the tests: it asks questions.*
```sh
omocap calibrate
```

```text
a table
```
```
omocap worker
```
*Not run by the tests: it needs another machine.*
"""


def test_blocks_of_a_page():
    first, second, third, fourth = blocks("page.md", PAGE)
    assert (first.line, first.text, first.reason, first.shell) == (4, "omocap formats", None, True)
    assert (second.language, second.reason) == ("sh", "it asks questions.")
    assert not third.shell
    assert fourth.reason == "it needs another machine."


@pytest.mark.parametrize("page", pages())
def test_a_block_that_is_not_for_a_shell_holds_no_command(page: str):
    hidden = [block for block in blocks(page) if not block.shell and _OURS.search(block.text)]
    assert hidden == []


@pytest.mark.parametrize("page", pages())
def test_what_is_not_run_says_why(page: str):
    reasons = [block.reason for block in blocks(page) if block.reason is not None]
    assert [reason for reason in reasons if not any(word in reason for word in _ALLOWED)] == []
