"""The Blender that a user has."""

import shutil

from omomo_core.errors import InputError

_BLENDER = "blender"


def has_blender() -> bool:
    """Whether there is a Blender on the PATH."""
    return shutil.which(_BLENDER) is not None


def find_blender(given: str | None) -> str:
    """Blender's executable.

    Args:
        given: its path or name; "blender" on the PATH if None.

    Raises:
        InputError: "blender-missing".
    """
    found = shutil.which(given or _BLENDER)
    if found is None:
        raise InputError(
            "blender-missing",
            "FBX is written by Blender, and there is none"
            + (" on the PATH." if given is None else " of this name."),
            where="‹to› fbx" if given is None else f"‹blender› {given}",
            fix="Install it from blender.org (4.2 or later) and name it with ‹blender› PATH; "
            "or export ‹to› glb, which Unreal, Unity and Blender read.",
        )
    return found
