"""Both backends against pinhole geometry and against each other."""

import logging
import shutil
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from omomo_core.errors import InputError
from render import pyrender_backend
from render.backends import open_renderer
from render.cameras import Camera, look_at, orbit, pinhole
from render.renderer import Renderer
from render.scene import Drawable, Light, Scene, split_mesh

W, H = 321, 241
ORANGE = (0.9, 0.6, 0.3)
BACKENDS = ("pyrender", "raycast")
CUBE = np.array(trimesh.creation.box((2.0, 2.0, 2.0)).vertices)
CUBE_FACES = np.array(trimesh.creation.box().faces)
SQUARE = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
SQUARE_FACES = np.array([[0, 1, 2], [0, 2, 3]])


def box(half: tuple[float, float, float], middle: tuple[float, float, float]) -> Drawable:
    shape = split_mesh(CUBE * half + middle, CUBE_FACES)
    vertices, faces = shape.vertices, shape.faces
    return Drawable("box", vertices, faces, ORANGE)


def ground(half: float = 5.0) -> Drawable:
    return Drawable("ground", SQUARE * half, SQUARE_FACES, (0.8, 0.7, 0.6), casts_shadow=False)


def from_above(height: float = 5.0) -> Camera:
    """Looking straight down with world x to the right and y up in the picture."""
    T = np.eye(4)
    T[2, 3] = height
    return Camera(T, 200.0, 200.0, (W - 1) / 2, (H - 1) / 2)


def outline(depth: np.ndarray) -> np.ndarray:
    """Lowest and highest u and v of the pixels that see something."""
    v, u = np.nonzero(depth > 0)
    return np.array([u.min(), u.max(), v.min(), v.max()], float)


@pytest.fixture(scope="module", params=BACKENDS)
def renderer(request: pytest.FixtureRequest) -> Iterator[Renderer]:
    with open_renderer(W, H, request.param) as opened:
        yield opened


@pytest.mark.parametrize(
    "camera",
    [
        pinhole(orbit(np.array([0.1, 0.2, 0.6]), 4.0, 0.5, 0.4), 0.7, W, H),
        Camera(orbit(np.array([0.1, 0.2, 0.6]), 4.0, -2.0, 0.1), 260.0, 300.0, 190.0, 95.0),
    ],
)
def test_a_box_is_where_the_pinhole_says(renderer: Renderer, camera: Camera) -> None:
    thing = box((0.3, 0.2, 0.4), (0.1, 0.2, 0.6))
    renderer.show(Scene([thing]))
    _, depth = renderer.draw(camera)
    corners = camera.project(thing.vertices)
    low, high = corners[:, :2].min(axis=0), corners[:, :2].max(axis=0)
    expected = np.array([low[0], high[0], low[1], high[1]])
    assert np.abs(outline(depth) - expected).max() < 1.5


def test_depth_is_along_the_axis_in_metres(renderer: Renderer) -> None:
    renderer.show(Scene([ground()]))
    _, depth = renderer.draw(from_above(5.0))
    assert depth.shape == (H, W)
    assert np.abs(depth - 5.0).max() < 2e-3


def test_what_is_behind_the_camera_is_not_drawn(renderer: Renderer) -> None:
    renderer.show(Scene([box((0.3, 0.3, 0.3), (0.0, 0.0, 3.0))]))
    rgb, depth = renderer.draw(pinhole(look_at(np.zeros(3), np.array([0.0, 1, -1])), 0.9, W, H))
    assert (depth == 0).all()
    assert np.abs(rgb / 255.0 - Scene(()).background).max() < 0.005


def test_level_ground_in_the_sun_keeps_its_colour(renderer: Renderer) -> None:
    renderer.show(Scene([ground()]))
    rgb, _ = renderer.draw(from_above())
    assert np.abs(rgb / 255.0 - ground().color).max() < 0.01


