"""How hands hold: fingers and palms of generated people against what they hold, on the skin.

Usage: python -m benchmarks.hands [--all] [--samples N] [--only WORD] [--pictures DIR]

Objects are those of the demo, with --all of two logs of real phones, procedural ones and meshes of `shared`
(left out where it is not; the variable OMOCAP_SHARED says where it is). All but the first are lifted, carried
along a bend and put down, with --all more of them, and for longer. --pictures draws each in the middle of its
motion, as `omocap render --view hands --still` does.

While a hand holds, every fourth frame is measured: how deep the deepest vertex of the fingers and of the
palm is in the object (exact signed distance, mm: median and 99th percentile), the share of frames in which
three finger pads or more, or the thumb's pad, are within 5 mm of the surface, the fastest finger joint
(degrees a frame), the share of frames with a wrist beyond its range, that with a fist on a face (a hand
whose four fingers are bent by more than half a fist while the surface under the palm is flat), and the share
of fingers with a bone that passes through the surface, as through a thin wall. "coming" is the depth of the
deepest vertex (99th percentile, mm) in the half second before a contact and after it. The last lines are of
all objects, and of those whose person is not in the object: where the body is, its hands cannot hold.
"""

import os
from argparse import ArgumentParser
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

import igl
import numpy as np
import roma
import torch

from capture_app.commands.run import RunRequest
from capture_app.prepare import prepare_take
from capture_app.simulator.demo_take import DEMO, MESH, MOUNT, SESSION
from ingest.mesh import load_mesh
from omomo_core.body.finger_model import PALM, THUMB, HandSkin, hand_skins
from omomo_core.body.kinematics import full_kinematics, skin
from omomo_core.body.model import BodyModel, load_body
from omomo_core.generation.generation_options import GenerationOptions
from omomo_core.generation.generator import generate
from omomo_core.generation.person import Person
from omomo_core.generation.selection.ranking import wrist_excess
from omomo_core.generation.selection.selection_config import SCORE
from omomo_core.geometry.runs import frames_away, min_jerk
from omomo_core.geometry.surface import Triangles
from omomo_core.learning.synthesis.props.catalogue import MAKERS, placed
from omomo_core.motion import ObjectMesh, ObjectMotion
from omomo_core.weights.load import load_stages
from render.third_person import frames
from render.video import write_png
from render.views import hand_cameras

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


TIP = 0.8
"""Length of a finger's last bone over that of the one before it."""
STRIDE, NEAR, FIST, FLAT = 4, 0.005, 0.9, 0.008
"""Frames; metres; mean flexion of a finger's joints, radians; metres out of the plane of a face."""
COMING = 15
"""Frames before a contact and after it in which a hand comes or goes."""
WITHIN = 0.005
"""Mean depth of a body in the object from which its hands cannot hold, metres."""
SIZE = (480, 400)
"""Of a picture, pixels."""


@dataclass(frozen=True)
class HandMeasures:
    """What was measured in the frames in which a hand holds."""

    finger_depth: np.ndarray
    palm_depth: np.ndarray
    pads: np.ndarray
    """How many of the five are near."""
    thumb: np.ndarray
    wrist: np.ndarray
    fist: np.ndarray
    through: np.ndarray
    """Share of the five fingers of which a bone passes through the surface."""
    coming: np.ndarray
    """Depth of the deepest vertex of a hand that comes or goes, metres; in frames of its own."""
    speed: np.ndarray
    """Of the fastest finger joint, degrees a frame; of every frame."""

    def row(self) -> str:
        """The measures in one line."""
        if not len(self.pads):
            return "never held"
        deep = [
            1000 * np.percentile(d, q)
            for d in (self.finger_depth, self.palm_depth)
            for q in (50, 99)
        ]
        kinds = (self.pads >= 3, self.thumb, self.wrist, self.fist, self.through)
        shares = [np.mean(x) for x in kinds]
        return (
            "{:6.1f} {:6.1f} {:6.1f} {:6.1f}".format(*deep)
            + f"{shares[0]:8.0%}{shares[1]:7.0%}{self.speed.max():7.1f}"
            + f"{shares[2]:7.0%}{shares[3]:6.0%}{shares[4]:9.1%}"
            + f"{1000 * np.percentile(np.append(self.coming, 0.0), 99):8.1f}"
        )


HEAD = (
    f"{'object':26}{'finger 50, 99 %':>14}{'palm 50, 99 %':>14}{'3 pads':>8}{'thumb':>7}{'deg/f':>7}"
    f"{'wrist':>7}{'fist':>6}{'through':>9}{'coming':>8}{'body':>6}"
)


def signed_distance(mesh: ObjectMesh, points: np.ndarray) -> np.ndarray:
    """Exact signed distance, metres, negative inside; points of any shape in the object's frame."""
    flat = np.ascontiguousarray(points.reshape(-1, 3), dtype=float)
    vertices, faces = np.ascontiguousarray(mesh.vertices), np.ascontiguousarray(mesh.faces)
    found = igl.signed_distance(
        flat, vertices, faces, sign_type=igl.SIGNED_DISTANCE_TYPE_FAST_WINDING_NUMBER
    )
    return np.asarray(found[0]).reshape(points.shape[:-1])


