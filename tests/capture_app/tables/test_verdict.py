"""What is said beneath the tables: whether the paper's ordering holds, and how surely."""

import numpy as np

from capture_app.tables.run_tables import with_verdicts
from capture_app.tables.table_rows import CORRECTED, PUBLISHED, tables_of
from omomo_core.learning.evaluation.evaluation_runner import Answer, Task


def answers(**f1: list[float]) -> list[Answer]:
    """Two windows of each of some clips, with the contact F1 of some methods."""
    rows: list[Answer] = []
    for name, values in f1.items():
        for k, value in enumerate(values):
            task = Task(
                name.replace("_", "-"), f"sub16_largetable_{k // 2:03d}@{60 * (k % 2)}", True
            )
            figures = {column.key: 1.0 for column in (*PUBLISHED, *CORRECTED)}
            figures |= {"contact_f1": value, "mpjpe_cm": 20 * (1 - value)}
            rows.append(Answer(task, "", "", one=figures, best=figures, mean=figures))
    return rows


def verdicts(**f1: list[float]) -> dict[int, list[str]]:
    rows = answers(**f1)
    return {t.number: with_verdicts(t, rows).verdicts for t in tables_of(rows, 20)}


def test_the_ordering_is_told_with_how_sure_it_is():
    spread = np.linspace(0, 0.1, 20)
    f1 = {"omomo": 0.8, "no_constraints": 0.6, "single_stage": 0.5, "goal": 0.3}
    sure = {name: list(level + spread) for name, level in f1.items()}
    told = verdicts(**sure)[2]
    assert "OMOMO > OMOMO w/o constraints > OMOMO-single-stage > GOAL" in told[0]
    assert told[0].endswith("holds in every step.")
    assert "F1 of OMOMO minus that of OMOMO w/o constraints: +0.20 (95 %" in told[1]
    assert told[1].endswith("to +0.20; surely).")
    assert told[4].startswith("F1 of OMOMO minus that of GOAL: +0.50 (95 %")
    assert "GOAL, in the mean of all samples, first frame given, holds in every step." in told[5]
    wrong = verdicts(**{**sure, "omomo": list(0.4 + spread)})[2]
    assert wrong[0].endswith("does not hold: 1 of 3 steps do not go this way.")
    lucky = [*(0.6 + spread[:18]), 0.9, 0.9]
    unsure = verdicts(omomo=lucky, no_constraints=sure["no_constraints"])[2]
    assert unsure[0].endswith("1 of 1 steps may be chance.")
    assert "perhaps by chance" in unsure[1]


def test_true_palms_are_compared_by_f1_and_by_pose():
    spread = np.linspace(0, 0.1, 20)
    better = verdicts(omomo=list(0.6 + spread), gt_hands=list(0.8 + spread))[4]
    assert better[0] == "The paper's claim that true palms give better people holds."
    assert "F1 of OMOMO, true hands minus that of OMOMO: +0.20" in better[1]
    assert "MPJPE of OMOMO minus that of OMOMO, true hands: +4.0" in better[2]
    worse = verdicts(omomo=list(0.8 + spread), gt_hands=list(0.6 + spread))[4]
    assert worse[0].endswith("does not hold.")
