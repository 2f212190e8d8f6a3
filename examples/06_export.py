"""Write a motion for other programs: GLB, BVH, USD and CSV.

Usage: python examples/06_export.py [OUTPUT]

Writes take.glb, take.bvh with take_object.bvh, take.usdc (if usd-core is installed) and take.csv into
OUTPUT (example_output).
"""

import sys
from pathlib import Path

from capture_app import ExportRequest, InputError, RunRequest, export_result, run_take
from capture_app.simulator.demo_take import DEMO, MESH, MOUNT, SESSION

out = Path(sys.argv[1] if len(sys.argv) > 1 else "example_output")
motion = out / "motion"
if not motion.exists():
    run_take(
        RunRequest(
            session=DEMO / SESSION,
            object=DEMO / MESH,
            mount=DEMO / MOUNT,
            output=motion,
            video_size=None,
        )
    )

# The ending says the format; axes and units are those that its readers expect.
export_result(ExportRequest(result=motion, output=out / "take.glb"))
export_result(ExportRequest(result=motion, output=out / "take.csv"))

# Options say more: a second sample, frames a second, axes, units.
bvh = ExportRequest(result=motion, output=out / "take.bvh", sample=2, fps=60, up="y", units="cm")
for path in export_result(bvh).files:
    print(f"BVH at 60 fps: {path}")

try:
    export_result(ExportRequest(result=motion, output=out / "take.usdc", fps=24))
except InputError as problem:
    print(f"No USD: {problem}")

for path in sorted(out.glob("take*")):
    print(f"{path}: {path.stat().st_size / 1e3:.0f} kB")
