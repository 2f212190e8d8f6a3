"""Every command of ours that a page names exists, and so does every option it is given."""

import re
from typing import Any

import pytest

from tests.commands import commands
from tests.docs.pages import blocks, command_lines, pages, prose, spans

_COMMANDS = commands()
_GROUPS = {words.rsplit(" ", 1)[0] for words in _COMMANDS if " " in words}
_EVERYWHERE = {"--help", "-h", "--debug", "--version"}
_OPTION = re.compile(r"(?<![\w-])(--?[a-z][\w-]*)")


def wrong(words: list[str]) -> str | None:
    """What is wrong with the words of a command, or None."""
    if not words or words[0] in ("COMMAND", *_EVERYWHERE):
        return None
    name = _name(words)
    if name is None:
        return f"no command: {' '.join(words[:2])}"
    known = _EVERYWHERE | (_options(_COMMANDS[name]) if name in _COMMANDS else set())
    given = {option for word in words if word.startswith("-") for option in _OPTION.findall(word)}
    unknown = sorted(given - known)
    return f"no option of {name}: {' '.join(unknown)}" if unknown else None


def _name(words: list[str]) -> str | None:
    two = " ".join(words[:2])
    if two in _COMMANDS:
        return two
    return words[0] if words[0] in _COMMANDS or words[0] in _GROUPS else None


def _options(command: Any) -> set[str]:
    return {name for item in command.params for name in (*item.opts, *item.secondary_opts)}


def test_a_wrong_command_is_found():
    assert wrong(["runs", "take"]) == "no command: runs take"
    assert wrong(["run", "take", "--objekt", "a.obj"]) == "no option of run: --objekt"
    assert wrong(["run", "take", "--object", "a.obj", "--stood", "0.8,-1.2"]) is None
    assert wrong(["calibrate", "nowhere", "--nothing"]) is not None


@pytest.mark.parametrize("page", pages())
def test_commands_and_options_that_a_page_names_exist(page: str):
    named = [span for span in spans(prose(page)) if span.startswith(("omocap ", "./run "))]
    texts = [*named, *(block.text for block in blocks(page) if block.shell)]
    faults = [fault for text in texts for words in command_lines(text) if (fault := wrong(words))]
    assert faults == []
