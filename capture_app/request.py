"""Everything a user says when they ask for a motion, or for a correction of one."""

from dataclasses import dataclass, field
from pathlib import Path

from capture_app.coordinates import Stood
from ingest.trajectory.reading import AS_LOGGED, Reading
from omomo_core.generation.result import GenerationOptions
from omomo_core.stages.stage import Configuration


@dataclass(frozen=True)
class TakeRequest:
    """One take to be turned into a motion."""

    session: Path
    """What the phone's logger wrote, or a file of the object's own motion."""
    mesh: Path | None
    """The object's surface; None for that of an animation that has its own."""
    mount: Path | None
    """Where the object is in the phone's frame; None when the phone's frame is the object's."""
    output: Path
    """The result folder to make."""
    animated: bool = False
    """The session is the object's own motion; there is no phone and no mount."""
    node: str | None = None
    """Which thing of an animated scene is the object; None where only one moves."""
    options: GenerationOptions = field(default_factory=GenerationOptions)
    contacts: Path | None = None
    """Which hand holds when and where, laid out as in `omomo_core.contact.file`; None decodes it."""
    configuration: Configuration = "capture"
    weights: Path | None = None
    """A folder that `omocap train` wrote; None for the weights that ship."""
    body: Path | None = None
    """A SMPL-X model file; None for the body that ships."""
    height: float | None = None
    """Stature of the person, metres; None for the body's own."""
    stood: Stood | None = None
    """About where the person stood when the take began: on the floor of the result's world, metres, or
    before the phone's screen; None guesses."""
    reading: Reading = AS_LOGGED
    """What the user says about the take."""
    mesh_scale: float = 1.0
    video_size: tuple[int, int] | None = (960, 540)
    """Width and height in pixels; None makes no video."""
    replace: bool = False
    """Put the result in place of an earlier one."""
    force: bool = False
    """Use a take that `omocap inspect` calls not usable."""

    @property
    def segments(self) -> bool:
        """Hands hold in segments, and not by the published rule."""
        return self.options.contact == "segments" and self.configuration == "capture"


@dataclass(frozen=True)
class ResolveRequest:
    """A result whose contacts were corrected."""

    result: Path
    contacts: Path
    """All contacts of its chosen sample as they should be."""
    output: Path
    """The result folder to make."""
    video_size: tuple[int, int] | None = (960, 540)
    """Width and height in pixels; None makes no video."""
    replace: bool = False
    """Put the result in place of an earlier one."""
