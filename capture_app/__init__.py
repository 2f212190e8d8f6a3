"""What people touch: command line, page, results, exports, the phone simulator; and the Python API.

The names of `__all__` are the API; docs/python.md lists them with shapes and units. Each is imported from
where it stands when it is first used, so that `import capture_app` takes no time.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from capture_app.calibration.calibrate import calibrate
    from capture_app.commands.calibrate import TrackerWay
    from capture_app.commands.export import ExportRequest
    from capture_app.commands.render import CompareRequest, RenderRequest
    from capture_app.commands.run import ResolveRequest, RunRequest
    from capture_app.commands.train import TrainRequest
    from capture_app.comparison.comparison_film import compare_motions
    from capture_app.exports.export_sample import export_result
    from capture_app.inspection import inspect_take
    from capture_app.pipeline import run_take
    from capture_app.rendering import render_result
    from capture_app.resolve import resolve_result
    from capture_app.result import Result, load_result
    from capture_app.solve_samples import solved_result
    from capture_app.training import train
    from ingest.formats.registry import read_session, register_format
    from ingest.mesh import load_mesh
    from ingest.mount import Mount
    from ingest.mount_file import load_mount, save_mount
    from ingest.session import CaptureSession
    from ingest.trajectory.object_motion import to_object_motion
    from ingest.trajectory.trajectory_config import Reading
    from omomo_core.body.model import load_body
    from omomo_core.errors import InputError
    from omomo_core.generation.generation_options import GenerationOptions
    from omomo_core.generation.generator import generate
    from omomo_core.generation.stream import stream
    from omomo_core.learning.evaluation.evaluation import evaluate
    from omomo_core.learning.recordings.clips import Clip, save_clips
    from omomo_core.motion import HumanMotion, ObjectMesh, ObjectMotion
    from omomo_core.weights.load import load_stages

__all__ = [
    "CaptureSession",
    "Clip",
    "CompareRequest",
    "ExportRequest",
    "GenerationOptions",
    "HumanMotion",
    "InputError",
    "Mount",
    "ObjectMesh",
    "ObjectMotion",
    "Reading",
    "RenderRequest",
    "ResolveRequest",
    "Result",
    "RunRequest",
    "TrackerWay",
    "TrainRequest",
    "calibrate",
    "compare_motions",
    "evaluate",
    "export_result",
    "generate",
    "inspect_take",
    "load_body",
    "load_mesh",
    "load_mount",
    "load_result",
    "load_stages",
    "read_session",
    "register_format",
    "render_result",
    "resolve_result",
    "run_take",
    "save_clips",
    "save_mount",
    "solved_result",
    "stream",
    "to_object_motion",
    "train",
]

_MODULES = {
    "capture_app.calibration.calibrate": ("calibrate",),
    "capture_app.commands.calibrate": ("TrackerWay",),
    "capture_app.commands.train": ("TrainRequest",),
    "capture_app.commands.render": ("CompareRequest", "RenderRequest"),
    "capture_app.comparison.comparison_film": ("compare_motions",),
    "capture_app.commands.export": ("ExportRequest",),
    "capture_app.exports.export_sample": ("export_result",),
    "capture_app.inspection": ("inspect_take",),
    "capture_app.pipeline": ("run_take",),
    "capture_app.rendering": ("render_result",),
    "capture_app.commands.run": ("ResolveRequest", "RunRequest"),
    "capture_app.resolve": ("resolve_result",),
    "capture_app.result": ("Result", "load_result"),
    "capture_app.solve_samples": ("solved_result",),
    "capture_app.training": ("train",),
    "ingest.formats.registry": ("read_session", "register_format"),
    "ingest.mesh": ("load_mesh",),
    "ingest.mount_file": ("load_mount", "save_mount"),
    "ingest.mount": ("Mount",),
    "ingest.session": ("CaptureSession",),
    "ingest.trajectory.object_motion": ("to_object_motion",),
    "ingest.trajectory.trajectory_config": ("Reading",),
    "omomo_core.body.model": ("load_body",),
    "omomo_core.errors": ("InputError",),
    "omomo_core.generation.generator": ("generate",),
    "omomo_core.generation.generation_options": ("GenerationOptions",),
    "omomo_core.generation.stream": ("stream",),
    "omomo_core.learning.evaluation.evaluation": ("evaluate",),
    "omomo_core.learning.recordings.clips": ("Clip", "save_clips"),
    "omomo_core.motion": ("HumanMotion", "ObjectMesh", "ObjectMotion"),
    "omomo_core.weights.load": ("load_stages",),
}
"""Module of each name; the imports above say the same to type checkers."""
_HOME = {name: module for module, names in _MODULES.items() for name in names}

if not TYPE_CHECKING:  # A type checker would take any name for one of ours.

    def __getattr__(name: str) -> Any:
        """A name of the API, imported when it is first asked for."""
        if name not in _HOME:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        value = globals()[name] = getattr(import_module(_HOME[name]), name)
        return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
