"""The whole story: a phone's log, a mesh and a mount become a result folder."""

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np
import trimesh
from jaxtyping import Bool, Float64
from scipy.spatial import KDTree

from capture_app.commands.run import RunRequest
from capture_app.generated_sample import GeneratedSample
from capture_app.manifest import MOTION, Manifest
from capture_app.manifest_builder import run_manifest
from capture_app.motion_arrays import SAMPLED
from capture_app.prepare import PreparedTake, prepare_take
from capture_app.progress import Progress, silent
from capture_app.result import Result, save_motion
from capture_app.staged_result import StagedResult, draw_video, run_stages
from ingest.axes import T_ZUP_ARKIT
from ingest.mesh_files.file_parts import decoding
from ingest.scan.clean_mesh import INVENTED
from omomo_core.body.model import BodyModel
from omomo_core.contact.segment import ContactSegment
from omomo_core.generation.generator import generate
from omomo_core.generation.person import Person
from omomo_core.motion import ObjectMotion

_HANDS = ("left", "right")
_SHARE = 0.5
"""Part of the surface under a palm that is invented, of what faces the palm."""
_PALM = 0.05
"""Metres around the place under a palm that count."""


class _Marked(NamedTuple):
    """Vertices of a scan's mesh, z up, in the file's unit."""

    vertices: Float64[np.ndarray, "verts 3"]
    normals: Float64[np.ndarray, "verts 3"]
    invented: Bool[np.ndarray, " verts"]
    """True where no picture shows the surface."""


def invented_notes(
    mesh: Path | None, scale: float, segments: Sequence[ContactSegment]
) -> tuple[str, ...]:
    """One note for each hand that rests on invented surface of the object's mesh.

    Args:
        mesh: file of the object's mesh; only what `omocap scan` wrote says what is invented.
        scale: metres of one unit of the file.
        segments: of both hands, with their anchors in the object's frame.
    """
    marked = None if mesh is None else _marked(mesh)
    if marked is None:
        return ()
    tree = KDTree(marked.vertices * scale)
    held = [segment for segment in segments if _on_invented(tree, marked, segment.anchor)]
    return tuple(
        f"The {_HANDS[hand]} palm rests on surface that no picture of the scan shows "
        f"(frames {', '.join(f'{s.start} to {s.stop}' for s in held if s.hand == hand)}); film the "
        "object from there too, or correct the contacts."
        for hand in sorted({segment.hand for segment in held})
    )


def _on_invented(tree: KDTree, marked: _Marked, anchor: np.ndarray) -> bool:
    """Whether most of the surface that faces a palm is invented; the other side of a plate is not held."""
    nearest = tree.query(anchor)[1]
    around = np.asarray(tree.query_ball_point(tree.data[nearest], _PALM))
    ahead = np.einsum("vi,vi->v", marked.normals[around], anchor - tree.data[around]) > 0
    facing = around[ahead] if ahead.any() else around
    return bool(marked.invented[facing].mean() > _SHARE)


def _marked(path: Path) -> _Marked | None:
    """The mesh's marks; None where the file has none."""
    if path.suffix.lower() != ".glb":
        return None
    with decoding(path):
        parts = list(trimesh.load_scene(path, process=False).geometry.values())
    if len(parts) != 1 or INVENTED not in parts[0].vertex_attributes:
        return None
    vertices, normals = (
        np.asarray(part, np.float64) @ T_ZUP_ARKIT[:3, :3].T
        for part in (parts[0].vertices, parts[0].vertex_normals)
    )
    marks = np.asarray(parts[0].vertex_attributes[INVENTED]).reshape(-1)
    return _Marked(vertices, normals, marks > 0.5)


def run_take(request: RunRequest, progress: Progress = silent) -> Result:
    """Turn a take into a result folder, and draw its video if one is asked for.

    Args:
        request: the inputs and options; all are checked before the slow part starts.
        progress: told each stage (those of `motion_of_take`, then "video") and how far it is.

    Returns:
        The result, as it is on the disk.

    Raises:
        InputError, AssetError: see `motion_of_take`.
    """
    made = motion_of_take(request, progress)
    draw_video(request, progress)
    return made


def motion_of_take(request: RunRequest, progress: Progress = silent) -> Result:
    """Turn a take into a result folder without a video; nothing is left behind when it fails.

    Args:
        request: the inputs and options; all are checked before the slow part starts.
        progress: told each stage ("read", "object", "hands", "contact", "body", "solve", "export")
            and how far it is.

    Returns:
        The result, as it is on the disk.

    Raises:
        InputError: an input cannot give a correct motion, or the output folder cannot be made.
        AssetError: the body or the weights are missing or damaged.
    """
    return run_stages(StagedRun(request, progress))


class StagedRun(StagedResult[RunRequest]):
    """A take on its way to a result."""

    @property
    def stages(self) -> Mapping[str, Callable[[], None]]:
        """Read, generate, export, finish."""
        return {
            "read": self.read,
            "generate": self.generate,
            "export": self.export,
            "finish": self.finish,
        }

    @cached_property
    def prepared(self) -> PreparedTake:
        """Everything that is read and checked; the same in every process."""
        return prepare_take(self.request)

    def read(self) -> None:
        """Check every input and that the result can be written."""
        self.clock("read", 0.0)
        _ = self.prepared
        self.staging.open()
        self.clock("read", 1.0)

    def generate(self) -> None:
        """Generate the samples and write motion.npz."""
        take, options = self.prepared, self.request.generation
        known = take.person.conditioning(take.contacts)
        folder = self.staging.folder
        generated = generate(
            take.motion,
            take.body,
            take.stages,
            options,
            self.clock,
            known,
            folder / SAMPLED,
        )
        unsolved = generated.unsolved
        if not unsolved:
            (folder / SAMPLED).unlink(missing_ok=True)
        save_motion(
            folder / MOTION,
            generated.people,
            generated.chosen,
            take.motion,
            take.body.name,
            unsolved,
        )
        self.keep(
            GeneratedSample(
                generated.people[generated.chosen],
                generated.chosen,
                generated.scores,
                (*generated.notes, *self._invented(generated.people[generated.chosen])),
            )
        )

    def _invented(self, person: Person) -> tuple[str, ...]:
        """Return what to tell of hands on surface that no picture of the object's scan shows."""
        scale = self.request.mesh_scale * self.prepared.mount.object_scale
        return invented_notes(self.request.object, scale, person.segments)

    @property
    def inputs(self) -> Mapping[str, Path]:
        """Session, object, mount, body and contacts, as far as they are given."""
        return self.request.inputs

    @property
    def object_motion(self) -> ObjectMotion:
        """The chosen segment of the take."""
        return self.prepared.motion

    @property
    def body(self) -> BodyModel:
        """The body that was asked for."""
        return self.prepared.body

    @property
    def has_contacts(self) -> bool:
        """Whether contacts are segments, not those of the published rule."""
        return self.request.has_segments

    def manifest(self, files: tuple[str, ...]) -> Manifest:
        """Return the manifest of this run."""
        return run_manifest(self.request, self.prepared, self.sample, self.clock.seconds, files)
