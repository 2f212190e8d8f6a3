"""`omocap demo`: the main job on a recording that comes with the program."""

from pathlib import Path
from typing import Annotated

import typer

from capture_app.cli.summary import show_result


def demo(
    result: Annotated[Path, typer.Option("-o", "--output", help="Result folder to make.")] = Path(
        "out/demo"
    ),
) -> None:
    """Turn the recording that comes with the program into a motion, a GLB and a video.

    A simulated phone, clamped to a box, recorded how the box is lifted, carried and put down. The
    same as `omocap run` on that session; an earlier demo in the same place is replaced.
    """
    from capture_app.commands.run import RunRequest
    from capture_app.pipeline import motion_of_take
    from capture_app.simulator.demo_take import DEMO, MESH, MOUNT, SESSION

    request = RunRequest(
        session=DEMO / SESSION,
        object=DEMO / MESH,
        mount=DEMO / MOUNT,
        output=result,
        replace=True,
    )
    show_result(request, motion_of_take)
