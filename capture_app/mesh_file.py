"""Solid: an object's mesh file, and what brings it to metres."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from omomo_core.motion import ObjectMesh


@dataclass(frozen=True)
class MeshFile:
    """An object's mesh."""

    path: Path
    scale: float = 1.0
    """Factor that brings it to metres."""

    def load(self, factor: float = 1.0) -> "ObjectMesh":
        """The mesh in metres.

        Args:
            factor: what a mount says that it must be multiplied by beside.

        Raises:
            InputError: as `load_mesh`.
        """
        from ingest.mesh import load_mesh

        return load_mesh(self.path, scale=self.scale * factor)
