"""to_order: what a client orders, with paths in the library in place of ids."""

import json
from dataclasses import replace
from typing import cast

from capture_app.commands.calibrate import AnyWay, CalibrateRequest, ScanWay
from capture_app.commands.export import ExportFormat, ExportRequest
from capture_app.commands.overlay import OverlayRequest
from capture_app.commands.render import CompareRequest, RenderRequest
from capture_app.commands.request import Request
from capture_app.commands.run import ResolveRequest, RunRequest
from capture_app.commands.scan import ScanRequest
from capture_app.exports.export_formats import layout_of
from capture_app.exports.fbx import find_blender
from capture_app.library_item import Info
from capture_app.manifest import MANIFEST, chosen_sample, read_manifest
from capture_app.web import sandboxed_work
from capture_app.web.library import Library, Results
from capture_app.web.problems import Refused
from capture_app.web.routes.orders import (
    WAYS,
    Calibration,
    Compare,
    Export,
    Ordered,
    Overlay,
    Render,
    Resolve,
    Run,
    Scan,
    with_paths,
)
from capture_app.web.routes.reports import inspected
from capture_app.web.site import Site
from capture_app.web.sources import (
    IDENTITY,
    ReadAs,
    mesh_file_of,
    mount_of,
    scan_of,
    seen_with,
)
from omomo_core.whole_file import write_whole

_VIDEO = (960, 540)


async def to_order(site: Site, id_: str, given: Ordered) -> Request:
    """The order of a job whose id is known; a new result has the job's id.

    Raises:
        Refused: 404 when something that it needs is not there.
        InputError: a recording cannot be read at all.
    """
    library = site.library
    match given:
        case Run():
            return await _run(site, id_, given)
        case Resolve():
            return _resolve(library.results, id_, given)
        case Export():
            return _export(library, id_, given)
        case Render():
            return _render(library.results, id_, given)
        case Compare():
            return _compare(library.results, id_, given)
        case Overlay():
            return _overlay(library, id_, given)
        case Scan():
            return _scan(library, id_, given)
        case _:
            return _calibrate(library, id_, given)


async def _run(site: Site, id_: str, given: Run) -> RunRequest:
    library, shelves = site.library, site.library.shelves
    session = shelves["session"].content(given.session)
    mount = mount_of(library, given.mount)
    contacts = None if given.contacts is None else shelves["contacts"].content(given.contacts)
    mesh_file = None if given.object is None else mesh_file_of(library, given.object)
    kind = await site.sandbox.run(sandboxed_work.check_animated, session, given.mount is not None)
    if not kind["animated"]:
        _check_whole(given)
        await _refuse_unusable(site, given)
    name = given.name or shelves["session"].get(given.session).name
    facts = {"session": given.session, "object": given.object, "mount": given.mount, "parent": None}
    library.results.announce(id_, Info(name=name, facts=facts))
    options = given.options.model_dump(exclude={"video"})
    return RunRequest(
        name=name,
        output=library.results.place(id_),
        session=session,
        object=mesh_file.path if mesh_file else None,
        mesh_scale=mesh_file.scale if mesh_file else 1.0,
        mount=mount,
        contacts=contacts,
        animated=kind["animated"],
        video_size=_VIDEO if given.options.video else None,
        **options,
    )


async def _refuse_unusable(site: Site, given: Run) -> None:
    """Refuse at once what the run would refuse later; the report is mostly there already.

    Raises:
        InputError: as `usable_take`.
    """
    options = given.options
    if options.force and not options.strict:
        return
    said = ReadAs(object=given.object, mount=given.mount)
    seen = replace(seen_with(site.library, given.session, said), reading=options.reading)
    report = json.loads((await inspected(site, given.session, seen)).read_bytes())
    if report["verdict"] == "not usable" or (options.strict and report["verdict"] != "good"):
        await site.sandbox.run(sandboxed_work.refuse_unusable, seen, options.force, options.strict)


def _check_whole(given: Run) -> None:
    """Refuse to make a motion of a phone's log alone.

    Raises:
        Refused: 422, "object-needed" or "mount-needed".
    """
    if given.object is None:
        raise Refused(
            422,
            "object-needed",
            "The object is not given; a phone's log has none.",
            where="object",
            fix="Bring the mesh of what the phone was clamped to.",
        )
    if given.mount is None:
        raise Refused(
            422,
            "mount-needed",
            "The mount is not given: nothing says where the phone sat on the object.",
            where="mount",
            fix="Choose or find the mount. Only if the mesh was made in the axes of the phone's camera, "
            f'say that the mesh is in the phone\'s own frame: "mount": "{IDENTITY}".',
        )


