"""The OpenGL backend: pyrender's context and buffers, and passes of our own."""

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from jaxtyping import Float

from render.cameras import Camera, look_at
from render.pyrender_shim import GLRenderer, ProgramFlags, gl, pyrender, release_context
from render.renderer import FAR, NEAR, Layer, Picture, Renderer
from render.scene import Drawable, Light, Scene, VertexNormals

# pyrender's renderer is made to be used, not to be extended: what it keeps has no public names.
# pyright: reportPrivateUsage=false


SHADERS = Path(__file__).parent / "shaders"
SHADOW_BLUR = 0.025
"""Radius of the soft edge of shadows, metres."""

SHADOW_SIDE = 512
"""Texels along each side of the shadow map.

A texel of a person with a chair is then 6 mm wide, far below the blur. Where the processor draws, 1024 takes
a fifth longer, and pyrender's 2048 twice as long, because the map does not stay in the cache."""


class LitScene(pyrender.Scene):
    """A scene with our light, and the view and projection from which the sun sees the casters."""

    def __init__(self, light: Light, clear: tuple[float, ...]) -> None:
        super().__init__(bg_color=clear)
        self.light = light
        self.sun_view = np.linalg.inv(look_at(np.zeros(3), -light.to_sun))
        self.sun_projection = np.eye(4)

    def aim_sun(self, points: Float[np.ndarray, "points 3"]) -> None:
        """Fit the shadow map to what casts shadows (world); its texels are spent where they are seen."""
        seen = points @ self.sun_view[:3, :3].T
        low, high = seen.min(axis=0) - 2 * SHADOW_BLUR, seen.max(axis=0) + 2 * SHADOW_BLUR
        self.sun_projection = np.diag([*(2.0 / (high - low) * [1.0, 1.0, -1.0]), 1.0])
        self.sun_projection[:3, 3] = (high + low) / (low - high) * [1.0, 1.0, -1.0]


class _Shader:
    """A program of pyrender with the locations of its uniforms, which pyrender looks up at every use."""

    def __init__(self, program: Any) -> None:
        self._program = program
        self._locations: dict[str, int] = {}

    def bind(self) -> None:
        self._program._bind()

    def set(self, name: str, value: int | float | np.ndarray) -> None:
        """Set a uniform of the bound program: a number, a vector of 3, or a matrix of 4 by 4."""
        location = self._locations.get(name)
        if location is None:
            location = gl.glGetUniformLocation(self._program._program_id, name)
            self._locations[name] = location
        if isinstance(value, int):
            gl.glUniform1i(location, value)
        elif isinstance(value, float):
            gl.glUniform1f(location, value)
        elif value.ndim == 1:
            gl.glUniform3fv(location, 1, value.astype(np.float32))
        else:
            gl.glUniformMatrix4fv(location, 1, gl.GL_TRUE, value.astype(np.float32))


