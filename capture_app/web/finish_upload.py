"""adopt: a whole upload becomes a session, an object, a mount, a video or a list of contacts."""

from pathlib import Path
from typing import Any

from capture_app.commands.inputs import ItemKind
from capture_app.library_item import FILES, Info, mesh_summary, mount_summary
from capture_app.web.library.shelf import content_of
from capture_app.web.library.uploads import Upload
from capture_app.web.problems import Refused
from capture_app.web.sandbox import work
from capture_app.web.site import Site
from ingest.mesh import FORMATS
from omomo_core.errors import InputError

VIDEOS = (".mp4", ".mov", ".m4v")
_ENDINGS: dict[ItemKind, tuple[str, ...]] = {
    "video": VIDEOS,
    "mount": (".json",),
    "contacts": (".json",),
}


def check_announced(upload: Upload, site: Site) -> None:
    """Refuse what is too much, or is nothing of its kind, before any of it is sent.

    Raises:
        Refused: 413, or 507 when the disk has no room.
        InputError: "upload-files": too few or too many files, or of another kind.
    """
    limits = site.limits
    most = {"object": limits.mesh, "mount": limits.small, "contacts": limits.small}
    most_of_one = min(limits.file, most.get(upload.kind, limits.file))
    largest = max((file.size for file in upload.files), default=0)
    for found, bound, what in (
        (len(upload.files), limits.files, "files"),
        (largest, most_of_one, "bytes in one file"),
        (upload.size, limits.upload, "bytes"),
    ):
        if found > bound:
            raise Refused(
                413,
                "upload-too-large",
                f"The upload has {found:,} {what}; at most {bound:,} are taken.",
                fix="Bring less at once.",
            )
    _check_files(upload)
    if upload.size + limits.spare > site.library.free:
        raise Refused(
            507,
            "disk-full",
            f"The upload needs {upload.size / 1e9:.2f} GB; the disk has "
            f"{site.library.free / 1e9:.2f} GB left.",
            fix="Delete what is not needed any more, or make room on the disk.",
        )


def _check_files(upload: Upload) -> None:
    names = [file.path for file in upload.files]
    if upload.kind == "object":
        main_mesh(upload)
    elif not names or (upload.kind in _ENDINGS and len(names) > 1):
        raise _files("Exactly one file is needed." if names else "There are no files in it.")
    endings = _ENDINGS.get(upload.kind)
    if endings and not names[0].lower().endswith(endings):
        raise _files(f"{names[0]!r:.90} is of another kind: {', '.join(endings)} is needed.")


def main_mesh(upload: Upload) -> str:
    """The mesh among an object's files; others are its materials and textures.

    Raises:
        InputError: "upload-files": there is none, or more than one.
    """
    found = [file.path for file in upload.files if file.path.lower().endswith(FORMATS)]
    if len(found) != 1:
        raise _files(f"It has {len(found)} meshes ({', '.join(FORMATS)}); one is needed.")
    return found[0]


def _files(what: str) -> InputError:
    return InputError("upload-files", what, fix="Choose the files again.")


async def finish_upload(site: Site, id_: str, scale: float) -> ItemKind:
    """Put a whole upload on its shelf; who asks again after that gets the same answer.

    Args:
        site: where it is.
        id_: the upload's, which becomes the thing's.
        scale: factor that brings an object to metres.

    Raises:
        Refused: 404, or 409 while files are missing.
        InputError: a mesh or a mount is no good, or no reader finds a recording; the upload is kept.
    """
    for kind, shelf in site.library.shelves.items():
        if (shelf.folder / id_).is_dir():
            return kind
    upload = site.library.uploads.get(id_)
    folder = site.library.uploads.complete(id_, upload)
    facts = await _facts(site, upload, folder / FILES, scale)
    info = Info(name=upload.name, size=upload.size, files=len(upload.files), facts=facts)
    site.library.shelves[upload.kind].put(id_, info, folder)
    return upload.kind


async def _facts(site: Site, upload: Upload, files: Path, scale: float) -> dict[str, Any]:
    if upload.kind == "object":
        mesh = main_mesh(upload)
        return {"mesh": mesh, **await site.sandbox.run(mesh_summary, files / mesh, scale)}
    if upload.kind == "mount":
        found = await site.sandbox.run(mount_summary, files / upload.files[0].path)
        return {**found, "object": None}
    if upload.kind == "session":
        await _check_session(site, content_of(files))
    return {}


async def _check_session(site: Site, recording: Path) -> None:
    """Refuse what is no recording; one that is damaged is kept, and its report says so."""
    try:
        await site.sandbox.run(work.check_session, recording)
    except InputError as error:
        if error.code == "session-unknown":
            raise
