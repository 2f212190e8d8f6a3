"""RaycastRenderer: draws with Embree and numpy, without OpenGL; edges are jagged and shadows hard."""

from dataclasses import dataclass

import cv2
import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from jaxtyping import Bool, Float, Float32, Int, UInt8

from render.cameras import Camera
from render.renderer import FAR, NEAR, Layer, Picture, Renderer
from render.scene import Drawable, Light, Scene, VertexNormals

_LIFT = 1e-3
"""Shadow rays start this far above the surface, metres."""


class RaycastRenderer(Renderer):
    """The "raycast" backend."""

    def __init__(self, width: int, height: int) -> None:
        super().__init__(width, height)
        self.show(Scene(()))

    def show(self, scene: Scene) -> None:
        """Draw this scene from now on."""
        self._light = scene.light
        self._background = np.array(
            (0.0,) * 4 if scene.background is None else (*scene.background, 1.0), np.float32
        )
        self._surfaces = {d.name: _Surface(d) for d in scene.drawables}
        self._world: _World | None = None

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
            surface.move(vertices)
        if T_world is not None:
            surface.T_world = T_world
        if color is not None:
            surface.color = np.clip(color, 0, 1)
        if visible is not None:
            surface.visible = visible
        if not (vertices is None and T_world is None and visible is None):
            self._world = None

    def draw(self, camera: Camera) -> Picture:
        """The scene as the camera sees it."""
        layer, depth = self._drawn(camera)
        return np.ascontiguousarray(layer[..., :3]), depth

    def layer(self, camera: Camera) -> Layer:
        """The scene as the camera sees it, without depth."""
        return self._drawn(camera)[0]

    def _drawn(self, camera: Camera) -> tuple[Layer, Float32[np.ndarray, "h w"]]:
        if self._world is None:
            self._world = _World([s for s in self._surfaces.values() if s.visible])
        rays = self._rays(camera)
        eye = camera.T_world_camera[:3, 3].astype(np.float32)
        hits = self._world.first_hits(eye, rays)
        color = np.tile(self._background, (len(rays), 1))
        depth = np.zeros(len(rays), np.float32)
        if len(hits.pixel):
            color[hits.pixel] = self._world.shaded(hits, camera.fx, self._light)
            depth[hits.pixel] = hits.depth
        rgba = (np.clip(color, 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8)
        return rgba.reshape(self.height, self.width, 4), depth.reshape(self.height, self.width)

    def _rays(self, camera: Camera) -> Float32[np.ndarray, "pixels 3"]:
        """One direction per pixel, as long as it takes to gain one metre of depth."""
        u, v = np.meshgrid(np.arange(self.width), np.arange(self.height))
        x, y = (u - camera.cx) / camera.fx, (camera.cy - v) / camera.fy
        seen = np.stack([x, y, -np.ones_like(x)], axis=-1).reshape(-1, 3)
        return (seen @ camera.T_world_camera[:3, :3].T).astype(np.float32)

    def close(self) -> None:
        """Forget the scene."""
        self._surfaces, self._world = {}, None


@dataclass(frozen=True)
class _Hits:
    """The ends of the rays of pixels that see something."""

    pixel: Int[np.ndarray, " hits"]
    depth: Float32[np.ndarray, " hits"]
    point: Float32[np.ndarray, "hits 3"]
    normal: Float32[np.ndarray, "hits 3"]
    """Smooth, on the viewer's side."""
    slant: Float32[np.ndarray, " hits"]
    """Cosine between the ray and the normal."""
    surface: Int[np.ndarray, " hits"]
    corners: Int[np.ndarray, "hits 3"]
    """Vertices of the triangle, in the joined arrays of the world."""
    weights: Float32[np.ndarray, "hits 3"]
    """Barycentric coordinates of the point on that triangle."""


class _Surface:
    """A drawable as it is now."""

    def __init__(self, drawable: Drawable) -> None:
        self.faces = drawable.faces
        self.casts_shadow = drawable.casts_shadow
        self.real = drawable.real
        self.color = np.array(drawable.color)
        self.T_world = np.eye(4)
        self.visible = True
        self.uv = drawable.uv
        self.texture = None if drawable.texture is None else MipMaps(drawable.texture)
        self.texels_per_metre = _texel_density(drawable)
        self._normals_of = VertexNormals(drawable.faces, len(drawable.vertices))
        self.move(drawable.vertices)

    def move(self, vertices: Float[np.ndarray, "verts 3"]) -> None:
        self._vertices, self._normals = vertices, self._normals_of(vertices)

    def in_world(self) -> tuple[Float32[np.ndarray, "verts 3"], Float32[np.ndarray, "verts 3"]]:
        """Vertices and normals."""
        R, t = self.T_world[:3, :3], self.T_world[:3, 3]
        vertices = (self._vertices @ R.T + t).astype(np.float32)
        return vertices, (self._normals @ R.T).astype(np.float32)


class _World:
    """The surfaces joined into arrays, and the two sets that rays are shot at."""

    def __init__(self, surfaces: list[_Surface]) -> None:
        self._surfaces = surfaces
        placed = [s.in_world() for s in surfaces] or [(np.zeros((0, 3), np.float32),) * 2]
        self._normals = np.concatenate([n for _, n in placed])
        counts = np.cumsum([0, *(len(v) for v, _ in placed)])
        self._first_vertex = counts[:-1]
        self._faces = [s.faces + at for s, at in zip(surfaces, counts[:-1], strict=False)]
        self._first_face = np.cumsum([0, *(len(f) for f in self._faces)])
        self._seen, self._casters = EmbreeScene(), EmbreeScene()
        self._any_caster = False
        for surface, (vertices, _) in zip(surfaces, placed, strict=False):
            faces = np.ascontiguousarray(surface.faces, np.int32)
            TriangleMesh(self._seen, vertices, faces)
            if surface.casts_shadow:
                TriangleMesh(self._casters, vertices, faces)
                self._any_caster = True

    def first_hits(
        self, eye: Float32[np.ndarray, " 3"], rays: Float32[np.ndarray, "pixels 3"]
    ) -> _Hits:
        """Return where each ray from the eye first meets a surface between NEAR and FAR."""
        start = np.ascontiguousarray(eye + NEAR * rays)
        found = self._seen.run(start, rays, output=True)
        depth = found["tfar"] + np.float32(NEAR)
        pixel = np.flatnonzero((found["primID"] >= 0) & (depth < FAR))
        surface = found["geomID"][pixel]
        faces = np.concatenate([*self._faces, np.zeros((0, 3), int)])
        corners = faces[self._first_face[surface] + found["primID"][pixel]]
        u, v = found["u"][pixel], found["v"][pixel]
        weights = np.stack([1 - u - v, u, v], axis=1)
        ray = rays[pixel]
        normal = np.einsum("hk,hkx->hx", weights, self._normals[corners])
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
        away = np.einsum("hx,hx->h", found["Ng"][pixel], ray) > 0
        normal[away] *= -1.0
        slant = np.abs(np.einsum("hx,hx->h", normal, ray)) / np.linalg.norm(ray, axis=1)
        point = eye + ray * depth[pixel, None]
        return _Hits(pixel, depth[pixel], point, normal, slant, surface, corners, weights)

    def shaded(self, hits: _Hits, focal: float, light: Light) -> Float32[np.ndarray, "hits 4"]:
        """Return what render/shaders/mesh.frag computes; `focal` in pixels."""
        open_air, lit = self.irradiance(hits, light)
        color = np.ones((len(lit), 4), np.float32)
        color[:, :3] = self.albedo(hits, focal) * lit[:, None]
        real = np.array([s.real for s in self._surfaces])[hits.surface]
        color[real, :3], color[real, 3] = 0.0, 1.0 - (lit / open_air)[real]
        return color

    def irradiance(
        self, hits: _Hits, light: Light
    ) -> tuple[Float32[np.ndarray, " hits"], Float32[np.ndarray, " hits"]]:
        """Light on the surfaces if nothing threw a shadow, and with the shadows."""
        facing = np.maximum(hits.normal @ light.to_sun.astype(np.float32), 0.0)
        sunny = np.flatnonzero(facing > 0.0)
        start = hits.point[sunny] + _LIFT * hits.normal[sunny]
        ambient = light.ground + (light.sky - light.ground) * (0.5 + 0.5 * hits.normal[:, 2])
        open_air = (light.sun * facing + ambient).astype(np.float32)
        facing[sunny[self._in_shadow(start, light)]] = 0.0
        return open_air, (light.sun * facing + ambient).astype(np.float32)

    def _in_shadow(
        self, points: Float32[np.ndarray, "points 3"], light: Light
    ) -> Bool[np.ndarray, " points"]:
        """Whether something stands between a point and the sun."""
        if not self._any_caster or not len(points):
            return np.zeros(len(points), bool)
        toward = np.tile(light.to_sun.astype(np.float32), (len(points), 1))
        return self._casters.run(np.ascontiguousarray(points), toward, query="OCCLUDED") >= 0

    def albedo(self, hits: _Hits, focal: float) -> Float32[np.ndarray, "hits 3"]:
        """Colours of the surfaces where they were hit; `focal` in pixels."""
        color = np.array([s.color for s in self._surfaces], np.float32)[hits.surface]
        for index, surface in enumerate(self._surfaces):
            if surface.texture is None or surface.uv is None:
                continue
            here = np.flatnonzero(hits.surface == index)
            local = hits.corners[here] - self._first_vertex[index]
            uv = np.einsum("hk,hkx->hx", hits.weights[here], surface.uv[local])
            # Between the two sides of the ellipse a pixel covers on a slanted surface.
            metres = hits.depth[here] / focal / np.sqrt(np.maximum(hits.slant[here], 0.05))
            color[here] *= surface.texture.sample(uv, metres * surface.texels_per_metre)
        return color


def _texel_density(drawable: Drawable) -> float:
    """Texels per metre, on average over the surface."""
    if drawable.texture is None or drawable.uv is None:
        return 0.0
    h, w = drawable.texture.shape[:2]
    corners, flat = drawable.vertices[drawable.faces], (drawable.uv * [w, h])[drawable.faces]
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    p, q = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
    texels = np.abs(p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]).sum()
    return float(np.sqrt(texels / np.linalg.norm(np.cross(a, b), axis=1).sum()))


