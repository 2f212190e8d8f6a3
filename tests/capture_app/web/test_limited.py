"""Work on hostile input ends: in its result, its error, or its child's death."""

import asyncio
import os
import time
from pathlib import Path
from typing import Any

import pytest

from capture_app.web.sandbox_process import ProcessLimits, SandboxPool, in_child
from omomo_core.errors import InputError
from tests.capture_app.web import chores
from tests.conftest import REPO

MIB = 2**20


@pytest.fixture(autouse=True)
def _children_find_the_chores(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(REPO)


def call(work, *given, tmp_path: Path, **bounds) -> dict[str, Any]:
    return in_child(work, *given, scratch=tmp_path, bounds=ProcessLimits(**bounds))


def test_a_result_comes_from_another_process(tmp_path: Path):
    found = call(chores.well, 21, tmp_path=tmp_path)
    assert found["twice"] == 42
    assert found["pid"] != os.getpid()


def test_an_error_comes_as_it_is(tmp_path: Path):
    with pytest.raises(InputError, match="It is wrong") as caught:
        call(chores.refuses, tmp_path=tmp_path)
    assert (caught.value.code, caught.value.where, caught.value.fix) == (
        "some-code",
        "here",
        "Mend it.",
    )


@pytest.mark.parametrize(
    ("work", "code"),
    [
        (chores.breaks, "not-read"),
        (chores.fills_the_disk, "disk-full"),
        (chores.dies, "too-much"),
        (chores.devours, "too-much"),
    ],
)
def test_a_child_may_break_or_die(tmp_path: Path, work, code: str):
    with pytest.raises(InputError) as caught:
        call(work, tmp_path=tmp_path, memory=500 * MIB)
    assert caught.value.code == code
    assert "secret" not in str(caught.value)


@pytest.mark.parametrize("work", [chores.sleeps, chores.spins])
def test_no_child_is_waited_for_for_ever(tmp_path: Path, work):
    call(chores.well, 1, tmp_path=tmp_path)
    begun = time.monotonic()
    with pytest.raises(InputError) as caught:
        call(work, tmp_path=tmp_path, seconds=1.0)
    assert caught.value.code == "too-slow"
    assert time.monotonic() - begun < 20


def test_no_child_fills_the_disk(tmp_path: Path):
    with pytest.raises(InputError):
        call(chores.fills, tmp_path / "big", tmp_path=tmp_path, written=MIB)
    assert (tmp_path / "big").stat().st_size <= MIB


def test_the_same_work_is_done_once_for_all_who_ask_for_it_at_once(tmp_path: Path):
    sandbox = SandboxPool(tmp_path)

    async def ask() -> None:
        await asyncio.gather(*(sandbox.run(chores.counts, tmp_path / "marks") for _ in range(5)))

    asyncio.run(ask())
    sandbox.close()
    assert (tmp_path / "marks").read_text() == "x"
