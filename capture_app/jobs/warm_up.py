"""What a worker does before its first job, so that nobody waits for it later."""

from pathlib import Path


def warm_up() -> None:
    """Load what makes a motion, and make the example's in one step; nothing is written.

    Libraries and networks take longer to load than a short take to generate, and all of them are slower
    the first time.
    """
    from capture_app.commands.run import RunRequest
    from capture_app.pipeline import prepare_take
    from capture_app.posters import person_picture
    from capture_app.simulator.record import DEMO, MESH, MOUNT, SESSION
    from omomo_core.generation.generator import generate

    example = RunRequest(
        session=DEMO / SESSION,
        object=DEMO / MESH,
        mount=DEMO / MOUNT,
        samples=1,
        steps=1,
        output=Path("nowhere"),
    )
    take = prepare_take(example)
    made = generate(take.motion, take.body, take.stages, example.generation)
    person_picture(made.people[made.chosen], take.motion, take.body)