class MipMaps:
    """A repeating texture and its halved copies."""

    def __init__(self, texture: UInt8[np.ndarray, "h w 3"]) -> None:
        self._levels = [texture.astype(np.float32) / 255.0]
        while min(self._levels[-1].shape[:2]) > 1:
            h, w = (n // 2 for n in self._levels[-1].shape[:2])
            small = cv2.resize(self._levels[-1], (w, h), interpolation=cv2.INTER_AREA)
            self._levels.append(np.asarray(small, np.float32))

    def sample(
        self, uv: Float[np.ndarray, "n 2"], texels: Float[np.ndarray, " n"]
    ) -> Float32[np.ndarray, "n 3"]:
        """Colours at `uv`, each averaged over about `texels` texels of the full texture."""
        level = np.rint(np.log2(np.maximum(texels, 1.0))).astype(int)
        level = np.minimum(level, len(self._levels) - 1)
        out = np.empty((len(uv), 3), np.float32)
        for k in np.unique(level):
            here = level == k
            out[here] = _bilinear(self._levels[k], uv[here])
        return out


def _bilinear(
    image: Float32[np.ndarray, "h w 3"], uv: Float[np.ndarray, "n 2"]
) -> Float32[np.ndarray, "n 3"]:
    h, w = image.shape[:2]
    x, y = uv[:, 0] * w - 0.5, uv[:, 1] * h - 0.5
    x0, y0 = np.floor(x).astype(int), np.floor(y).astype(int)
    a, b = (x - x0)[:, None].astype(np.float32), (y - y0)[:, None].astype(np.float32)
    left, right, top, bottom = x0 % w, (x0 + 1) % w, y0 % h, (y0 + 1) % h
    upper = image[top, left] * (1 - a) + image[top, right] * a
    lower = image[bottom, left] * (1 - a) + image[bottom, right] * a
    return upper * (1 - b) + lower * b
