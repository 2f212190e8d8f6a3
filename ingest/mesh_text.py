"""Check that an OBJ or ASCII PLY file is complete: a truncated one would be read as a smaller mesh."""

from pathlib import Path

import numpy as np
import trimesh

from omomo_core.errors import InputError

_HEAD = 65536
"""Bytes within which the header of a PLY file ends."""


def check_whole(path: Path, mesh: trimesh.Trimesh) -> None:
    """Refuse a truncated file.

    The header of ASCII PLY says how many lines follow. OBJ has no such count, but every program writes a
    line end at its end: a file without one is accepted only if the surface is closed and uses all vertices.

    Args:
        path: the mesh file.
        mesh: what was read from it.

    Raises:
        InputError: "mesh-truncated".
    """
    kind = path.suffix.lower()
    if kind == ".ply":
        _check_ply(path)
    elif kind == ".obj" and _ends_amid_a_line(path):
        unused = len(mesh.vertices) - len(np.unique(mesh.faces))
        if unused or not mesh.is_watertight:
            raise _cut(path, "it ends in the middle of a line")


def _ends_amid_a_line(path: Path) -> bool:
    with path.open("rb") as file:
        file.seek(-1, 2)
        return file.read(1) not in b"\r\n"


def _check_ply(path: Path) -> None:
    with path.open("rb") as file:
        head = file.read(_HEAD)
        header, found, _ = head.partition(b"end_header")
        if not found or b"format ascii" not in header:
            return
        wanted = sum(
            int(words[2])
            for words in (line.split() for line in header.splitlines())
            if len(words) == 3 and words[0] == b"element" and words[2].isdigit()
        )
        file.seek(len(header) + len(found))
        file.readline()
        there = sum(1 for line in file if line.strip())
    if there < wanted:
        raise _cut(path, f"{there} lines follow its header instead of {wanted}")


def _cut(path: Path, how: str) -> InputError:
    return InputError(
        "mesh-truncated",
        f"{path.name} is cut short: {how}.",
        where=str(path),
        fix="Copy the file again, or export the mesh again.",
    )
