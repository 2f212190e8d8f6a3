"""open_renderer: OpenGL where it works, else the ray caster."""

import logging
import sys
from typing import Literal

from omomo_core.errors import InputError
from render.renderer import Renderer

Backend = Literal["auto", "pyrender", "raycast"]

OPENGL_FIX = (
    "Install the apt packages libegl1 and libgl1"
    if sys.platform == "linux"
    else "Install the driver of the graphics card"
)

_log = logging.getLogger(__name__)


def open_renderer(
    width: int, height: int, backend: Backend = "auto", *, samples: int = 4
) -> Renderer:
    """A renderer for pictures of `width` x `height` pixels.

    Args:
        width, height: size of the pictures in pixels.
        backend: "pyrender" draws with OpenGL (on Linux through EGL, no display needed); "raycast" needs no
            OpenGL at all but has jagged edges and hard shadows; "auto" takes the first that works.
        samples: multisampling of "pyrender": 4 smooths edges and takes two thirds longer; 0 is
            none. "raycast" shoots one ray a pixel.

    Raises:
        InputError: "pyrender" was asked for and OpenGL cannot be opened.
    """
    if backend != "raycast":
        try:
            from render.pyrender_backend import PyrenderRenderer

            return PyrenderRenderer(width, height, samples)
        except Exception as error:  # missing libraries and drivers fail in a dozen different ways
            if backend == "pyrender":
                raise InputError(
                    "no-opengl",
                    "OpenGL could not be opened on this machine.",
                    fix=f"{OPENGL_FIX}, or choose backend raycast.",
                ) from error
            _log.warning(
                "OpenGL is not available (%s); drawing with the slower ray caster. %s for OpenGL.",
                error,
                OPENGL_FIX,
            )
    from render.raycast_backend import RaycastRenderer

    return RaycastRenderer(width, height)
