"""Draws with OpenGL: pyrender's context and buffers, our own passes, updates in place."""

# pyrender hides its renderer behind the offscreen one and offers no way to bring another.
# pyright: reportPrivateUsage=false

from typing import Any

import cv2
import numpy as np
from jaxtyping import Float

from render.cameras import Camera
from render.lit_passes import SHADOW_SIDE, LitPasses, LitScene
from render.normals import VertexNormals
from render.pyrender_shim import gl, pyrender, release_context
from render.renderer import FAR, NEAR, Layer, Picture, Renderer
from render.scene import Drawable, Scene


class PyrenderRenderer(Renderer):
    """The "pyrender" backend; OpenGL binds it to its first thread."""

    def __init__(self, width: int, height: int, samples: int) -> None:
        super().__init__(width, height)
        self._offscreen: Any = pyrender.OffscreenRenderer(width, height)
        self._offscreen._renderer = LitPasses(width, height, samples)
        self._camera = pyrender.IntrinsicsCamera(1.0, 1.0, 0.0, 0.0, znear=NEAR, zfar=FAR)
        self.show(Scene(()))

    def show(self, scene: Scene) -> None:
        """Draw this scene from now on."""
        clear = (0.0,) * 4 if scene.background is None else (*scene.background, 1.0)
        self._stage = LitScene(scene.light, clear)
        self._camera_node = self._stage.add(self._camera)
        sun = pyrender.DirectionalLight()
        sun._generate_shadow_texture(SHADOW_SIDE)
        self._stage.add(sun)
        self._surfaces: dict[str, _Surface] = {}
        for drawable in scene.drawables:
            surface = _Surface(drawable)
            self._surfaces[drawable.name] = surface
            self._stage.add_node(surface.node)

    def update(
        self,
        name: str,
        *,
        vertices: Float[np.ndarray, "verts 3"] | None = None,
        T_world: Float[np.ndarray, "4 4"] | None = None,
        color: Float[np.ndarray, " 3"] | None = None,
        visible: bool | None = None,
    ) -> None:
        """Change a drawable in place."""
        surface = self._surfaces[name]
        if vertices is not None:
            self._offscreen._platform.make_current()  # another renderer may have drawn since
            surface.move(vertices)
        if T_world is not None:
            self._stage.set_pose(surface.node, T_world)
        if color is not None:
            surface.material.baseColorFactor = (*np.clip(color, 0, 1), 1.0)
        if visible is not None:
            surface.mesh.is_visible = visible

    def draw(self, camera: Camera) -> Picture:
        """The scene as the camera sees it."""
        rgba, depth = self._drawn(camera, with_depth=True)
        return np.ascontiguousarray(rgba[..., :3]), np.ascontiguousarray(depth)

    def layer(self, camera: Camera) -> Layer:
        """The same without its depth."""
        # The next picture is read into the same array.
        return self._drawn(camera, with_depth=False)[0].copy()

    def _drawn(self, camera: Camera, *, with_depth: bool) -> tuple[Any, Any]:
        self._offscreen._renderer.with_depth = with_depth
        self._camera.fx, self._camera.fy = camera.fx, camera.fy
        # pyrender counts pixels from the corner of the first one, Camera from its centre.
        self._camera.cx, self._camera.cy = camera.cx + 0.5, camera.cy + 0.5
        self._stage.set_pose(self._camera_node, camera.T_world_camera)
        casters = [s for s in self._surfaces.values() if s.shades]
        flags = pyrender.RenderFlags.RGBA
        if casters:
            flags |= pyrender.RenderFlags.SHADOWS_DIRECTIONAL
            self._stage.aim_sun(np.concatenate([s.corners(self._stage) for s in casters]))
        return self._offscreen.render(self._stage, flags)

    def close(self) -> None:
        """Free the OpenGL context."""
        platform: Any = self._offscreen._platform
        if platform is None:
            return
        platform.make_current()
        self._offscreen._renderer.delete()
        release_context(platform)
        self._offscreen._renderer = self._offscreen._platform = None


class _Surface:
    """A drawable in OpenGL: one primitive, the mesh around it and its node."""

    def __init__(self, drawable: Drawable) -> None:
        self._normals = VertexNormals(drawable.faces, len(drawable.vertices))
        texture = uv = None
        if drawable.texture is not None and drawable.uv is not None:
            # With three bytes a texel, rows of most widths would break OpenGL's alignment of four.
            opaque = np.dstack(
                [drawable.texture, np.full(drawable.texture.shape[:2], 255, np.uint8)]
            )
            texture = pyrender.Texture(source=opaque, source_channels="RGBA")
            uv = drawable.uv * [1.0, -1.0] + [0.0, 1.0]  # OpenGL's v goes up
        self.material: Any = pyrender.MetallicRoughnessMaterial(
            baseColorFactor=(*drawable.color, 1.0),
            baseColorTexture=texture,
            doubleSided=not drawable.closed,
        )
        self.primitive = _LivePrimitive(
            drawable.vertices,
            normals=self._normals(drawable.vertices),
            texcoord_0=uv,
            indices=drawable.faces,
            material=self.material,
        )
        self.mesh: Any = pyrender.Mesh([self.primitive])
        self.mesh.casts_shadow = drawable.casts_shadow
        self.mesh.real = drawable.real
        self.node = pyrender.Node(drawable.name, mesh=self.mesh)
        self._box = _corners(drawable.vertices)

    @property
    def shades(self) -> bool:
        """Whether it throws a shadow now."""
        return self.mesh.casts_shadow and self.mesh.is_visible

    def move(self, vertices: Float[np.ndarray, "verts 3"]) -> None:
        self.primitive.move(vertices, self._normals(vertices))
        self._box = _corners(vertices)

    def corners(self, stage: Any) -> Float[np.ndarray, "8 3"]:
        """Corners of the bounding box, in the world."""
        T = stage.get_pose(self.node)
        return self._box @ T[:3, :3].T + T[:3, 3]


class _LivePrimitive(pyrender.Primitive):
    """A primitive whose vertices are replaced in the buffer the card already holds."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._programs: dict[tuple[int, int], Any] = {}

    def program(self, renderer: Any, flags: int, kind: int) -> Any:
        """The shader program that draws it; kept, because pyrender would search for it in every picture."""
        key = flags, kind
        if key not in self._programs:
            self._programs[key] = renderer._get_primitive_program(self, flags, kind)
        return self._programs[key]

    def move(
        self, positions: Float[np.ndarray, "verts 3"], normals: Float[np.ndarray, "verts 3"]
    ) -> None:
        self.positions, self.normals = positions, normals
        if not self._buffers:
            return  # not drawn yet: the first drawing uploads everything
        parts = [self.positions, self.normals]
        if self.texcoord_0 is not None:
            parts.append(self.texcoord_0)
        data = np.ascontiguousarray(np.hstack(parts), np.float32)
        gl.glBindBuffer(gl.GL_ARRAY_BUFFER, self._buffers[0])
        gl.glBufferSubData(gl.GL_ARRAY_BUFFER, 0, data.nbytes, data)


def _corners(points: Float[np.ndarray, "points 3"]) -> Float[np.ndarray, "8 3"]:
    """Corners of the box around points; along a short axis OpenCV is ten times as fast as numpy."""
    ends = [cv2.reduce(points, 0, of)[0] for of in (cv2.REDUCE_MIN, cv2.REDUCE_MAX)]
    return np.stack(np.meshgrid(*zip(*ends, strict=True)), axis=-1).reshape(-1, 3)
