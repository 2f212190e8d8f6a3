"""A server of the Model Context Protocol, for assistants; all paths lie in one folder.

The arguments of its tools are fields of the requests that the command line makes, too.
"""

import json
import logging
import os
import threading
from base64 import b64encode
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import anyio
import anyio.to_thread
import mcp_types as types
from mcp.server import Server, ServerRequestContext
from mcp.server.stdio import stdio_server
from pydantic import BaseModel, ValidationError, create_model

from capture_app.commands.export import ExportRequest
from capture_app.commands.inputs import typed_as
from capture_app.commands.reading import ReadingOptions
from capture_app.commands.render import RenderRequest
from capture_app.commands.request import first_problem
from capture_app.commands.run import IDENTITY, RunRequest, mount_file
from capture_app.manifest import MANIFEST, MOTION, read_manifest, to_look_at
from capture_app.progress import Progress
from omomo_core.errors import InputError, OmocapError, spelled

ABOUT = """omocap makes the motion of the person who moved an object from the log of a phone clamped to it.
Paths are relative to one folder."""
_PATHS = {
    "session": "What the phone's logger wrote (folder, pose file or archive), or the object's own motion.",
    "result": "Result folder that the tool `run` wrote.",
    "output": "File or folder to write, which is not there yet.",
}
"""Descriptions of fields that the command line describes elsewhere."""
_EVERY = 0.5
"""Seconds from one report of progress to the next."""
Blocks = Sequence[types.ContentBlock]
Context = ServerRequestContext[Any]


class _Stopped(BaseException):
    """Ends work whose request was cancelled; nothing but the server catches it."""


@dataclass(frozen=True)
class Bounds:
    """The folder in which everything is read and written."""

    root: Path
    """Absolute, without symbolic links."""

    def inside(self, said: str, *, read: bool = True) -> Path:
        """Return the path that a client means, relative to the folder.

        Raises:
            InputError: "path-outside": it is absolute, or it or, if it is read, a link in it leads out.
        """
        try:
            real = (self.root / said).resolve()
            links = _links_of(real, set()) if read and real.exists() else ()
            within = all(path.resolve().is_relative_to(self.root) for path in (real, *links))
        # A name that no file can have, or a circle of links.
        except (OSError, RuntimeError, ValueError):
            within, real = False, self.root
        if not within or Path(said).is_absolute():
            raise InputError(
                "path-outside",
                "This path, or a link in it, leads out of the folder of this server.",
                where=said,
                fix="Give a path relative to the folder, to something in it.",
            )
        return real

    def shown(self, path: Path) -> str:
        """Return a path as a client may say it."""
        return path.relative_to(self.root).as_posix()


def _links_of(path: Path, seen: set[Path]) -> Iterator[Path]:
    """Yield what is in a folder, or beside a file, and is or may be reached by a link."""
    if path.is_file():
        yield from (near for near in path.parent.iterdir() if near.is_symlink() and near.is_file())
        return
    seen.add(path)
    for child in path.iterdir():
        if child.is_symlink():
            yield child
        if child.is_dir() and (real := child.resolve()) not in seen:
            yield from _links_of(real, seen)


@dataclass(frozen=True)
class Tool:
    """One thing that a client may ask for."""

    model: type[BaseModel]
    work: Callable[[Bounds, Any, Progress], Blocks]
    """Its docstring is the tool's description."""
    hidden: str = ""
    """Fields of the model that clients do not say."""

    @property
    def schema(self) -> dict[str, Any]:
        """JSON schema of the arguments."""
        whole, offered = self.model.model_json_schema(), dict[str, Any]()
        for name, info in self.model.model_fields.items():
            text = _PATHS.get(name) or info.description
            if text and name not in self.hidden.split():
                offered[name] = whole["properties"][name] | {"description": text.replace("--", "")}
        required = [name for name in whole.get("required", ()) if name in offered]
        closed = {"properties": offered, "required": required, "additionalProperties": False}
        return {"type": "object", **closed, "$defs": whole.get("$defs", {})}

    def request(self, bounds: Bounds, said: dict[str, Any]) -> Any:
        """Return what is asked for, with absolute paths.

        Raises:
            InputError: "argument-invalid", "path-outside" or the model's own.
        """
        offered, known = self.schema["properties"], dict(said)
        for name, value in said.items():
            if name not in offered:
                fix = f"Its arguments are {', '.join(offered)}."
                raise InputError("argument-invalid", "No such argument.", field=name, fix=fix)
            kind = typed_as(self.model.model_fields[name].annotation)
            is_path = kind in (Path, Path | None) and isinstance(value, str)
            if is_path and (name, value) != ("mount", IDENTITY):
                known[name] = bounds.inside(value, read=name != "output")
        try:
            return self.model.model_validate(known)
        except ValidationError as error:
            name, problem = first_problem(error.errors())
            fix = "Correct this argument."
            raise InputError("argument-invalid", f"{problem}.", field=name, fix=fix) from error


