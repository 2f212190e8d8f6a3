"""Every number that shapes a motion: `omocap doctor --config` prints them, manifests store them."""

from collections.abc import Mapping
from dataclasses import dataclass

from ingest.trajectory.trajectory_config import TRAJECTORY, TrajectoryConfig
from omomo_core.body.body_config import BODY, BodyConfig
from omomo_core.config import Number, settings_of
from omomo_core.contact.contact_config import CONTACT, ContactConfig
from omomo_core.generation.generation_config import GENERATION, GenerationConfig
from omomo_core.geometry.geometry_config import GEOMETRY, GeometryConfig
from omomo_core.stages.stage_config import STAGES, StagesConfig


@dataclass(frozen=True)
class MotionConfig:
    """The numbers of every room."""

    trajectory: TrajectoryConfig = TRAJECTORY
    contact: ContactConfig = CONTACT
    body: BodyConfig = BODY
    generation: GenerationConfig = GENERATION
    geometry: GeometryConfig = GEOMETRY
    stages: StagesConfig = STAGES


MOTION_CONFIG = MotionConfig()


def recorded_config() -> dict[str, Number]:
    """Return every number by its name, as a manifest stores it."""
    return {one.name: one.value for one in settings_of(MOTION_CONFIG)}


def changed_settings(recorded: Mapping[str, Number]) -> tuple[str, ...]:
    """Return the names of the numbers that are not what a manifest recorded.

    Numbers that only one of the two has do not count: another version may have named them otherwise.
    """
    now = recorded_config()
    return tuple(name for name, value in recorded.items() if name in now and now[name] != value)
