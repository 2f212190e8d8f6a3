"""Imports pyrender so that it runs on numpy 2 and on current Pythons, and on Linux without a display.

pyrender 0.1.45 is from 2021 and pins PyOpenGL 3.1.0: it uses `np.infty`, which numpy 2 dropped, and
`glGenTextures` of that PyOpenGL fails on Python 3.12. Import it only from here.
"""

import ctypes
import os
import sys
import warnings
from typing import Any

import numpy as np

if sys.platform == "linux":
    # Elsewhere there is no EGL: pyrender opens a hidden window.
    os.environ["PYOPENGL_PLATFORM"] = "egl"
    os.environ.setdefault("PYGLET_HEADLESS", "1")
if not hasattr(np, "infty"):
    setattr(np, "infty", np.inf)  # noqa: B010 (numpy's stubs know no such name)

with warnings.catch_warnings():
    warnings.simplefilter("ignore", DeprecationWarning)
    import OpenGL.platform as gl_platform
    import pyrender
    import pyrender.texture
    from OpenGL import GL as gl
    from pyrender.constants import ProgramFlags
    from pyrender.renderer import Renderer as GLRenderer

__all__ = ["GLRenderer", "ProgramFlags", "gl", "pyrender", "release_context"]


def _gen_textures(count: int) -> Any:
    names = (ctypes.c_uint * count)()
    generate = vars(gl_platform)["PLATFORM"].GL.glGenTextures
    generate.restype = None
    generate(ctypes.c_int(count), names)
    return int(names[0]) if count == 1 else list(names)


def release_context(platform: Any) -> None:
    """Free the OpenGL context of a platform of pyrender, which is current."""
    if sys.platform != "linux":
        platform.delete_context()
        return
    from OpenGL import EGL as egl

    # And no more: pyrender would close the display under others.
    display = platform._egl_display
    egl.eglMakeCurrent(display, egl.EGL_NO_SURFACE, egl.EGL_NO_SURFACE, egl.EGL_NO_CONTEXT)
    egl.eglDestroyContext(display, platform._egl_context)


pyrender.texture.glGenTextures = _gen_textures
