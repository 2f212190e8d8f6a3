"""How well six characters of others do a result's motion: palms on the object, feet on the floor.

Usage: python -m benchmarks.characters RESULT [--fps FPS]

Each character is written as a file (tests/rigs.py), moved by `omocap export RESULT --skeleton`, and the
answer is read with kinematics of its own: nodes, key frames and contacts of the GLB, nothing else.
"""

import argparse
import json
import struct
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from capture_app.commands.export import ExportRequest
from capture_app.exports.export_sample import export_result
from tests.rigs import KINDS, Rig, make_rig, write_rig

HEAD = "character size palm_most_mm palm_median_mm sole_most_mm slide_most_mm_per_frame keys"
_WIDTH = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}


class WrittenGlb:
    """A GLB by the specification: the world matrices of its nodes, at rest and in every frame."""

    def __init__(self, path: Path, fps: float) -> None:
        """Read it; key frames are interpolated to `fps`."""
        whole = path.read_bytes()
        length = struct.unpack_from("<I", whole, 12)[0]
        self.scene: dict[str, Any] = json.loads(whole[20 : 20 + length])
        self._data = whole[28 + length :]
        self._nodes = self.scene["nodes"]
        self.names = {node.get("name"): k for k, node in enumerate(self._nodes)}
        self._above = {c: k for k, node in enumerate(self._nodes) for c in node.get("children", ())}
        self.keys = 0
        self._moves: dict[tuple[int, str], np.ndarray] = {}
        channels, samplers = (self.scene["animations"][0][k] for k in ("channels", "samplers"))
        last = max(self._array(s["input"])[-1, 0] for s in samplers)
        self.times = np.arange(round(last * fps) + 1) / fps
        for channel in channels:
            sampler, target = samplers[channel["sampler"]], channel["target"]
            times, values = self._array(sampler["input"])[:, 0], self._array(sampler["output"])
            self.keys += len(times)
            self._moves[target["node"], target["path"]] = _between(times, values, self.times)

    def _array(self, index: int) -> np.ndarray:
        accessor = self.scene["accessors"][index]
        view = self.scene["bufferViews"][accessor["bufferView"]]
        width = _WIDTH[accessor["type"]]
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        flat = np.frombuffer(self._data, "<f4", accessor["count"] * width, start)
        return flat.reshape(-1, width).astype(float)

    def world(self, node: int, *, moved: bool) -> np.ndarray:
        """Matrices of a node: (frames, 4, 4), all alike at rest."""
        own, moves = self._nodes[node], self._moves if moved else {}
        T = np.tile(np.eye(4), (len(self.times), 1, 1))
        turn = moves.get((node, "rotation"), np.array([own.get("rotation", [0, 0, 0, 1])]))
        T[:, :3, :3] = Rotation.from_quat(turn).as_matrix() * own.get("scale", [1, 1, 1])
        T[:, :3, 3] = moves.get((node, "translation"), own.get("translation", [0, 0, 0]))
        above = self._above.get(node)
        return T if above is None else self.world(above, moved=moved) @ T

    def carried(self, node: int, point: np.ndarray) -> np.ndarray:
        """A point of the rest pose, carried by a node: (frames, 3)."""
        local = np.linalg.inv(self.world(node, moved=False)[0]) @ [*point, 1.0]
        return (self.world(node, moved=True) @ local)[:, :3]

    def touching(self, part: str) -> list[tuple[slice, list[float]]]:
        """Frames of each contact of a part, and its point on the object."""
        contacts = self._nodes[self.names["object"]]["extras"]["contacts"]
        fps = 1.0 / self.times[1]
        return [
            (slice(round(c["from"] * fps), round(c["to"] * fps)), c.get("point", []))
            for c in contacts
            if c["part"] == part
        ]


def _between(times: np.ndarray, values: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Linear as glTF has it: positions along the line, quaternions along the arc."""
    after = np.searchsorted(times, wanted - 1e-6).clip(1, len(times) - 1)
    share = ((wanted - times[after - 1]) / (times[after] - times[after - 1])).clip(0, 1)[:, None]
    a, b = values[after - 1], values[after]
    if values.shape[1] == 3:
        return a + share * (b - a)
    first = Rotation.from_quat(a)
    return (
        first * Rotation.from_rotvec(share * (first.inv() * Rotation.from_quat(b)).as_rotvec())
    ).as_quat()


def measured(glb: WrittenGlb, rig: Rig) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Distances of palms from their points, of soles from the floor, and ways in a frame; metres."""
    nodes = {ours: glb.names[rig.names[k]] for ours, k in rig.joints.items()}
    rest = glb.world(nodes["pelvis"], moved=False)[0, :3, 3] - rig.positions[rig.joints["pelvis"]]
    T = glb.world(glb.names["object"], moved=True)
    palms, soles, slides = [], [], []
    for side, name in enumerate(("left", "right")):
        palm = glb.carried(nodes[f"{name}_wrist"], rig.palms[side] + rest)
        for frames, point in glb.touching(f"{name}_hand"):
            wanted = (T[frames] @ [*point, 1.0])[:, :3]
            palms.append(np.linalg.norm(palm[frames] - wanted, axis=1))
        for part, ours in (("ankle", "ankle"), ("toe", "foot")):
            sole = glb.carried(nodes[f"{name}_{ours}"], rig.soles[f"{name}_{ours}"] + rest)
            for frames, _ in glb.touching(f"{name}_{part}"):
                soles.append(np.abs(sole[frames, 1]))
                slides.append(np.linalg.norm(np.diff(sole[frames][:, [0, 2]], axis=0), axis=1))
    return tuple(np.concatenate(values) for values in (palms, soles, slides))


def main(words: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("result", type=Path)
    parser.add_argument("--fps", type=int, default=30)
    given = parser.parse_args(words)
    print(HEAD)
    with tempfile.TemporaryDirectory() as folder:
        for name, kind in KINDS.items():
            rig = make_rig(kind)
            character = write_rig(rig, Path(folder, f"{name}.glb"))
            output = Path(folder, f"{name}_moved.glb")
            request = ExportRequest(
                result=given.result, output=output, skeleton=character, fps=given.fps
            )
            written = export_result(request)
            glb = WrittenGlb(output, given.fps)
            palms, soles, slides = (1000 * values for values in measured(glb, rig))
            print(
                f"{name} {kind.size} {palms.max():.2f} {np.median(palms):.2f} {soles.max():.2f} "
                f"{slides.max():.3f} {glb.keys}",
                *written.notes,
            )


if __name__ == "__main__":
    main()
