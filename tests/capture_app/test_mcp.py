"""The tools of `omocap mcp`, asked by the client of the protocol's own SDK, which starts the command."""

import json
import shutil
import sys
from base64 import b64decode
from collections.abc import Awaitable, Callable
from io import BytesIO
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from capture_app.cli.app import invoke
from capture_app.simulator.demo_take import DEMO, MESH, MOUNT, SESSION

anyio = pytest.importorskip("anyio")
mcp = pytest.importorskip("mcp")

TAKE: dict[str, Any] = {"session": SESSION, "object": MESH, "mount": MOUNT}
FAST: dict[str, Any] = {**TAKE, "samples": 1, "steps": 2, "video_size": None}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The folder of the server, beside a file that it must not read."""
    (tmp_path / "secret.obj").write_text((DEMO / MESH).read_text())
    inside = tmp_path / "takes"
    shutil.copytree(DEMO, inside)
    return inside


def ask(folder: Path, questions: Callable[[Any], Awaitable[None]]) -> None:
    """Start the command for a folder, and ask it."""
    start = "from capture_app.cli.start import main; main()"
    words = ["-c", start, "mcp", "--folder", str(folder)]
    server = mcp.StdioServerParameters(command=sys.executable, args=words)

    async def talk() -> None:
        async with mcp.Client(server) as client:
            await questions(client)

    anyio.run(talk)


async def text(client: Any, tool: str, **said: Any) -> str:
    """What a tool answers; what is wrong begins with "wrong: "."""
    answer = await client.call_tool(tool, said)
    return ("wrong: " if answer.is_error else "") + answer.content[0].text


@pytest.mark.runs("mcp", elsewhere=True)
def test_it_inspects_and_says_what_is_wrong(folder: Path) -> None:
    async def questions(client: Any) -> None:
        tools = {tool.name: tool.input_schema for tool in (await client.list_tools()).tools}
        assert list(tools) == ["inspect", "run", "list", "picture", "export"]
        asked = tools["run"]["properties"]
        assert asked["samples"]["maximum"] == 64
        assert "best is chosen" in asked["samples"]["description"]
        assert "robot" not in tools["export"]["properties"]
        found = json.loads(await text(client, "inspect", **TAKE))
        assert (found["verdict"], found["usable"]) == ("good", True)
        said = await text(client, "run", session=SESSION, object=MESH, output="out")
        assert said.startswith("wrong: The mount is not given")
        assert "where: `mount`" in said
        assert "fix: Find it once" in said
        assert "code: mount-needed" in said
        said = await text(client, "run", **FAST | {"samples": 65}, output="out")
        assert "less than or equal to 64" in said
        assert "where: `samples`" in said
        assert "argument-invalid" in await text(client, "run", **FAST, output="out", blender="sh")
        assert "has no manifest" in await text(client, "picture", result=SESSION)
        assert json.loads(await text(client, "list")) == {"results": []}
        assert "tool-unknown" in await text(client, "shell")

    ask(folder, questions)
    assert sorted(path.name for path in folder.iterdir()) == sorted((SESSION, MESH, MOUNT))


def test_nothing_outside_of_the_folder_is_read_or_written(folder: Path) -> None:
    secret = folder.parent / "secret.obj"
    (folder / "link.obj").symlink_to(secret)
    (folder / "away").symlink_to(folder.parent)
    (folder / "circle").symlink_to("circle")
    (folder / "linked").mkdir()
    for file in (folder / SESSION).iterdir():
        (folder / "linked" / file.name).symlink_to(DEMO / SESSION / file.name)
    (folder / "around").mkdir()
    (folder / "around" / "again").symlink_to(folder / "linked")
    outside = [
        ("inspect", {"session": str(folder / SESSION)}),
        ("inspect", {"session": "linked"}),
        ("inspect", {"session": "around"}),
        ("inspect", {"session": "circle"}),
        ("inspect", {"session": "nul\0"}),
        ("inspect", {**TAKE, "object": "../secret.obj"}),
        ("inspect", {**TAKE, "object": "link.obj"}),
        ("inspect", {**TAKE, "object": "away/secret.obj"}),
        ("inspect", {**TAKE, "mount": "../takes/../secret.obj"}),
        ("run", {**FAST, "output": "../out"}),
        ("run", {**FAST, "output": "away/out"}),
        ("run", {**FAST, "output": str(folder / "out")}),
    ]

    async def questions(client: Any) -> None:
        for tool, said in outside:
            assert "code: path-outside" in await text(client, tool, **said), said

    ask(folder, questions)
    assert sorted(path.name for path in folder.parent.iterdir()) == ["secret.obj", "takes"]


@pytest.mark.slow
def test_it_runs_lists_draws_and_exports(folder: Path) -> None:
    heard: list[tuple[float, str]] = []

    async def hear(done: float, whole: float | None, message: str | None) -> None:
        heard.append((done, message or ""))

    async def questions(client: Any) -> None:
        asked = {**FAST, "steps": 30, "samples": 4, "output": "out"}
        made = await client.call_tool("run", asked, progress_callback=hear)
        assert not made.is_error
        assert json.loads(made.content[0].text)["samples"] == 4
        listed = json.loads(await text(client, "list"))["results"]
        assert [(found["result"], found["samples"]) for found in listed] == [("out", 4)]
        drawn = await client.call_tool("picture", {"result": "out", "still": 3, "size": "320x180"})
        with Image.open(BytesIO(b64decode(drawn.content[0].data))) as picture:
            assert (picture.size, drawn.content[0].mime_type) == ((320, 180), "image/png")
        for output in (".", f"{SESSION}/odometry.csv"):
            said = await text(client, "export", result="out", output=output, to="csv")
            assert "output-exists" in said
        written = json.loads(await text(client, "export", result="out", output="out.bvh"))
        assert written["files"] == ["out.bvh", "out_object.bvh", "out_contacts.csv"]
        assert "output-exists" in await text(client, "export", result="out", output="out.bvh")
        manifest = json.loads((folder / "out/manifest.json").read_text())
        elsewhere = str(folder.parent / "smplx.npz")
        manifest["inputs"].append({**manifest["inputs"][0], "role": "body", "path": elsewhere})
        (folder / "out/manifest.json").write_text(json.dumps(manifest))
        assert "The body of this result" in await text(client, "picture", result="out")

    ask(folder, questions)
    assert (folder / "out.bvh").read_text().startswith("HIERARCHY")
    assert [done for done, _ in heard] == sorted({done for done, _ in heard})
    assert any(message.startswith("hands ") for _, message in heard)


@pytest.mark.slow
def test_a_run_is_cancelled(folder: Path) -> None:
    async def questions(client: Any) -> None:
        begun = anyio.Event()

        async def hear(done: float, whole: float | None, message: str | None) -> None:
            begun.set()

        async def run() -> None:
            asked = {**FAST, "steps": 1000, "samples": 16, "output": "out"}
            await client.call_tool("run", asked, progress_callback=hear)

        async with anyio.create_task_group() as tasks:
            tasks.start_soon(run)
            await begun.wait()
            assert list(folder.glob(".out.*.part"))
            tasks.cancel_scope.cancel()
        with anyio.fail_after(30):
            while list(folder.glob("*out*")) + list(folder.glob(".*")):
                await anyio.sleep(0.1)
        assert json.loads(await text(client, "list")) == {"results": []}

    ask(folder, questions)


def test_a_missing_folder_and_a_missing_extra_are_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert invoke(["mcp", "--folder", str(tmp_path / "none")]) == 2
    assert "--folder" in capsys.readouterr().err
    monkeypatch.setitem(sys.modules, "mcp.server", None)
    monkeypatch.delitem(sys.modules, "capture_app.mcp_server", raising=False)
    assert invoke(["mcp", "--folder", str(tmp_path)]) == 2
    assert "pip install '.[mcp]'" in capsys.readouterr().err
