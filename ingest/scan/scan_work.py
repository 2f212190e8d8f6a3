"""The folder of a scan's work: what each stage leaves, and what is ready."""

import hashlib
import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from uuid import uuid4

import igl
import numpy as np
import trimesh

from ingest.report.take_report import Check
from ingest.scan.clean_mesh import CleanMesh
from ingest.scan.scan_types import ScanMesh

VERSION = "2"
"""Version of what the stages write; raised when they write something else."""


@dataclass(frozen=True)
class StageCache:
    """A folder that keeps finished stages, each with the key of its inputs."""

    folder: Path

    def record(self, stage: str, key: str) -> dict[str, Any] | None:
        """The record of a finished stage; None if it is not finished or its inputs have changed."""
        try:
            stored = json.loads((self.folder / f"{stage}.json").read_bytes())
        except (OSError, ValueError):
            return None
        return stored["record"] if isinstance(stored, dict) and stored.get("key") == key else None

    def finish(self, stage: str, key: str, record: Mapping[str, Any]) -> None:
        """Record that a stage is finished, once all its other files are written."""
        text = json.dumps({"key": key, "record": record}, indent=1, default=_plain)
        temporary = self.folder / f".{stage}.{uuid4().hex[:8]}.part"
        with temporary.open("w", encoding="utf-8") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(self.folder / f"{stage}.json")

    def begin(self, stage: str) -> None:
        """Remove the record of a finished stage."""
        self.folder.mkdir(parents=True, exist_ok=True)
        (self.folder / f"{stage}.json").unlink(missing_ok=True)


def _plain(value: object) -> object:
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else str(value)


def key_of(*parts: object) -> str:
    """Return a short digest of inputs and options."""
    text = json.dumps([VERSION, *parts], default=str, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:24]


def state_of(path: Path) -> list[tuple[str, int, int]]:
    """Names, sizes and times of a file, or of all files in a folder: what changes when it does."""
    files: Iterable[Path] = [path] if path.is_file() else path.rglob("*")
    states = [(file, file.stat()) for file in files if file.is_file()]
    return sorted((str(file), state.st_size, state.st_mtime_ns) for file, state in states)


def ready_mesh(mesh: ScanMesh) -> CleanMesh:
    """The same surface with its base at z = 0 and its footprint's middle at the origin.

    Vertices at one place become one. The axes stay as they are, and so do holes.
    """
    merged = trimesh.Trimesh(
        mesh.vertices, mesh.faces, vertex_colors=mesh.colours, process=False, validate=False
    )
    merged.merge_vertices(merge_tex=True, merge_norm=True)
    merged.remove_unreferenced_vertices()
    vertices, faces = np.asarray(merged.vertices, np.float64), np.asarray(merged.faces, np.int64)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    T = np.eye(4)
    T[:3, 3] = [*(low + high)[:2] / 2, low[2]]
    rims = len(igl.boundary_loop_all(faces))
    visual: Any = merged.visual
    colours = np.asarray(visual.vertex_colors, np.uint8)[:, :3]
    return CleanMesh(
        mesh=ScanMesh(
            vertices - T[:3, 3],
            faces,
            None if mesh.colours is None else colours,
            mesh.name,
            (*mesh.notes, _closed(rims)),
            mesh.texture,
        ),
        normals=np.asarray(igl.per_vertex_normals(vertices, faces), np.float64),
        T_world_object=T,
        seen=np.ones(len(vertices), np.bool_),
        watertight=rims == 0,
    )


def _closed(rims: int) -> Check:
    if rims == 0:
        return Check("closed", "ok", "The surface is closed.")
    message = f"The surface has {rims} holes; a motion can be made with it all the same."
    return Check("closed", "ok", message)
