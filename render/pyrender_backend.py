"""Draws with OpenGL: pyrender's context, buffers and passes, our own light, updates in place."""

# pyrender hides its renderer behind the offscreen one and offers no way to bring another.
# pyright: reportPrivateUsage=false

from pathlib import Path
from typing import Any

import cv2
import numpy as np
from jaxtyping import Float

from render.cameras import Camera, look_at
from render.normals import VertexNormals
from render.pyrender_shim import GLRenderer, gl, pyrender, release_context
from render.renderer import FAR, NEAR, Layer, Picture, Renderer
from render.scene import Drawable, Light, Scene

SHADERS = Path(__file__).parent / "shaders"
SHADOW_BLUR = 0.025
"""Radius of the soft edge of shadows, metres."""

SHADOW_SIDE = 512
"""Texels along each side of the shadow map.

A texel of a person with a chair is then 6 mm wide, far below the blur. Where the processor draws, 1024 takes
a fifth longer, and pyrender's 2048 twice as long, because the map does not stay in the cache."""


class PyrenderRenderer(Renderer):
    """The "pyrender" backend; OpenGL binds it to its first thread."""

    def __init__(self, width: int, height: int, samples: int) -> None:
        super().__init__(width, height)
        self._offscreen: Any = pyrender.OffscreenRenderer(width, height)
        self._offscreen._renderer = _LitRenderer(width, height, samples)
        self._camera = pyrender.IntrinsicsCamera(1.0, 1.0, 0.0, 0.0, znear=NEAR, zfar=FAR)
        self.show(Scene(()))

    def show(self, scene: Scene) -> None:
        """Draw this scene from now on."""
        clear = (0.0,) * 4 if scene.background is None else (*scene.background, 1.0)
        self._stage = _Stage(bg_color=clear, ambient_light=(0.0, 0.0, 0.0))
        self._stage.light = scene.light
        self._camera_node = self._stage.add(self._camera)
        sun = pyrender.DirectionalLight()
        sun._generate_shadow_texture(SHADOW_SIDE)
        self._stage.add(sun, pose=_pose_facing(-scene.light.to_sun))
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
        return self._drawn(camera, with_depth=False)[
            0
        ].copy()  # the next picture is read into the same array

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

    @property
    def shades(self) -> bool:
        """Whether it throws a shadow now."""
        return self.mesh.casts_shadow and self.mesh.is_visible

    def move(self, vertices: Float[np.ndarray, "verts 3"]) -> None:
        self.primitive.move(vertices, self._normals(vertices))

    def corners(self, stage: Any) -> Float[np.ndarray, "8 3"]:
        """Corners of the bounding box, in the world."""
        low, high = self.primitive.bounds
        corner = np.array(np.meshgrid(*zip(low, high, strict=True))).reshape(3, -1).T
        T = stage.get_pose(self.node)
        return corner @ T[:3, :3].T + T[:3, 3]


class _LivePrimitive(pyrender.Primitive):
    """A primitive whose vertices are replaced in the buffer the card already holds."""

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

    def _compute_bounds(self) -> Float[np.ndarray, "2 3"]:
        """Corners of the bounding box; along a short axis OpenCV is ten times as fast as numpy."""
        low, high = (cv2.reduce(self.positions, 0, of) for of in (cv2.REDUCE_MIN, cv2.REDUCE_MAX))
        return np.vstack([low, high])


class _Stage(pyrender.Scene):
    """A scene with our light, and the view and projection from which the sun sees the casters."""

    light: Light
    sun_view = sun_projection = np.eye(4)

    def aim_sun(self, points: Float[np.ndarray, "points 3"]) -> None:
        """Fit the shadow map to what casts shadows (world); its texels are spent where they are seen."""
        self.sun_view = np.linalg.inv(_pose_facing(-self.light.to_sun))
        seen = points @ self.sun_view[:3, :3].T
        low, high = seen.min(axis=0) - 2 * SHADOW_BLUR, seen.max(axis=0) + 2 * SHADOW_BLUR
        self.sun_projection = np.diag([*(2.0 / (high - low) * [1.0, 1.0, -1.0]), 1.0])
        self.sun_projection[:3, 3] = (high + low) / (low - high) * [1.0, 1.0, -1.0]


