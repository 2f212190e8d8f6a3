"""What is done in children: everything that opens a session, a mesh, a mount or a result.

Each function takes paths and numbers, writes what is large into a file that appears whole, and returns
what is small as JSON.
"""

import json
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from capture_app.inspection import Inspection, inspect_take
from capture_app.report_page import report_page
from capture_app.web.page_words import all_in_page_words, in_page_words
from capture_app.web.sandbox.report import own_motion, report_data
from ingest.animated.detect import is_animation
from ingest.formats.registry import check_is_session
from ingest.mesh import load_mesh
from ingest.mount_file import load_mount
from ingest.trajectory.trajectory_config import Reading
from omomo_core.errors import InputError
from omomo_core.whole_file import whole_file, write_whole


@dataclass(frozen=True)
class SessionInputs:
    """A session with the object, the mount and the reading that a run of it would use."""

    session: Path
    mesh: Path | None
    mount: Path | None
    mounted: bool
    """A mount was chosen, if only the identity, which is no file."""
    scale: float
    reading: Reading

    def inspect(self) -> Inspection:
        """Look it over.

        Raises:
            InputError: an input cannot be read at all.
        """
        return inspect_take(
            self.session, self.mesh, self.mount, reading=self.reading, mesh_scale=self.scale
        )


def inspect(seen: SessionInputs, data: Path, page: Path) -> dict[str, Any]:
    """Write the report on a session as JSON and, where a phone recorded it, as a page.

    Returns:
        Its headline.

    Raises:
        InputError: an input cannot be read at all.
    """
    animated = is_animation(seen.session, mounted=seen.mounted)
    try:
        looked = seen.inspect()
    except InputError:
        if not animated:
            raise
        found = own_motion()
    else:
        found = {**report_data(looked), "animated": animated}
        write_whole(page, in_page_words(report_page(looked), "run"))
    write_whole(data, json.dumps(found, allow_nan=False))
    return {key: found[key] for key in ("app", "seconds", "verdict")}


def check_session(recording: Path) -> dict[str, Any]:
    """Refuse a recording in which no reader finds one, of a phone or of an object's own motion.

    Raises:
        InputError: "session-unknown", or as `check_is_session`.
    """
    if not is_animation(recording, mounted=False):
        check_is_session(recording)
    return {}


def check_animated(session: Path, mounted: bool) -> dict[str, Any]:
    """Whether a recording is the object's own motion.

    Raises:
        InputError: as `is_animation`.
    """
    return {"animated": is_animation(session, mounted=mounted)}


def pack_session_scene(seen: SessionInputs, scene: Path) -> dict[str, Any]:
    """Write the scene of a session.

    Raises:
        InputError: an input cannot be read at all.
    """
    from capture_app.replay.scene_pack import pack_session

    return _written(scene, pack_session(seen.inspect(), words=_of_a_run))


def pack_object_scene(mesh: Path, scale: float, scene: Path) -> dict[str, Any]:
    """Write the scene of an object.

    Raises:
        InputError: as `load_mesh`.
    """
    from capture_app.replay.scene_pack import pack_object

    return _written(scene, pack_object(load_mesh(mesh, scale=scale)))


def pack_room_scene(source: Path, scene: Path) -> dict[str, Any]:
    """Write the scene of a room's mesh, or of the one in a session.

    Raises:
        InputError: as `room_view`.
    """
    from capture_app.replay.scene_pack import pack_object
    from ingest.scan.cut_surface import room_view

    return _written(scene, pack_object(room_view(source)))


def pack_mount_scene(mount: Path, mesh: Path, scale: float, scene: Path) -> dict[str, Any]:
    """Write the scene of a phone on its object.

    Raises:
        InputError: as `load_mount` and `load_mesh`.
    """
    from capture_app.replay.scene_pack import pack_object

    known = load_mount(mount)
    metric = load_mesh(mesh, scale=scale * known.object_scale)
    return _written(scene, pack_object(metric, known))


def pack_result_scene(result: Path, scene: Path) -> dict[str, Any]:
    """Write the scene of a result, without what the phone filmed.

    Raises:
        InputError: as `load_result`.
    """
    from capture_app.replay.scene_pack import pack_result
    from capture_app.result import load_result

    pack = pack_result(load_result(result), words=_of_a_run, film=False)
    return _written(scene, pack)


def pack_result_film(result: Path, film: Path) -> dict[str, Any]:
    """Write what the phone filmed during a result.

    Raises:
        InputError: as `load_result`.
    """
    from capture_app.replay.scene_pack import pack_film
    from capture_app.result import load_result

    return _written(film, pack_film(load_result(result)))


def share_result(result: Path, title: str, sample: int | None, page: Path) -> dict[str, Any]:
    """Write a result as one page that needs nothing else, and opens on this sample.

    Raises:
        InputError: as `load_result`, or "sample-missing".
    """
    from capture_app.replay.scene_pack import pack_result
    from capture_app.replay.share import share_page
    from capture_app.result import load_result

    pack = pack_result(load_result(result), name=title, words=_of_a_run, sample=sample)
    write_whole(page, share_page([pack], title=title))
    return {}


_of_a_run = partial(all_in_page_words, kind="run")


def _written(path: Path, content: bytes) -> dict[str, Any]:
    with whole_file(path) as partial:
        partial.write_bytes(content)
    return {}
