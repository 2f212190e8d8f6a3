"""Mutation check: do the tests notice small errors in the core maths? Needs `pip install cosmic-ray`.

    python tools/mutation_check.py --count 60 --seed 0 [--room contact] [--json FILE]

In a copy of the last commit one number, comparison, sign or condition at a time is changed by cosmic-ray,
and the tests of that room are run. A random sample of all such changes is tried, the same for the same
seed. Prints the share that some test noticed, and the survivors as diffs; docs/testing.md states the rate
and which survivors change no result.
"""

import argparse
import json
import random
import subprocess
import sys
import tempfile
from collections import Counter
from dataclasses import asdict, dataclass
from pathlib import Path

from cosmic_ray.work_db import use_db
from cosmic_ray.work_item import TestOutcome, WorkerOutcome, WorkResult

REPO = Path(__file__).resolve().parent.parent
ROOMS = {
    "contact": (
        "omomo_core/contact",
        "tests/core/contact tests/core/test_generation_plausibility.py tests/core/test_generation_resting.py",
    ),
    "generation": ("omomo_core/generation", "tests/core/test_generation*.py"),
    "diffusion": (
        "omomo_core/diffusion",
        "tests/core/test_diffusion.py tests/core/test_training.py",
    ),
    "trajectory": (
        "ingest/trajectory",
        "tests/ingest/test_floor.py tests/ingest/test_trajectory.py tests/ingest/test_gravity.py "
        "tests/ingest/test_closure.py tests/ingest/test_stitch.py tests/ingest/test_smooth.py "
        "tests/ingest/test_camera_axes.py tests/ingest/test_semantic_faults.py",
    ),
    "hand_eye": ("ingest/calibration/hand_eye", "tests/ingest/calibration/hand_eye"),
}
"""Package, and the tests that guard it."""
_CHANGED = (
    "core/NumberReplacer",
    "core/AddNot",
    "core/ReplaceAndWithOr",
    "core/ReplaceOrWithAnd",
    "core/ReplaceTrueWithFalse",
    "core/ReplaceFalseWithTrue",
    "core/ReplaceUnaryOperator_USub_UAdd",
    "core/ReplaceBinaryOperator_Add_Sub",
    "core/ReplaceBinaryOperator_Sub_Add",
    "core/ReplaceBinaryOperator_Mul_Div",
    "core/ReplaceBinaryOperator_Div_Mul",
    "core/ReplaceComparisonOperator_Lt_Gt",
    "core/ReplaceComparisonOperator_Lt_LtE",
    "core/ReplaceComparisonOperator_Gt_Lt",
    "core/ReplaceComparisonOperator_Gt_GtE",
    "core/ReplaceComparisonOperator_LtE_Lt",
    "core/ReplaceComparisonOperator_GtE_Gt",
    "core/ReplaceComparisonOperator_Eq_NotEq",
)
"""What is tried; others mutate type hints, or break at import."""
_SECONDS = 600


@dataclass(frozen=True)
class Mutant:
    """One change and whether a test noticed it."""

    room: str
    module: str
    line: int
    operator: str
    survived: bool
    diff: str


def check(room: str, count: int, seed: int, copy: Path) -> list[Mutant]:
    """Try a random sample of the changes of a room, in a copy of the repository."""
    package, tests = ROOMS[room]
    config, session = copy / f"{room}.toml", copy / f"{room}.sqlite"
    command = (
        f"env PYTHONPATH={copy} OMP_NUM_THREADS=1 {sys.executable} -m pytest -q -x -n0 "
        f"-p no:cacheprovider {tests}"
    )
    config.write_text(
        f'[cosmic-ray]\nmodule-path = "{package}"\ntimeout = {_SECONDS}.0\nexcluded-modules = []\n'
        f'test-command = "bash -c \\"{command}\\""\n[cosmic-ray.distributor]\nname = "local"\n'
    )
    tool = Path(sys.executable).parent / "cosmic-ray"
    subprocess.run([tool, "init", config, session], cwd=copy, check=True)
    with use_db(str(session)) as db:
        items = sorted(db.pending_work_items, key=lambda item: item.job_id)
        wanted = [i for i in items if i.mutations[0].operator_name in _CHANGED]
        wanted.sort(key=lambda i: (str(i.mutations[0].module_path), i.mutations[0].start_pos,
                                   i.mutations[0].operator_name, i.mutations[0].occurrence))  # fmt: skip
        chosen = {i.job_id for i in random.Random(seed).sample(wanted, min(count, len(wanted)))}
        for item in items:
            if item.job_id not in chosen:
                db.set_result(item.job_id, WorkResult(WorkerOutcome.SKIPPED))
        print(f"{room}: {len(chosen)} of {len(wanted)} changes", flush=True)
    subprocess.run([tool, "exec", config, session], cwd=copy, check=True)
    with use_db(str(session)) as db:
        specs = {i.job_id: i.mutations[0] for i in db.work_items}
        return [
            Mutant(
                room,
                str(specs[job].module_path),
                specs[job].start_pos[0],
                specs[job].operator_name.removeprefix("core/"),
                result.test_outcome == TestOutcome.SURVIVED,
                result.diff or "",
            )
            for job, result in db.results
            if job in chosen
        ]


def _copied(folder: Path) -> None:
    """The last commit, so that the working tree is left alone."""
    archive = subprocess.run(
        ["git", "-C", REPO, "archive", "HEAD"], capture_output=True, check=True
    ).stdout
    subprocess.run(["tar", "-x", "-C", folder], input=archive, check=True)


def main() -> None:
    """Try, count and print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--room", choices=ROOMS, action="append")
    parser.add_argument("--count", type=int, default=60, help="changes tried in each room")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--json", type=Path, help="also write all that was tried")
    given = parser.parse_args()
    tried: list[Mutant] = []
    with tempfile.TemporaryDirectory() as folder:
        _copied(Path(folder))
        for room in given.room or ROOMS:
            tried += check(room, given.count, given.seed, Path(folder))
            if given.json:
                given.json.write_text(json.dumps([asdict(m) for m in tried], indent=1))
            of_room = Counter(m.survived for m in tried if m.room == room)
            print(f"{room}: {of_room[False]} of {of_room.total()} noticed", flush=True)
    for mutant in (m for m in tried if m.survived):
        print(f"\nsurvived: {mutant.module}:{mutant.line} {mutant.operator}\n{mutant.diff}")


if __name__ == "__main__":
    main()