def _resolve(results: Results, id_: str, given: Resolve) -> ResolveRequest:
    before = results.get(given.result)
    _check_sample(results, given.result, given.sample)
    name = given.name or f"{before.name}, corrected"
    contacts = results.contacts(id_)
    write_whole(contacts, json.dumps(given.contacts, allow_nan=False))
    results.announce(id_, Info(name=name, facts={**before.facts, "parent": given.result}))
    return ResolveRequest(
        name=name,
        output=results.place(id_),
        result=results.content(given.result),
        contacts=contacts,
        sample=given.sample,
        video_size=_VIDEO if given.video else None,
    )


def _export(library: Library, id_: str, given: Export) -> ExportRequest:
    results, said = library.results, with_paths(library, id_, given, ExportRequest)
    _check_sample(results, given.result, said.get("sample"))
    if given.to == ExportFormat.fbx:
        find_blender(None)
    sample = _sample(said.get("sample"))
    words = [given.to, said["bones"].value, f"{said['fps']}fps", *sample, id_]
    said |= {
        "name": f"{results.get(given.result).name} as {given.to}",
        "output": results.make_exports(given.result)
        / f"{'-'.join(words)}{layout_of(given.to).endings[0]}",
        "result": results.content(given.result),
    }
    return ExportRequest(**said)


def _render(results: Results, id_: str, given: Render) -> RenderRequest:
    _check_sample(results, given.result, given.sample)
    words = [given.view, *_sample(given.sample), id_]
    return RenderRequest(
        name=f"{results.get(given.result).name}, seen {given.view}",
        output=results.make_exports(given.result) / f"{'-'.join(words)}.mp4",
        result=results.content(given.result),
        **given.model_dump(exclude={"kind", "result"}),
    )


def _compare(results: Results, id_: str, given: Compare) -> CompareRequest:
    names = [results.get(result).name for result in given.results]
    return CompareRequest(
        name=f"{names[0]} and {len(names) - 1} more, compared",
        output=results.make_exports(given.results[0]) / f"compare-{id_}.mp4",
        motions=tuple(str(results.content(result)) for result in given.results),
        samples=given.samples,
    )


def _overlay(library: Library, id_: str, given: Overlay) -> OverlayRequest:
    results, said = library.results, with_paths(library, id_, given, OverlayRequest)
    _check_sample(results, given.result, said.get("sample"))
    if "board_place" in said and said["board_at"] == "room":
        raise Refused(
            422,
            "overlay-board-place",
            "A board that lies in the room has no place on the object.",
            where="place",
            fix="Leave its place out: the clamped phone saw the board, too.",
        )
    said |= {
        "name": f"{results.get(given.result).name} in the film",
        "output": results.make_exports(given.result) / f"overlay-{id_}.mp4",
        "result": results.content(given.result),
    }
    return OverlayRequest(**said)


def _scan(library: Library, id_: str, given: Scan) -> ScanRequest:
    """A scan; its object has the job's id."""
    output = library.shelves["object"].folder / id_
    return ScanRequest(output=output, **with_paths(library, id_, given, ScanRequest))


def _calibrate(library: Library, id_: str, given: Calibration) -> CalibrateRequest:
    """A calibration; its mount has the job's id."""
    mesh_file, way = mesh_file_of(library, given.object), WAYS[type(given)]
    if way is ScanWay and getattr(given, "model", None) is None:
        scan_of(library, given.object)
    said = with_paths(library, id_, given, way)
    said |= {"object": mesh_file.path, "mesh_scale": mesh_file.scale}
    return CalibrateRequest(
        name=given.name,
        output=library.shelves["mount"].folder / id_,
        facts={"object": given.object},
        way=cast("AnyWay", way(**said)),
    )


def _check_sample(results: Results, id_: str, number: int | None) -> None:
    """Refuse a sample that a result does not have.

    Raises:
        InputError: "sample-missing".
    """
    folder = results.content(id_)
    chosen_sample(read_manifest(folder / MANIFEST), number, folder)


def _sample(number: int | None) -> list[str]:
    return [] if number is None else [f"sample{number}"]