def test_surfaces_show_their_hue_from_both_sides(renderer: Renderer) -> None:
    renderer.show(Scene([ground()]))
    rgb, _ = renderer.draw(pinhole(orbit(np.zeros(3), 4.0, 0.3, -0.6), 0.5, W, H))
    middle = rgb[H // 2, W // 2] / 255.0
    assert middle.min() > 0.2
    assert np.allclose(middle / middle[0], np.array([0.8, 0.7, 0.6]) / 0.8, atol=0.03)


def test_a_box_throws_a_shadow_away_from_the_sun(renderer: Renderer) -> None:
    light = Light(azimuth=np.pi, elevation=np.pi / 4)  # from -x: the shadow falls toward +x
    camera = from_above()
    u, v, _ = camera.project(np.array([0.85, 0.0, 0.0])).round().astype(int)
    renderer.show(Scene([ground(), box((0.2, 0.5, 0.5), (0.0, 0.0, 0.5))], light=light))
    shaded = renderer.draw(camera)[0]
    assert shaded[v, u, 0] / 255.0 == pytest.approx(0.8 * light.sky, abs=0.02)
    assert shaded[v, W - 1 - u, 0] / 255.0 == pytest.approx(0.8, abs=0.02)
    renderer.update("box", visible=False)
    assert renderer.draw(camera)[0][v, u, 0] / 255.0 == pytest.approx(0.8, abs=0.02)


def test_between_two_shadows_the_ground_is_lit(renderer: Renderer) -> None:
    light = Light(azimuth=np.pi, elevation=np.pi / 6)
    boxes = [
        replace(box((0.1, 0.1, 0.1), middle), name=f"box {k}")
        for k, middle in enumerate([(-0.6, -0.5, 0.4), (-0.6, 0.5, 0.6)])
    ]
    camera = from_above()
    renderer.show(Scene([ground(), *boxes], light=light))
    picture = renderer.draw(camera)[0] / 255.0
    dark = np.abs(picture - ground().color).max(axis=2) > 0.02
    for thing in boxes:
        # The box itself and where the sun throws it on the ground, with the soft edge.
        thrown = thing.vertices - thing.vertices[:, 2:] * (light.to_sun / light.to_sun[2])
        for points in (thing.vertices, thrown):
            u, v, _ = camera.project(points).T
            rows = slice(int(v.min()) - 4, int(v.max()) + 5)
            dark[rows, int(u.min()) - 4 : int(u.max()) + 5] = False
    assert not dark.any()


def test_shadows_are_the_same_where_pixels_cannot_share_what_they_sampled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scene = Scene([ground(), box((0.2, 0.5, 0.5), (0.0, 0.0, 0.5))], light=Light(azimuth=np.pi))
    with open_renderer(W, H, "pyrender", samples=0) as opened:
        opened.show(scene)
        shared = opened.color(from_above()).astype(int)
    folder = shutil.copytree(pyrender_backend.SHADERS, tmp_path / "shaders")
    text = (folder / "mesh.frag").read_text()
    without = text.replace("defined(GL_ARB_derivative_control)", "0").replace("#extension", "//")
    assert without != text
    (folder / "mesh.frag").write_text(without)
    monkeypatch.setattr(pyrender_backend, "SHADERS", folder)
    with open_renderer(W, H, "pyrender", samples=0) as opened:
        opened.show(scene)
        alone = opened.color(from_above()).astype(int)
    apart = np.abs(shared - alone).max(axis=2)
    assert apart.any()
    assert apart.mean() < 0.5
    assert np.mean(apart > 20) < 0.01


def test_a_closed_surface_looks_the_same_without_the_faces_that_look_away() -> None:
    thing = replace(box((0.3, 0.2, 0.4), (0.1, 0.2, 0.6)), closed=True)
    camera = pinhole(orbit(np.array([0.1, 0.2, 0.6]), 4.0, 0.5, 0.4), 0.7, W, H)
    with open_renderer(W, H, "pyrender", samples=0) as opened:
        opened.show(Scene([ground(), thing]))
        closed = opened.color(camera)
        opened.show(Scene([ground(), replace(thing, closed=False)]))
        assert np.array_equal(opened.color(camera), closed)
        opened.show(Scene([ground(), replace(thing, faces=thing.faces[:, ::-1], closed=True)]))
        assert not np.array_equal(opened.color(camera), closed)


def test_updates_happen_in_place(renderer: Renderer) -> None:
    camera = from_above()
    renderer.show(Scene([box((0.2, 0.2, 0.2), (0.0, 0.0, 0.0))]))
    still = outline(renderer.draw(camera)[1])
    T = np.eye(4)
    T[0, 3] = 0.5
    renderer.update("box", T_world=T)
    moved = outline(renderer.draw(camera)[1])
    step = 0.5 * 200.0 / 4.8
    assert moved - still == pytest.approx([step, step, 0, 0], abs=1.5)
    taller = box((0.2, 0.4, 0.2), (0.0, 0.0, 0.0)).vertices
    renderer.update("box", vertices=taller)
    grown = outline(renderer.draw(camera)[1])
    assert grown - moved == pytest.approx([0, 0, -0.2 * 200 / 4.8, 0.2 * 200 / 4.8], abs=1.5)
    renderer.update("box", color=np.array([0.1, 0.2, 0.9]))
    rgb, depth = renderer.draw(camera)
    red, _, blue = rgb[depth > 0].astype(float).mean(axis=0)
    assert blue > 4 * red
    renderer.update("box", visible=False)
    assert (renderer.draw(camera)[1] == 0).all()


def test_normals_follow_the_vertices(renderer: Renderer) -> None:
    light = Light(azimuth=0.0)
    renderer.show(Scene([ground()], light=light))
    level = renderer.draw(from_above())[0]
    slope = ground().vertices.copy()
    slope[:, 2] = 0.3 * slope[:, 0]  # turned away from a sun in +x
    renderer.update("ground", vertices=slope)
    tilted = renderer.draw(from_above())[0]
    assert tilted[H // 2, W // 2, 0] < level[H // 2, W // 2, 0] - 10


def test_a_texture_lies_the_right_way_round(renderer: Renderer) -> None:
    texture = np.zeros((9, 7, 3), np.uint8)  # odd sizes: rows are not multiples of four bytes
    texture[:4, :3] = [250, 0, 0]
    texture[5:, 4:] = [0, 0, 250]
    uv = np.array([[0.0, 1], [1, 1], [1, 0], [0, 0]])  # picture's top left at world (-1, 1)
    quad = Drawable("quad", SQUARE, SQUARE_FACES, uv=uv, texture=texture)
    renderer.show(Scene([quad]))
    camera = from_above()
    rgb, _ = renderer.draw(camera)
    for point, channel in (([-0.6, 0.6, 0.0], 0), ([0.6, -0.6, 0.0], 2)):
        u, v, _ = camera.project(np.array(point)).round().astype(int)
        assert rgb[v, u, channel] > 230
        assert rgb[v, u].sum() < 270


def test_an_unknown_name_is_an_error(renderer: Renderer) -> None:
    renderer.show(Scene([ground()]))
    with pytest.raises(KeyError):
        renderer.update("nobody", visible=False)


def test_backends_draw_the_same_picture() -> None:
    rng = np.random.default_rng(0)
    texture = np.kron(rng.integers(90, 250, (8, 8, 3)), np.ones((16, 16, 1))).astype(np.uint8)
    uv = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    floor = Drawable("floor", SQUARE * 1.5, SQUARE_FACES, uv=uv, texture=texture)
    scene = Scene([floor, box((0.3, 0.2, 0.4), (0.1, 0.2, 0.4))])
    camera = pinhole(orbit(np.array([0.0, 0.0, 0.3]), 5.0, -0.9, 0.5), 0.6, W, H)
    pictures = []
    for backend in BACKENDS:
        with open_renderer(W, H, backend) as renderer:
            renderer.show(scene)
            pictures.append(renderer.draw(camera))
    (rgb_a, a), (rgb_b, b) = pictures
    both = (a > 0) & (b > 0)
    assert ((a > 0) == (b > 0)).mean() > 0.98
    assert np.median(np.abs(a - b)[both]) < 0.01
    difference = np.abs(rgb_a.astype(int) - rgb_b).max(axis=-1)
    assert (difference < 12).mean() > 0.93


def test_of_surfaces_in_one_place_the_same_is_always_seen(renderer: Renderer) -> None:
    one = ground()
    sheets = [replace(one, name=f"sheet {k}", color=(k / 5, 0.5, 0.5)) for k in range(6)]
    seen: set[bytes] = set()
    for _ in range(6):
        renderer.show(Scene(sheets))
        seen.add(renderer.draw(from_above())[0].tobytes())
    assert len(seen) == 1


def test_two_renderers_live_side_by_side() -> None:
    with open_renderer(64, 48, "pyrender") as first:
        first.show(Scene([ground()]))
        with open_renderer(32, 24, "pyrender", samples=0) as second:
            second.show(Scene([ground()]))
            assert second.draw(from_above())[0].shape == (24, 32, 3)
        assert first.draw(from_above())[1].max() == pytest.approx(5.0, abs=1e-2)


def test_without_opengl_auto_falls_back(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setenv("EGL_DEVICE_ID", "99")  # no such graphics card
    with caplog.at_level(logging.WARNING), open_renderer(W, H) as renderer:
        renderer.show(Scene([ground()]))
        assert renderer.draw(from_above())[1].max() == pytest.approx(5.0, abs=1e-3)
    assert "libegl1" in caplog.text
    assert "libgl1" in caplog.text
    with pytest.raises(InputError, match="libegl1") as caught:
        open_renderer(W, H, "pyrender")
    assert caught.value.code == "no-opengl"
