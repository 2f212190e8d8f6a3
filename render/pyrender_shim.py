"""Imports pyrender so that it runs without a display, on numpy 2 and on current Pythons.

pyrender 0.1.45 is from 2021 and pins PyOpenGL 3.1.0: it uses `np.infty`, which numpy 2 dropped, and
`glGenTextures` of that PyOpenGL fails on Python 3.12. Import it only from here.
"""

import ctypes
import os
import warnings
from typing import Any

import numpy as np

os.environ["PYOPENGL_PLATFORM"] = "egl"
os.environ.setdefault("PYGLET_HEADLESS", "1")
if not hasattr(np, "infty"):
    setattr(np, "infty", np.inf)  # noqa: B010 (numpy's stubs know no such name)

with warnings.catch_warnings():
    warnings.simplefilter("ignore", DeprecationWarning)
    import OpenGL.platform as gl_platform
    import pyrender
    import pyrender.texture
    from OpenGL import EGL as egl
    from OpenGL import GL as gl
    from pyrender.renderer import Renderer as GLRenderer

__all__ = ["GLRenderer", "egl", "gl", "pyrender"]


def _gen_textures(count: int) -> Any:
    names = (ctypes.c_uint * count)()
    generate = vars(gl_platform)["PLATFORM"].GL.glGenTextures
    generate.restype = None
    generate(ctypes.c_int(count), names)
    return int(names[0]) if count == 1 else list(names)


pyrender.texture.glGenTextures = _gen_textures