class LitPasses(GLRenderer):
    """pyrender's renderer with our shaders and passes, any multisampling, and shadows of casters only."""

    with_depth = True

    def __init__(self, width: int, height: int, samples: int) -> None:
        super().__init__(width, height)
        self._samples = samples
        self._rgba = np.empty((height, width, 4), np.uint8)
        self._shaders: dict[Any, _Shader] = {}
        self._program_cache.shader_dir = str(SHADERS)

    def _shadow_mapping_pass(self, scene: LitScene, light_node: Any, flags: int) -> None:
        self._configure_shadow_mapping_viewport(light_node.light, flags)
        gl.glViewport(0, 0, SHADOW_SIDE, SHADOW_SIDE)
        gl.glDisable(gl.GL_BLEND)
        gl.glEnable(gl.GL_CULL_FACE)
        view_projection = scene.sun_projection @ scene.sun_view

        def begin(shader: _Shader) -> None:
            shader.set("view_projection", view_projection)

        casters = (node for node in _visible_nodes(scene) if node.mesh.casts_shadow)
        for node, shader in self._with_shaders(casters, flags, ProgramFlags.NONE, begin):
            shader.set("M", scene.get_pose(node))
            _draw_faces(node.mesh.primitives[0])
        gl.glFlush()

    def _forward_pass(self, scene: LitScene, flags: int, seg_node_map: Any = None) -> Any:
        """Draw all surfaces; return the picture and, if wanted, its depth."""
        self._configure_forward_pass_viewport(flags)
        gl.glClearColor(*scene.bg_color)
        gl.glClear(gl.GL_COLOR_BUFFER_BIT)
        gl.glClear(gl.GL_DEPTH_BUFFER_BIT)
        gl.glEnable(gl.GL_MULTISAMPLE)
        gl.glDisable(gl.GL_BLEND)
        view, projection = self._get_camera_matrices(scene)
        shadows = bool(flags & pyrender.RenderFlags.SHADOWS_DIRECTIONAL)

        def begin(shader: _Shader) -> None:
            shader.set("view_projection", projection @ view)
            self._light(scene, shader, shadows=shadows)

        for node, shader in self._with_shaders(
            _visible_nodes(scene), flags, ProgramFlags.USE_MATERIAL, begin
        ):
            shader.set("M", scene.get_pose(node))
            shader.set("real", int(node.mesh.real))
            self._bind_material(node.mesh.primitives[0].material, shader)
            _draw_faces(node.mesh.primitives[0])
        gl.glFlush()
        return self._read_main_framebuffer(scene, flags)

    def _with_shaders(
        self, nodes: Iterable[Any], flags: int, kind: int, begin: Callable[[_Shader], None]
    ) -> Iterable[tuple[Any, _Shader]]:
        """Yield each node with its shader, which is bound; `begin` sets the uniforms that all nodes share."""
        last, begun = None, set[_Shader]()
        for node in nodes:
            program = node.mesh.primitives[0].program(self, flags, kind)
            if program not in self._shaders:
                self._shaders[program] = _Shader(program)
            shader = self._shaders[program]
            if shader is not last:
                shader.bind()
                last = shader
            if shader not in begun:
                begin(shader)
                begun.add(shader)
            yield node, shader

    def _light(self, scene: LitScene, shader: _Shader, *, shadows: bool) -> None:
        light = scene.light
        shader.set("sun_view", scene.sun_view)
        shader.set("up", scene.sun_view[:3, 2])
        for name in ("sun", "sky", "ground"):
            shader.set(name, float(getattr(light, name)))
        if not shadows:
            return
        (sun,) = scene.light_nodes
        gl.glActiveTexture(gl.GL_TEXTURE0)
        sun.light.shadow_texture._bind()
        shader.set("shadow_map", 0)
        shader.set("light_matrix", scene.sun_projection @ scene.sun_view)
        shader.set("light_scale", 0.5 * np.diag(scene.sun_projection)[:3])
        shader.set("blur", SHADOW_BLUR)

    def _bind_material(self, material: Any, shader: _Shader) -> None:
        """Set colour and texture, and whether faces that look away are drawn."""
        shader.set("base_color", np.array(material.baseColorFactor[:3]))
        if material.baseColorTexture is not None:
            gl.glActiveTexture(gl.GL_TEXTURE1)
            material.baseColorTexture._bind()
            shader.set("base_color_texture", 1)
        (gl.glDisable if material.doubleSided else gl.glEnable)(gl.GL_CULL_FACE)

    def _read_main_framebuffer(self, scene: LitScene, flags: int) -> tuple[Any, Any]:
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


def _visible_nodes(scene: LitScene) -> list[Any]:
    """The visible nodes by their names.

    Of two surfaces in one place the first is seen; pyrender keeps them in a set, in any order.
    """
    return sorted((n for n in scene.mesh_nodes if n.mesh.is_visible), key=lambda node: node.name)


def _draw_faces(primitive: Any) -> None:
    primitive._bind()
    gl.glDrawElements(gl.GL_TRIANGLES, primitive.indices.size, gl.GL_UNSIGNED_INT, None)


# pyrender hides its renderer behind the offscreen one and offers no way to bring another.
# pyright: reportPrivateUsage=false


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