class _LitRenderer(GLRenderer):
    """pyrender's passes with our shaders, any multisampling, and shadows of casters only."""

    with_depth = True

    def __init__(self, width: int, height: int, samples: int) -> None:
        super().__init__(width, height)
        self._samples = samples
        self._rgba = np.empty((height, width, 4), np.uint8)
        self._lit = set[Any]()
        self._program_cache.shader_dir = str(SHADERS)

    def render(self, scene: _Stage, flags: int, seg_node_map: Any = None) -> Any:
        """The picture and, if wanted, its depth."""
        self._lit.clear()
        return super().render(scene, flags, seg_node_map)

    def _bind_lighting(self, scene: _Stage, program: Any, node: Any, flags: int) -> None:
        shadows = flags & pyrender.RenderFlags.SHADOWS_DIRECTIONAL
        program.set_uniform("real", node.mesh.real)
        if shadows:
            (light_node,) = scene.light_nodes
            self._bind_texture(light_node.light.shadow_texture, "shadow_map", program)
        if program in self._lit:
            return  # a program keeps the uniforms that were set for the first surface of the picture
        self._lit.add(program)
        light = scene.light
        program.set_uniform("to_sun", light.to_sun)
        program.set_uniform("sun", light.sun)
        program.set_uniform("sky", light.sky)
        program.set_uniform("ground", light.ground)
        if shadows:
            program.set_uniform("light_matrix", scene.sun_projection @ scene.sun_view)
            program.set_uniform("blur", SHADOW_BLUR)

    def _sorted_mesh_nodes(self, scene: _Stage) -> list[Any]:
        # Of two surfaces in one place the first is seen; pyrender keeps them in a set, in any order.
        return sorted(scene.mesh_nodes, key=lambda node: node.name)

    def _shadow_mapping_pass(self, scene: _Stage, light_node: Any, flags: int) -> None:
        hidden = [m for m in scene.meshes if m.is_visible and not m.casts_shadow]
        for mesh in hidden:
            mesh.is_visible = False
        try:
            super()._shadow_mapping_pass(scene, light_node, flags)
        finally:
            for mesh in hidden:
                mesh.is_visible = True

    def _get_light_cam_matrices(self, scene: _Stage, light_node: Any, flags: int) -> Any:
        return scene.sun_view, scene.sun_projection

    def _configure_shadow_mapping_viewport(self, light: Any, flags: int) -> None:
        super()._configure_shadow_mapping_viewport(light, flags)
        gl.glViewport(0, 0, SHADOW_SIDE, SHADOW_SIDE)

    def _read_main_framebuffer(self, scene: _Stage, flags: int) -> tuple[Any, Any]:
        if self.with_depth:
            rgba, depth = super()._read_main_framebuffer(scene, flags)
            return rgba, depth
        source = self._main_fb_ms
        width, height = self.viewport_width, self.viewport_height
        if self._samples:
            gl.glBindFramebuffer(gl.GL_READ_FRAMEBUFFER, self._main_fb_ms)
            gl.glBindFramebuffer(gl.GL_DRAW_FRAMEBUFFER, self._main_fb)
            corners = (0, 0, width, height)
            gl.glBlitFramebuffer(*corners, *corners, gl.GL_COLOR_BUFFER_BIT, gl.GL_LINEAR)
            source = self._main_fb
        gl.glBindFramebuffer(gl.GL_READ_FRAMEBUFFER, source)
        gl.glReadPixels(0, 0, width, height, gl.GL_RGBA, gl.GL_UNSIGNED_BYTE, self._rgba)
        return self._rgba[::-1], None

    def _configure_main_framebuffer(self) -> None:
        fresh = self._main_fb is None
        super()._configure_main_framebuffer()
        if not fresh:
            return
        for buffer, kind in (
            (self._main_cb_ms, gl.GL_RGBA),
            (self._main_db_ms, gl.GL_DEPTH_COMPONENT24),
        ):
            gl.glBindRenderbuffer(gl.GL_RENDERBUFFER, buffer)
            gl.glRenderbufferStorageMultisample(
                gl.GL_RENDERBUFFER, self._samples, kind, self.viewport_width, self.viewport_height
            )


def _pose_facing(direction: Float[np.ndarray, " 3"]) -> Float[np.ndarray, "4 4"]:
    """A pose whose -z axis points along a direction."""
    return look_at(np.zeros(3), direction)