def measure(person: Person, motion: ObjectMotion, body: BodyModel) -> HandMeasures:
    """Measure both hands of a person."""
    human = person.human
    parts = (human.root, human.rotations, human.fingers)
    posed = full_kinematics(body, *(torch.from_numpy(np.asarray(x)).float() for x in parts))
    fingers = torch.from_numpy(human.fingers)
    turned = torch.rad2deg(roma.rotmat_geodesic_distance(fingers[1:], fingers[:-1])).numpy()
    surface = Triangles(motion.mesh.vertices, motion.mesh.faces)
    rows: list[tuple[np.ndarray, ...]] = []
    coming = [np.zeros(0)]
    for side, hand in enumerate(hand_skins(body)):
        holds = human.hand_contact[:, side] > 0.5
        held = np.flatnonzero(holds)[::STRIDE]
        if not len(held):
            continue

        def distances(frames: np.ndarray, hand: HandSkin = hand) -> np.ndarray:
            vertices = skin(body, *(x[frames] for x in posed))[:, hand.vertices].double().numpy()
            T = motion.T_world_object[frames]
            local = np.einsum("fji,fvj->fvi", T[:, :3, :3], vertices - T[:, None, :3, 3])
            return signed_distance(motion.mesh, local)

        distance, T = distances(held), motion.T_world_object[held]
        free = np.flatnonzero(~holds & (frames_away(holds) <= COMING))[::STRIDE]
        if len(free):
            coming.append((-distances(free)).clip(min=0.0).max(axis=1))
        beyond = wrist_excess(human.rotations[held], side) > SCORE.wrist_slack
        fists = _fists(human.fingers[held], side, distance, hand)
        bones = _bones(posed[0][held].double().numpy(), side)
        local = np.einsum("fji,fbvj->fbvi", T[:, :3, :3], bones - T[:, None, None, :3, 3])
        through = surface.between(local[:, :, :-1], local[:, :, 1:])
        rows.append((*_depths(distance, hand), beyond, fists, through.any(axis=2).mean(axis=1)))
    joined = [np.concatenate(x) for x in zip(*rows, strict=True)] or [np.zeros(0)] * 7
    return HandMeasures(*joined, coming=np.concatenate(coming), speed=turned)


def _bones(joints: np.ndarray, side: int) -> np.ndarray:
    """The joints of each finger of a hand and its tip, frames 5 4 3, world, metres."""
    first = 22 + 15 * side
    chain = joints[:, first : first + 15].reshape(len(joints), 5, 3, 3)
    tip = chain[:, :, 2] + TIP * (chain[:, :, 2] - chain[:, :, 1])
    return np.concatenate([chain, tip[:, :, None]], axis=2)


def _depths(distance: np.ndarray, hand: HandSkin) -> tuple[np.ndarray, ...]:
    """Depth of fingers and palm, number of near pads, and whether the thumb's is near."""
    finger = hand.finger.numpy()
    near = [
        np.abs(distance[:, (finger == f) & hand.pad.numpy()]).min(axis=1) < NEAR for f in range(5)
    ]
    deep = (-distance).clip(min=0.0)
    return (
        deep[:, finger != PALM].max(axis=1),
        deep[:, finger == PALM].max(axis=1),
        np.sum(near, axis=0),
        near[THUMB],
    )


def _fists(fingers: np.ndarray, side: int, distance: np.ndarray, hand: HandSkin) -> np.ndarray:
    """Where all four fingers are bent like a fist though the palm is on a face."""
    own = torch.from_numpy(fingers[:, 15 * side : 15 * side + 12]).reshape(-1, 4, 3, 3, 3)
    bent = roma.rotmat_to_rotvec(own).norm(dim=-1).mean(dim=-1).numpy()
    palm = distance[:, hand.finger.numpy() == PALM]
    flat = (palm < palm.min(axis=1, keepdims=True) + FLAT).mean(axis=1) > 0.3
    return (bent > FIST).all(axis=1) & flat


def picture(path: Path, person: Person, motion: ObjectMotion, body: BodyModel) -> None:
    """Draw the hands in the middle of their contacts."""
    human = person.human
    held = np.flatnonzero(human.hand_contact.max(axis=1) > 0.5)
    frame = int(held[len(held) // 2]) if len(held) else 0
    width, height = SIZE
    cameras = hand_cameras(human, motion, width, height)
    drawn = frames(human, motion, body, width=width, height=height, cameras=cameras, samples=4,
                   markers=False, time_code=False, only=[frame])  # fmt: skip
    path.parent.mkdir(parents=True, exist_ok=True)
    write_png(path, next(drawn))


def summary(name: str, measured: list[HandMeasures]) -> str:
    """The measures of several objects together, in one line."""
    if not measured:
        return f"{name:26}none"
    columns = [
        np.concatenate([np.ravel(x) for x in c])
        for c in zip(*(vars(h).values() for h in measured), strict=True)
    ]
    return f"{name:26}{HandMeasures(*columns).row()}"


def main() -> None:
    parser = ArgumentParser()
    parser.add_argument("--all", action="store_true")
    parser.add_argument("--samples", type=int, default=1)
    parser.add_argument("--only", default="")
    parser.add_argument("--pictures", type=Path)
    said = parser.parse_args()
    body, stages = load_body(), load_stages()
    print(HEAD)
    every: list[HandMeasures] = []
    outside: list[HandMeasures] = []
    for name, make in cases(said.all):
        if said.only not in name:
            continue
        motion, start = make(), perf_counter()
        made = generate(motion, body, stages, GenerationOptions(said.samples))
        took = perf_counter() - start
        person = made.people[made.chosen]
        every.append(measure(person, motion, body))
        within = float(person.depth.mean())
        outside += every[-1:] * (within < WITHIN)
        print(f"{name:26}{every[-1].row()} {1000 * within:5.1f}   {took:.1f} s", flush=True)
        if said.pictures:
            picture(said.pictures / f"{name.replace(' ', '-')}.png", person, motion, body)
    print(summary("all", every))
    print(summary("bodies outside", outside))


if __name__ == "__main__":
    main()
