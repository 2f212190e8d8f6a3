"""`omocap run`: a phone session with mesh and mount, or an animated object, becomes a motion."""

from capture_app.cli import options as given
from capture_app.cli.console import progress_bars
from capture_app.cli.summary import summarise
from capture_app.coordinates import read_place, read_up

HELP = """Make the motion of the person who moved the object.

Writes a folder with *motion.glb* (the animated person and object, for Blender, Unity, Unreal),
*motion.mp4*, *motion.npz* (the numbers), *contacts.json* (which hand holds when and where, to be
corrected with `omocap resolve`) and *manifest.json* (how it was made).

Example: `omocap run my_take --object chair.obj --mount chair_mount.json -o chair_motion`

An object that was animated needs no phone: `omocap run chair.glb -o chair_motion`
"""


def run(
    session: given.Recording,
    result: given.ResultFolder,
    mesh: given.Mesh = None,
    mount: given.Mount = None,
    node: given.Node = None,
    seed: given.Seed = 0,
    samples: given.Samples = 4,
    contact: given.Contact = given.ContactRule.segments,
    contacts: given.Contacts = None,
    config: given.Config = given.Configuration.capture,
    weights: given.Weights = None,
    steps: given.Steps = 10,
    height: given.Height = None,
    stood: given.Stood = None,
    body: given.Body = None,
    floor: given.Floor = None,
    up: given.Up = None,
    stitch: given.Stitch = False,
    closure: given.Closure = False,
    mesh_scale: given.MeshScale = 1.0,
    segment: given.Segment = None,
    format_: given.Format = None,
    video: given.Video = True,
    video_size: given.Size = "960x540",
    replace: given.Replace = False,
    force: given.Force = False,
) -> None:
    """See HELP."""
    size = given.picture_size(video_size, "--video-size") if video else None
    from capture_app.pipeline import run_take
    from capture_app.request import TakeRequest
    from ingest.animated.detect import is_animation
    from ingest.trajectory.reading import Reading
    from omomo_core.generation.result import GenerationOptions

    animated = is_animation(session, mounted=mount is not None)
    request = TakeRequest(
        session=session,
        mesh=mesh,
        mount=None if animated else given.mount_file(mount),
        output=result,
        animated=animated,
        node=node,
        options=GenerationOptions(samples, seed, contact.value, steps=steps),
        contacts=contacts,
        configuration=config.value,
        weights=weights,
        body=body,
        height=height,
        stood=read_place(stood, "--stood"),
        reading=Reading(floor, read_up(up, "--up"), stitch, closure, segment, format_),
        mesh_scale=mesh_scale,
        video_size=size,
        replace=replace,
        force=force,
    )
    with progress_bars() as progress:
        made = run_take(request, progress)
    summarise(made)
