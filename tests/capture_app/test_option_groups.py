"""The help of the command line: options in groups, what most people need first."""

from collections import defaultdict
from typing import Any

import pytest

from capture_app.commands.inputs import OptionGroup
from capture_app.commands.run import RunRequest
from omomo_core.generation.generation_options import GenerationOptions
from tests.commands import commands


def panels(name: str) -> dict[str, list[str]]:
    """The options of a command, by the group in which its help lists them."""
    found: dict[str, list[str]] = defaultdict(list)
    for parameter in commands()[name].params:
        option: Any = parameter
        if option.opts[0].startswith("--") or len(option.opts) > 1:
            found[option.rich_help_panel or OptionGroup.MAIN].append(max(option.opts, key=len))
    return found


@pytest.mark.parametrize("name", ["run", "batch"])
def test_the_first_group_is_short_and_every_option_has_one(name: str):
    found = panels(name)
    assert set(found) <= set(OptionGroup)
    first = found[OptionGroup.MAIN]
    assert first == ["--output", "--object", "--mount", "--samples", "--height", "--stood"]
    assert all(len(options) < 10 for options in found.values())
    assert sum(map(len, found.values())) >= 24


@pytest.mark.parametrize("name", ["inspect", "replay"])
def test_commands_share_the_groups(name: str):
    reading = panels(name)[OptionGroup.READING]
    assert set(reading) <= set(panels("run")[OptionGroup.READING])
    assert "--up" in reading


def test_commands_take_as_many_steps_as_the_generator():
    steps = RunRequest.model_fields["steps"].default
    assert steps == GenerationOptions.steps
    options = {option.name: option for option in commands()["evaluate"].params}
    assert options["steps"].default == steps
