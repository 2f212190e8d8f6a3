"""Train the networks on your own clips, going on from the weights that ship, and run a take with them.

Usage: python examples/09_train.py [OUTPUT [STEPS]]

Writes OUTPUT/clips.npz (here from generated motions; yours come from recordings, see docs/training.md),
the weights OUTPUT/networks and the result folder OUTPUT/trained (in example_output). STEPS (20) is far
too few for anything but to show the way.
"""

import sys
from pathlib import Path

from capture_app import Clip, RunRequest, TrainRequest, load_result, run_take, save_clips, train
from capture_app.simulator.demo_take import DEMO, MESH, MOUNT, SESSION

out = Path(sys.argv[1] if len(sys.argv) > 1 else "example_output")
steps = int(sys.argv[2]) if len(sys.argv) > 2 else 20
request = RunRequest(
    session=DEMO / SESSION,
    object=DEMO / MESH,
    mount=DEMO / MOUNT,
    output=out / "motion",
    video_size=None,
)
if not request.output.exists():
    run_take(request)

# A clip is a person on our skeleton at 30 fps, and the object that they moved.
result = load_result(request.output)
clips = [
    Clip(
        name=f"box {number}",
        source="example",
        licence="CC0",
        root=human.root,
        rotations=human.rotations,
        hand_contact=human.hand_contact,
        foot_contact=human.foot_contact,
        object_motion=result.object_motion,
    )
    for number, human in enumerate(result.motions)
]
data, networks = out / "clips.npz", out / "networks"
save_clips(data, clips)

# The same request goes on where it was stopped. Its folder holds hands.safetensors and body.safetensors.
train(
    TrainRequest(
        method="capture",
        data=(data,),
        output=networks,
        start_from=Path("shipped"),
        steps=steps,
        batch=4,
        rate=1e-4,
    )
)

again = {"output": out / "trained", "weights": networks, "replace": True}
trained = run_take(request.model_copy(update=again))
print(f"A motion of {len(trained.best.root)} frames by the trained networks: {trained.folder}")