def _inspect(bounds: Bounds, request: Any, progress: Progress) -> Blocks:
    """Check a recording: is it good, and what is to be done?"""
    from capture_app.inspection import inspect_take, inspection_data

    mount = mount_file(request.mount) if request.object else None
    reading, scale = request.reading, request.mesh_scale
    found = inspect_take(request.session, request.object, mount, reading=reading, mesh_scale=scale)
    return _json(inspection_data(found))


def _run(bounds: Bounds, request: RunRequest, progress: Progress) -> Blocks:
    """Make the motion of the person who moved the object: a result folder, in a minute or so."""
    from capture_app.pipeline import run_take
    from ingest.animated.detect import is_animation
    from ingest.formats.registry import check_there

    check_there(request.session)
    animated = is_animation(request.session, mounted=request.mount is not None)
    mount = None if animated else mount_file(request.mount)
    known = request.model_copy(update={"animated": animated, "mount": mount})
    manifest = run_take(known, progress).manifest
    findings = [finding.sentence for finding in manifest.findings]
    notes = [*findings, *manifest.grips, *manifest.notes, *manifest.faults]
    return _json(_about(bounds, request.output) | {"notes": notes})


def _list(bounds: Bounds, request: Any, progress: Progress) -> Blocks:
    """List the results in the folder."""
    found: list[dict[str, Any]] = []
    for place, folders, files in os.walk(bounds.root):
        folders[:] = sorted(name for name in folders if name[0] != ".")
        if {MANIFEST, MOTION} <= set(files):
            folders.clear()
            found.append(_about(bounds, Path(place)))
    return _json({"results": found})


def _about(bounds: Bounds, folder: Path) -> dict[str, Any]:
    shown = bounds.shown(folder)
    try:
        manifest = read_manifest(bounds.inside(shown) / MANIFEST)
    except InputError as error:
        return {"result": shown, "problem": error.what}
    told = {"result": shown, "created": str(manifest.created), "samples": len(manifest.scores)}
    return told | {"chosen": manifest.chosen + 1, "look_at": to_look_at(manifest)}


def _picture(bounds: Bounds, request: Any, progress: Progress) -> Blocks:
    """Draw a picture of a result."""
    from capture_app.rendering import render_result

    _own_body(bounds, request.result)
    with TemporaryDirectory(prefix=".picture", dir=bounds.root) as folder:
        file = Path(folder) / "still.png"
        still = request.still or 0.0
        render_result(request.model_copy(update={"output": file, "still": still}), progress)
        data = b64encode(file.read_bytes()).decode()
    return [types.ImageContent(type="image", data=data, mime_type="image/png")]


def _export(bounds: Bounds, request: Any, progress: Progress) -> Blocks:
    """Write a result for another program."""
    from capture_app.exports.export_sample import export_result

    _own_body(bounds, request.result)
    _check_new(request.output)
    made = export_result(request, progress)
    return _json({"files": [bounds.shown(path) for path in made.files], "notes": made.notes})


def _own_body(bounds: Bounds, result: Path) -> None:
    """Refuse a result on a body whose file lies elsewhere."""
    for item in read_manifest(result / MANIFEST).inputs:
        if item.role == "body" and not Path(item.path).resolve().is_relative_to(bounds.root):
            what = "The body of this result lies outside of the folder of this server."
            fix = "Copy the body's file into the folder, and run the take again with it."
            raise InputError("path-outside", what, where=item.path, fix=fix)


def _check_new(output: Path) -> None:
    """Refuse to write over what is there: recordings and meshes lie in the folder, too."""
    near = (path.name for path in (output.parent.iterdir() if output.parent.is_dir() else ()))
    if taken := [n for n in near if n == output.name or n.startswith(f"{output.stem}_object.")]:
        fix = "Choose another name with ‹output›."
        raise InputError("output-exists", "This is there already.", where=taken[0], fix=fix)


