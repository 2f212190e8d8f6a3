"""Orders of calibrations, scans and overlays, with paths in the library in place of ids."""

import json
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from capture_app.calibration.ways.requests import (
    AnyWay,
    BoardWay,
    FloorWay,
    ScanWay,
    ScreenWay,
    SessionWay,
    TrackerWay,
)
from capture_app.jobs.orders import CalibrateOrder, OverlayOrder, ScanOrder
from capture_app.scanning.folder import IMAGES, MODEL
from capture_app.solid import Solid
from capture_app.web.library.library import Library
from capture_app.web.problems import Refused
from capture_app.web.routes.calibrations import (
    ByBoard,
    ByFloor,
    ByScan,
    ByScreen,
    BySession,
    ByTracker,
    Matrix,
)
from capture_app.web.routes.orders import Overlay, Scan
from capture_app.web.sources import scan_of, solid_of

_Given = ByBoard | BySession | ByScan | ByScreen | ByTracker | ByFloor


def calibrate_order(library: Library, id_: str, given: _Given) -> CalibrateOrder:
    """A calibration; its mount has the job's id.

    Raises:
        Refused: 404 when something that it needs is not there.
    """
    solid = solid_of(library, given.object)
    return CalibrateOrder(
        name=given.name,
        output=library.shelves["mount"].folder / id_,
        facts={"object": given.object},
        way=_Ways(library, id_, solid, given.phone).way(given),
    )


class _Ways:
    """What the ways share: the object, the phone, and where notes go."""

    def __init__(self, library: Library, id_: str, solid: Solid, phone: str) -> None:
        self._library, self._id = library, id_
        self._common: dict[str, Any] = {
            "object": solid.path,
            "mesh_scale": solid.scale,
            "phone": phone,
        }

    def way(self, given: _Given) -> AnyWay:
        """By its method."""
        match given:
            case ByBoard():
                return self._board(given)
            case BySession():
                return self._session(given)
            case ByScan():
                return self._scan(given)
            case ByScreen():
                return self._screen(given)
            case ByTracker():
                return self._tracker(given)
            case ByFloor():
                return self._floor(given)

    def _board(self, given: ByBoard) -> BoardWay:
        return BoardWay(
            **self._common,
            session=self._log(given.session),
            film=self._library.content(given.film, "video", "session", "material"),
            board=given.board,
            place=self._note("place.json", given.place),
            camera=None if given.camera is None else self._note("camera.json", given.camera),
        )

    def _session(self, given: BySession) -> SessionWay:
        scan = given.scan
        return SessionWay(
            **self._common,
            session=self._log(given.session),
            scan=None if scan is None else self._library.content(scan, "material", "object"),
            board=given.board,
            place=None if given.place is None else self._note("place.json", given.place),
            clamped_at=given.clamped_at,
        )

    def _scan(self, given: ByScan) -> ScanWay:
        images = None
        if given.model is None:
            folder = scan_of(self._library, given.object)
            model, images = folder / MODEL, folder / IMAGES
        else:
            model = self._library.content(given.model, "material")
        return ScanWay(
            **self._common,
            session=self._log(given.session),
            model=model,
            images=images,
            to_object=self._matrix("model_to_object.txt", given.model_to_object),
            clamped_at=given.clamped_at,
        )

    def _screen(self, given: ByScreen) -> ScreenWay:
        return ScreenWay(
            **self._common,
            photos=self._library.content(given.photos, "material"),
            ruler=given.ruler,
            board=given.board,
            place=self._note("place.json", given.place),
            camera=None if given.camera is None else self._note("camera.json", given.camera),
            turned=given.turned,
        )

    def _tracker(self, given: ByTracker) -> TrackerWay:
        return TrackerWay(
            **self._common,
            session=self._log(given.session),
            poses=self._library.content(given.poses, "material"),
            body=self._matrix("body.txt", given.body),
        )

    def _floor(self, given: ByFloor) -> FloorWay:
        return FloorWay(
            **self._common,
            mount=self._library.content(given.mount, "mount"),
            session=self._log(given.session),
            phone_height=given.phone_height,
        )

    def _log(self, session: str) -> Path:
        return self._library.content(session, "session")

    def _note(self, name: str, said: BaseModel) -> Path:
        return _note(self._library, self._id, name, said)

    def _matrix(self, name: str, rows: Matrix | None) -> Path | None:
        if rows is None:
            return None
        text = "\n".join(" ".join(map(repr, row)) for row in rows)
        return self._library.notes.write(self._id, name, f"{text}\n")


def scan_order(library: Library, id_: str, given: Scan) -> ScanOrder:
    """A scan; its object has the job's id.

    Raises:
        Refused: 404 when the source is not there.
    """
    return ScanOrder(
        output=library.shelves["object"].folder / id_,
        source=library.content(given.source, "session", "video", "material"),
        **given.model_dump(exclude={"kind", "source"}),
    )


def overlay_order(library: Library, id_: str, given: Overlay) -> OverlayOrder:
    """A result drawn into a film.

    Raises:
        Refused: 404 when the result or the film is not there; 422 for a board in the room whose place
            on the object is given.
    """
    results = library.results
    if given.place is not None and given.board_at == "room":
        raise Refused(
            422,
            "overlay-board-place",
            "A board that lies in the room has no place on the object.",
            where="place",
            fix="Leave its place out: the clamped phone saw the board, too.",
        )
    place, camera = given.place, given.camera
    return OverlayOrder(
        name=f"{results.get(given.result).name} in the film",
        output=results.make_exports(given.result) / f"overlay-{id_}.mp4",
        result=results.content(given.result),
        video=None if given.video is None else library.content(given.video, "video", "session"),
        camera=None if camera is None else _note(library, id_, "camera.json", camera),
        board_place=None if place is None else _note(library, id_, "place.json", place),
        in_room=given.board_at == "room",
        **given.model_dump(
            include={"board", "shared_world", "offset", "thing", "opacity", "wipe", "sample"}
        ),
    )


def _note(library: Library, id_: str, name: str, said: BaseModel) -> Path:
    text = json.dumps(said.model_dump(mode="json", exclude_none=True))
    return library.notes.write(id_, name, text)
