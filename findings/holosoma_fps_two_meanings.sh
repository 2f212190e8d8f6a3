#!/usr/bin/env bash
# Expected: what a retargeter writes is read by the converter of the same package, at the rate that it states.
# Happens: holosoma-retargeting 0.1.0 writes `fps` as frames a second, and its converter to simulators takes it for
#   seconds a frame: a file of 30 frames a second ends in a division by zero, and one that states 1/30 is read.
# Source: the package's `src/interaction_mesh_retargeter.py` (`np.savez(..., fps=...)`) and
#   `data_conversion/convert_data_format_mj.py` (`MotionLoader`), as PyPI has them.
# Matters here: `omocap export --to robot` writes such a file with `fps` as its player and its retargeter have it;
#   docs/robots.md says what to do for the converter.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet holosoma-retargeting==0.1.0
cd "$folder"
"$folder/venv/bin/python" - <<'PY'
import sys
from importlib.metadata import version
import numpy as np, torch
from holosoma_retargeting.data_conversion.convert_data_format_mj import MotionLoader

qpos = np.zeros((60, 36))
qpos[:, 2], qpos[:, 3] = 0.8, 1.0

def read(**stated):
    np.savez("motion.npz", qpos=qpos, **stated)
    try:
        made = MotionLoader("motion.npz", 30, 50, torch.device("cpu"), None, False, False)
        return f"{made.duration:.2f} s"
    except ZeroDivisionError as error:
        return f"ZeroDivisionError: {error}"

print("holosoma-retargeting", version("holosoma-retargeting"))
answers = {"30 frames a second": read(fps=30), "1/30": read(fps=1 / 30), "nothing": read()}
for stated, answer in answers.items():
    print(f"fps = {stated}: {answer}")
as_known = answers["30 frames a second"].startswith("Zero") and answers["1/30"] == answers["nothing"] == "1.97 s"
sys.exit(0 if as_known else "the behaviour has changed")
PY
