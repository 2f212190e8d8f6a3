"""A few damaged files of every kind, the same in each run; many by `python -m tests.fuzz_files`."""

import random
from pathlib import Path

import pytest

from tests.fuzz_files import KINDS, run_case

FORMER = {"film to overlay": (25, 34, 57), "OBJ": (62,), "camera": (71,)}
"""Cases of seed 1 that broke something once."""


@pytest.mark.parametrize("name", KINDS)
def test_damaged_files_are_read_or_refused(tmp_path: Path, name: str):
    KINDS[name].make(tmp_path)
    for k in (*range(4), *FORMER.get(name, ())):
        outcome = run_case(KINDS[name], tmp_path, random.Random(f"1 {name} {k}"))
        assert outcome.what in ("read", "refused"), f"case {k}: {outcome.what}"
