"""A worker that knows the stand-in, and is quick to miss its fellows."""

import os
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from stand_in import KIND

from capture_app.jobs import __main__ as process
from capture_app.jobs.job_kinds import KINDS
from capture_app.jobs.worker import Tempo, work

TEMPO = Tempo(
    report=0.05,
    beat=0.2,
    silence=float(os.environ.get("SILENCE", "1.5")),
    sweep=0.3,
    cancel_within=0.5,
)


def quick(url: str, **_: object) -> None:
    work(url, tempo=TEMPO, kinds={**KINDS, "stand-in": KIND})


process.work = quick
sys.exit(process.main())
