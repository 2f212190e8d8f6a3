"""The page on which points of the phone are matched with points clicked on the object's mesh."""

from collections.abc import Callable, Sequence
from threading import Event
from typing import TYPE_CHECKING, Any

import numpy as np

from capture_app.calibration.picking import ENOUGH, POINTS, Picking
from ingest.calibration.points.correspondences import PointPair
from omomo_core.motion import ObjectMesh

if TYPE_CHECKING:
    from viser import SceneClickEvent, ViserServer

HOST = "127.0.0.1"
_HELP = """**Match points of the phone with the object.**

1. Choose a point of the phone. Left and right are as you look at its screen, top is the end with
   the front camera.
2. Click where it is on the object (drag to turn, scroll to come nearer).
3. Three points that are not in a line are enough; four or five, far apart, show mistakes.
"""
_COLOUR, _MARK = (150, 165, 180), (230, 80, 30)


class PickPage:
    """One mesh, one list of pairs, one browser page; `wait` ends when the person is done."""

    def __init__(self, mesh: ObjectMesh, *, port: int = 0, sigma: float | None = None) -> None:
        from viser import ViserServer

        self.picking = Picking(mesh) if sigma is None else Picking(mesh, sigma)
        self._size = float(np.ptp(mesh.vertices, axis=0).max())
        self._done = Event()
        self._marks: list[Any] = []
        self._server = ViserServer(host=HOST, port=port, label="omocap: points", verbose=False)
        _show(self._server, mesh, self._size)
        gui = self._server.gui
        gui.configure_theme(show_share_button=False)  # it would send the page to another server
        gui.add_markdown(_HELP)
        self._name = gui.add_dropdown("Point of the phone", POINTS, initial_value=POINTS[0])
        self._list = gui.add_markdown("")
        undo = gui.add_button("Undo", hint="Forget the last point.")
        self._finish = gui.add_button("Finish", color="green")
        undo.on_click(lambda _: self.undo())
        self._finish.on_click(lambda _: self.finish())
        self._server.scene.on_click()(self.click)
        self._update()

    @property
    def address(self) -> str:
        """What to open in the browser."""
        return f"http://{HOST}:{self._server.get_port()}"

    def click(self, event: "SceneClickEvent") -> None:
        """Match the chosen point with what was clicked, and offer the next one."""
        if self.picking.pick(self._name.value, event.ray_origin, event.ray_direction) is None:
            return
        if self.picking.left:
            self._name.value = self.picking.left[0]
        self._update()

    def undo(self) -> None:
        """Forget the last point, and offer it again."""
        if self.picking.pairs:
            self._name.value = self.picking.pairs[-1].name
        self.picking.undo()
        self._update()

    def finish(self) -> None:
        """End `wait`, if there are pairs enough."""
        if self.picking.enough:
            self._done.set()

    def wait(self) -> Sequence[PointPair]:
        """The pairs, once Finish was pressed."""
        while not self._done.wait(0.2):  # in short waits, so that Ctrl-C ends it
            pass
        return self.picking.pairs

    def close(self) -> None:
        """Stop serving."""
        self._server.stop()

    def _update(self) -> None:
        for mark in self._marks:
            mark.remove()
        self._marks = [m for k, pair in enumerate(self.picking.pairs) for m in self._mark(k, pair)]
        rows = "\n".join(
            f"| {k + 1} | {pair.name} | {' '.join(f'{x:.3f}' for x in pair.object)} |"
            for k, pair in enumerate(self.picking.pairs)
        )
        missing = ENOUGH - len(self.picking.pairs)
        more = f"\n\n{missing} more at least." if missing > 0 else ""
        self._list.content = f"| | point | on the object (m) |\n|-|-|-|\n{rows}{more}"
        self._finish.disabled = not self.picking.enough

    def _mark(self, k: int, pair: PointPair) -> tuple[Any, Any]:
        scene, radius = self._server.scene, 0.012 * self._size
        ball = scene.add_icosphere(
            f"/picked/{k}/point", radius=radius, color=_MARK, position=pair.object
        )
        text = f"{k + 1} {pair.name}"
        label = scene.add_label(f"/picked/{k}/name", text, position=pair.object)
        return ball, label


def _show(server: "ViserServer", mesh: ObjectMesh, size: float) -> None:
    """The mesh in its own frame, with its axes, seen from a corner."""
    vertices = mesh.vertices.astype(np.float32)
    middle = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
    eye = middle + 1.15 * size * np.array([0.7, -0.8, 0.5])
    server.initial_camera.position = eye.astype(np.float64)
    server.initial_camera.look_at = middle.astype(np.float64)
    server.initial_camera.near = 0.01 * size
    server.scene.add_mesh_simple(
        "/object", vertices, mesh.faces.astype(np.uint32), color=_COLOUR, side="double",
        flat_shading=True,
    )  # fmt: skip
    server.scene.add_frame(
        "/axes", axes_length=0.15 * size, axes_radius=0.003 * size, origin_radius=0.006 * size
    )


def pick_points(
    mesh: ObjectMesh, tell: Callable[[str], None], *, sigma: float | None = None
) -> Sequence[PointPair]:
    """Let a person match points of the phone with the mesh in a browser.

    Args:
        mesh: of the object, metres.
        tell: is given the address to open.
        sigma: of a picked point along each axis, metres.
    """
    page = PickPage(mesh, sigma=sigma)
    try:
        tell(page.address)
        return page.wait()
    finally:
        page.close()
