"""The objects of the hands benchmark, and how each is moved."""

import os
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import roma
import torch

from capture_app.commands.run import RunRequest
from capture_app.prepare import prepare_take
from capture_app.simulator.record import DEMO, MESH, MOUNT, SESSION
from ingest.mesh import load_mesh
from omomo_core.geometry.easing import min_jerk
from omomo_core.learning.synthesis.props.catalogue import MAKERS, placed
from omomo_core.motion import ObjectMesh, ObjectMotion

SHARED = Path(os.environ.get("OMOCAP_SHARED", Path(__file__).parents[1] / "shared")) / "data"
FURNITURE = "objects/kaykit_furniture_cc0/addons/kaykit_furniture_bits/Assets/obj"
LIFE_SIZE = 0.7
"""Of that furniture, whose tables are 1 m high and whose chairs are 1.26 m."""
FEW = ("chair_A", "table_small", "pictureframe_large_A", "lamp_standing")
MORE = ("chair_C", "chair_stool", "cabinet_small", "shelf_B_small", "armchair", "table_medium_long",
        "pillow_A", "book_set", "table_low", "bed_single_A")  # fmt: skip
SCANS = ("largebox", "woodchair", "suitcase")
MORE_SCANS = ("smallbox", "largetable")
LOGS = {
    "walk": "arkit_data_logger/ARKit_camera_pose.txt",
    "room": "ios_logger_pyojinkim/ARposes.txt",
}
"""Of people who filmed while they walked; the phone is taken for one that is fixed to the demo's box."""
PROPS = ("smallbox", "mop", "suitcase", "trashcan", "monitor")
MORE_PROPS = ("vacuum", "floorlamp", "bucket", "toolbox", "ladder", "stool", "clothesstand")


def lifted(mesh: ObjectMesh, seconds: float) -> ObjectMotion:
    """An object that is lifted, carried along a bend and put down."""
    t = np.linspace(0, 1, round(30 * seconds))
    rise = min_jerk((t - 0.15) / 0.2) - min_jerk((t - 0.7) / 0.2)
    way = min_jerk((t - 0.25) / 0.55)
    middle = 0.5 * (mesh.vertices.min(axis=0) + mesh.vertices.max(axis=0))
    mesh = ObjectMesh(
        mesh.vertices - [*middle[:2], mesh.vertices[:, 2].min()], mesh.faces, mesh.name
    )
    size = float(np.ptp(mesh.vertices[:, 2]))
    T = np.tile(np.eye(4), (len(t), 1, 1))
    T[:, :3, :3] = roma.rotvec_to_rotmat(torch.tensor(1.2 * way[:, None] * [0.0, 0.0, 1.0])).numpy()
    T[:, 0, 3], T[:, 1, 3] = 1.4 * np.sin(1.2 * way), 1.4 * (1 - np.cos(1.2 * way))
    T[:, 2, 3] = rise * float(np.clip(0.9 - 0.5 * size, 0.15, 0.7))
    return ObjectMotion(mesh, T, np.ones(len(t), bool))


def furniture(path: Path) -> ObjectMesh:
    """A mesh at life size whose file has y up."""
    mesh = load_mesh(path)
    x, y, z = LIFE_SIZE * mesh.vertices.T
    return ObjectMesh(np.stack([x, -z, y], axis=1), mesh.faces, mesh.name)


def take(session: Path = DEMO / SESSION, mount: Path | None = DEMO / MOUNT) -> ObjectMotion:
    """A recording, the one that comes with the program if not given, as the motion of the demo's box."""
    request = RunRequest(
        session=session, object=DEMO / MESH, mount=mount, output=Path("out/none"), force=True
    )
    return prepare_take(request).motion


def scan(path: Path) -> ObjectMesh:
    """A mesh as arrays."""
    with np.load(path) as file:
        return ObjectMesh(file["vertices"].astype(float), file["faces"].astype(int), path.stem)


def prop(name: str) -> ObjectMesh:
    """A procedural object as a phone would scan it."""
    rng = np.random.default_rng(7)
    return placed(rng, MAKERS[name](rng)).mesh(rng)


def cases(everything: bool) -> Iterator[tuple[str, Callable[[], ObjectMotion]]]:
    """Names and motions of the objects that are held."""
    seconds = 8.0 if everything else 5.0
    yield "demo", take
    for name, file in LOGS.items():
        path = SHARED / "capture" / file
        if everything and path.exists():
            yield f"log {name}", lambda path=path: take(path, None)
    for name in PROPS + MORE_PROPS * everything:
        yield f"prop {name}", lambda name=name: lifted(prop(name), seconds)
    for name in SCANS + MORE_SCANS * everything:
        path = SHARED / "omomo_clips/meshes" / f"{name}.npz"
        if path.exists():
            yield f"scan {name}", lambda path=path: lifted(scan(path), seconds)
    for name in FEW + MORE * everything:
        path = SHARED / FURNITURE / f"{name}.obj"
        if path.exists():
            yield f"cc0 {name}", lambda path=path: lifted(furniture(path), seconds)
