"""Benchmarks are no tests, but they must start: each is loaded, and those of hands measure the demo."""

import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks import hand_cost, hands

NAMES = sorted(path.stem for path in Path(hands.__file__).parent.glob("*.py"))


def test_benchmarks_can_be_loaded() -> None:
    """In a process of their own, as they are run."""
    code = "".join(f"import benchmarks.{name}\n" for name in NAMES if name != "__init__")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr


def test_hands_of_the_demo_are_measured(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    words = ["hands", "--only", "demo", "--pictures", str(tmp_path)]
    monkeypatch.setattr(sys, "argv", words)
    hands.main()
    head, demo, *_ = capsys.readouterr().out.splitlines()
    assert head.split()[0] == "object"
    finger, deepest = (float(word) for word in demo.split()[1:3])
    assert finger <= 2 <= deepest <= 8
    assert (tmp_path / "demo.png").exists()


def test_what_hands_of_the_demo_cost_is_measured() -> None:
    spent, whole = hand_cost.cost(None)
    assert 0 < spent < 0.5 * whole
