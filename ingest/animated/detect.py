"""Tell whether a file is an animation of the object, and read it with the reader of its format."""

from pathlib import Path
from typing import Protocol, TypeVar, runtime_checkable

from ingest.animated import animated_gltf, animated_usd, keyframes, npz_poses, tum_poses
from ingest.animated.animation import Animation
from ingest.formats import pose_table
from omomo_core.errors import InputError


@runtime_checkable
class AnimationFormat(Protocol):
    """The module of an animation format: its name, its files, and how it recognises one."""

    @property
    def NAME(self) -> str: ...  # noqa: D102
    @property
    def FILES(self) -> str: ...  # noqa: D102

    def detect(self, path: Path) -> bool: ...  # noqa: D102


@runtime_checkable
class SceneFormat(AnimationFormat, Protocol):
    """A format whose files hold several named nodes."""

    def read(self, path: Path, node: str | None = None) -> Animation: ...  # noqa: D102


@runtime_checkable
class TrackFormat(AnimationFormat, Protocol):
    """A format whose files hold the motion of one object."""

    def read(self, path: Path) -> Animation: ...  # noqa: D102


_K = TypeVar("_K", bound=AnimationFormat)

SCENES: tuple[SceneFormat, ...] = (animated_gltf, animated_usd)
TRACKS: tuple[TrackFormat, ...] = (npz_poses, keyframes, tum_poses)


def is_animation(path: Path, *, mounted: bool) -> bool:
    """Whether a recording is the object's own motion, rather than a phone's.

    Text of poses may be either: it is a phone's log where a mount is given.

    Args:
        path: what the user gave.
        mounted: a mount was given, so that a phone's log is meant.

    Raises:
        InputError: "mount-unused" when a mount is given for what can only be the object's motion.
    """
    kind = _first(SCENES, path) or _first(TRACKS, path)
    if kind is None or (
        mounted and (kind is tum_poses or (kind is keyframes and pose_table.detect(path)))
    ):
        return False
    if mounted:
        raise InputError(
            "mount-unused",
            f"{path.name} ({kind.NAME}) is the motion of the object itself; no phone is mounted on it.",
            field="mount",
            fix="Leave out ‹mount›.",
        )
    return True


def read_animation(path: Path, node: str | None = None) -> Animation:
    """Read an object's own motion, whatever kind of file it is.

    Args:
        path: the file.
        node: which thing of a scene is the object; None where only one moves.

    Raises:
        InputError: "animation-unknown", "node-unused", or what is wrong with the file.
    """
    scene = _first(SCENES, path)
    if scene is not None:
        return scene.read(path, node)
    track = _first(TRACKS, path)
    if track is None:
        known = "; ".join(kind.FILES for kind in (*SCENES, *TRACKS))
        raise InputError(
            "animation-unknown",
            f"{path.name} is no animation of a known kind.",
            where=str(path),
            fix=f"Give {known}.",
        )
    if node is not None:
        raise InputError(
            "node-unused",
            f"{path.name} ({track.NAME}) is the motion of one thing, which has no name in it.",
            field="node",
            fix="Leave out ‹node›.",
        )
    return track.read(path)


def _first(kinds: tuple[_K, ...], path: Path) -> _K | None:
    """The kind of a file, if it is one of these and can be read."""
    try:
        return next((kind for kind in kinds if path.is_file() and kind.detect(path)), None)
    except OSError:
        return None