def _json(value: Any) -> Blocks:
    return _text(json.dumps(value, indent=1, ensure_ascii=False))


def _text(text: str) -> Blocks:
    return [types.TextContent(type="text", text=spelled(text, "`{}`".format))]


_OF_RUN = {
    name: RunRequest.model_fields[name] for name in ("session", "object", "mount", "mesh_scale")
}
_INSPECTED: Any = {name: (field.annotation, field) for name, field in _OF_RUN.items()}
_Inspect: Any = create_model("InspectArguments", __base__=ReadingOptions, **_INSPECTED)
_Picture: Any = create_model("PictureArguments", __base__=RenderRequest, output=(Path, Path()))
_NONE: Any = create_model("NoArguments")
TOOLS = {
    "inspect": Tool(_Inspect, _inspect),
    "run": Tool(RunRequest, _run),
    "list": Tool(_NONE, _list),
    "picture": Tool(_Picture, _picture, "output robot frames sheet smooth backend"),
    "export": Tool(ExportRequest, _export, "robot frames all_samples task blender"),
}


class _Watch:
    """The progress of work in a thread, and whether it shall stop."""

    def __init__(self) -> None:
        self.stop = threading.Event()
        self._stages: list[str] = []
        self._now = ("", 0.0)

    def __call__(self, stage: str, fraction: float) -> None:
        if self.stop.is_set():
            raise _Stopped
        if stage not in self._stages:
            self._stages.append(stage)
        self._now = (f"{stage} {fraction:.0%}", self._stages.index(stage) + fraction)

    async def tell(self, context: Context) -> None:
        """Report progress, which only grows; when cancelled, let the work stop."""
        told = 0.0
        try:
            while True:
                await anyio.sleep(_EVERY)
                message, done = self._now
                if done > told:
                    told = done
                    await context.session.report_progress(done, None, message)
        finally:
            self.stop.set()


async def _answer(
    bounds: Bounds, params: types.CallToolRequestParams, context: Context
) -> types.CallToolResult:
    """Return the result of a tool; it works in a thread, and what is wrong becomes an error of the tool."""
    watch, content, wrong = _Watch(), _text("Stopped."), True

    def work() -> Blocks:
        if (tool := TOOLS.get(params.name)) is None:
            fix = f"The tools are {', '.join(TOOLS)}."
            raise InputError("tool-unknown", "There is no such tool.", where=params.name, fix=fix)
        return tool.work(bounds, tool.request(bounds, params.arguments or {}), watch)

    async with anyio.create_task_group() as tasks:
        tasks.start_soon(watch.tell, context)
        try:
            content, wrong = await anyio.to_thread.run_sync(work), False
        except OmocapError as error:
            parts = {"where": error.where, "fix": error.fix, "code": error.code}
            lines = (f"{name}: {text}" for name, text in parts.items() if text)
            content = _text("\n".join([error.what, *lines]))
        except _Stopped:
            pass
        except Exception as error:
            logging.getLogger(__name__).exception("%s", params.name)
            content = _text(f"This is a defect of omocap: {type(error).__name__}.")
        tasks.cancel_scope.cancel()
    return types.CallToolResult(content=list(content), is_error=wrong)


def mcp_server(folder: Path) -> Server[Any]:
    """Return the server for one folder, which exists."""
    bounds = Bounds(folder.resolve())

    async def list_tools(context: Context, params: Any) -> types.ListToolsResult:
        offered = ((name, tool.work.__doc__, tool.schema) for name, tool in TOOLS.items())
        tools = [types.Tool(name=n, description=text, input_schema=s) for n, text, s in offered]
        return types.ListToolsResult(tools=tools)

    async def call_tool(context: Context, params: types.CallToolRequestParams) -> Any:
        return await _answer(bounds, params, context)

    return Server("omocap", instructions=ABOUT, on_list_tools=list_tools, on_call_tool=call_tool)


def serve_mcp(folder: Path) -> None:
    """Serve one client over stdin and stdout until it goes."""
    server = mcp_server(folder)

    async def serve() -> None:
        async with stdio_server() as (received, sent):
            await server.run(received, sent, server.create_initialization_options())

    anyio.run(serve)
