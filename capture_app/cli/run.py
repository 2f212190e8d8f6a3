"""`omocap run`: a phone session, a mesh and a mount become a motion."""

from capture_app.cli import options as given
from capture_app.cli.console import progress_bars
from capture_app.cli.summary import summarise


def run(
    session: given.Session,
    mesh: given.Mesh,
    result: given.ResultFolder,
    mount: given.Mount = None,
    seed: given.Seed = 0,
    samples: given.Samples = 4,
    contact: given.Contact = given.ContactRule.segments,
    contacts: given.Contacts = None,
    config: given.Config = given.Configuration.capture,
    weights: given.Weights = None,
    steps: given.Steps = 20,
    height: given.Height = None,
    body: given.Body = None,
    floor: given.Floor = None,
    mesh_scale: given.MeshScale = 1.0,
    segment: given.Segment = None,
    video: given.Video = True,
    video_size: given.Size = "960x540",
    force: given.Force = False,
) -> None:
    """Make the motion of the person who moved the object.

    Writes a folder with *motion.glb* (the animated person and object, for Blender, Unity, Unreal),
    *motion.mp4*, *motion.npz* (the numbers), *contacts.json* (which hand holds when and where, to be
    corrected with `omocap resolve`) and *manifest.json* (how it was made).

    Example: `omocap run my_take --object chair.obj --mount chair_mount.json -o chair_motion`
    """
    place = given.mount_file(mount)
    size = given.picture_size(video_size, "--video-size") if video else None
    from capture_app.pipeline import run_take
    from capture_app.request import TakeRequest
    from omomo_core.generation.result import GenerationOptions

    request = TakeRequest(
        session=session,
        mesh=mesh,
        mount=place,
        output=result,
        options=GenerationOptions(samples, seed, contact.value, steps=steps),
        contacts=contacts,
        configuration=config.value,
        weights=weights,
        body=body,
        height=height,
        floor=floor,
        mesh_scale=mesh_scale,
        segment=segment,
        video_size=size,
        replace=force,
    )
    with progress_bars() as progress:
        made = run_take(request, progress)
    summarise(made)
