"""What this machine has and lacks to run omocap, as data."""

import platform
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, requires, version
from re import match
from typing import Literal

from omomo_core.errors import OmocapError
from omomo_core.system import free_memory, usable_cores

Level = Literal["ok", "warn", "bad"]

_ENOUGH_MEMORY = 4 * 2**30
"""Bytes: a take of a minute with four samples stays below this."""


@dataclass(frozen=True)
class HealthCheck:
    """One line of the examination."""

    name: str
    level: Level
    found: str
    fix: str = ""
    """What to do unless all is well."""


def examine() -> Iterator[HealthCheck]:
    """Look at the installation and the machine, one check after another."""
    yield HealthCheck("omocap", "ok", f"{version('omocap')}, Python {platform.python_version()}")
    for name, look in (
        ("packages", _packages),
        ("body", _body),
        ("weights", _weights),
        ("OpenGL", _opengl),
        ("video encoder", _encoder),
        ("memory", _memory),
        ("threads", _threads),
    ):
        yield _guarded(name, look)


def _guarded(name: str, look: Callable[[], HealthCheck]) -> HealthCheck:
    """A check that fails in a way nobody thought of is itself a finding."""
    try:
        return look()
    except OmocapError as error:
        return HealthCheck(name, "bad", error.what, error.fix)
    except Exception as error:
        return HealthCheck(name, "bad", f"{type(error).__name__}: {error}", "Install omocap again.")


def _packages() -> HealthCheck:
    """The packages omocap asks for itself, without those of its extras."""
    requirements = [line for line in requires("omocap") or [] if "extra ==" not in line]
    names = [found.group() for line in requirements if (found := match(r"[\w.-]+", line))]
    present: list[str] = []
    missing: list[str] = []
    for name in names:
        try:
            present.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            missing.append(name)
    if missing:
        fix = f"pip install {' '.join(missing)}"
        return HealthCheck("packages", "bad", f"missing: {', '.join(missing)}", fix)
    return HealthCheck("packages", "ok", ", ".join(present))


def _body() -> HealthCheck:
    from omomo_core.body.model import load_body

    body = load_body()
    return HealthCheck("body", "ok", f"{body.name}, {len(body.vertices)} vertices ({body.credit})")


def _weights() -> HealthCheck:
    from omomo_core.weights.load import SHIPPED, load_stages

    load_stages()
    files = sorted((SHIPPED / "capture").glob("*.safetensors"))
    sizes = ", ".join(f"{file.name} {file.stat().st_size / 1e6:.0f} MB" for file in files)
    return HealthCheck("weights", "ok", sizes)


def _opengl() -> HealthCheck:
    from render.backends import OPENGL_FIX, open_renderer

    try:
        with open_renderer(64, 64, "pyrender"):
            return HealthCheck("OpenGL", "ok", "offscreen pictures")
    except OmocapError as error:
        found = f"{error.what} Videos are drawn by the slower ray caster."
        return HealthCheck("OpenGL", "warn", found, OPENGL_FIX)


def _encoder() -> HealthCheck:
    import av
    from av.codec.codec import UnknownCodecError

    try:
        av.Codec("libx264", "w")
    except UnknownCodecError:
        return HealthCheck(
            "video encoder", "bad", "no H.264 (libx264)", "pip install --force-reinstall av"
        )
    return HealthCheck("video encoder", "ok", f"H.264 by PyAV {av.__version__}")


def _memory() -> HealthCheck:
    free = free_memory()
    if free is None:
        return HealthCheck("memory", "ok", "unknown on this system")
    free_text = f"{free / 2**30:.1f} GiB free"
    if free < _ENOUGH_MEMORY:
        return HealthCheck(
            "memory", "warn", free_text, "Close other programs, or run with ‹samples› 1."
        )
    return HealthCheck("memory", "ok", free_text)


def _threads() -> HealthCheck:
    import torch

    cores = usable_cores()
    threads = f"{torch.get_num_threads()} for torch on {cores} cores"
    if torch.get_num_threads() > cores:
        return HealthCheck("threads", "warn", threads, f"Set OMP_NUM_THREADS={cores}.")
    return HealthCheck("threads", "ok", threads)
