"""Draw a result: a still, a video from a camera that goes round, and samples side by side.

Usage: python examples/07_render.py [OUTPUT [WIDTH]]

Writes still.png, orbit.mp4 and samples.png into OUTPUT (example_output). WIDTH is that of the pictures in
pixels (640).
"""

import sys
from pathlib import Path

from capture_app import (
    CompareRequest,
    RenderRequest,
    RunRequest,
    compare_motions,
    render_result,
    run_take,
)
from capture_app.simulator.demo_take import DEMO, MESH, MOUNT, SESSION

out = Path(sys.argv[1] if len(sys.argv) > 1 else "example_output")
width = int(sys.argv[2]) if len(sys.argv) > 2 else 640
size = (width, width * 9 // 16 // 2 * 2)
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

# A still, five seconds into the motion, from where it is seen best.
render_result(RenderRequest(result=motion, output=out / "still.png", size=size, still=5.0))
print(f"Still: {out / 'still.png'}")

# All frames, from a camera that goes round the person; the ending may also be .webp or .gif.
render_result(
    RenderRequest(result=motion, output=out / "orbit.mp4", view="orbit", size=size),
    progress=lambda stage, done: print(f"{stage} {done:4.0%}", end="\r"),
)
print(f"Video: {out / 'orbit.mp4'}")

# Two samples, three moments of each, with what is measured of them.
comparison = compare_motions(
    CompareRequest(
        motions=(f"{motion}#1", f"{motion}#2"), output=out / "samples.png", size=size, sheet=3
    )
)
for contender in comparison.contenders:
    print(f"{contender.label}: {', '.join(f'{n.name} {n.value}' for n in contender.numbers)}")
