"""How many wrong set-ups of a take are noticed, and from which size on; how many good takes are clean.

Usage: python -m benchmarks.take_checks CLIPS [--good | --wrong | --sizes] [--takes N]

CLIPS is a folder of recorded clips (`omomo_core/learning/evaluation/real_clips.py`) whose object rests at
both ends. A phone is clamped to each object, its log is simulated with noise of five kinds, written as three
apps write it, and read back. Printed are the verdicts of good takes, what is found of each wrong set-up, and
the share of each kind of fault that is found, by its size. A fault is named when the take is refused or
flagged by a check that has to do with the cause; a verdict of "good" is SILENT.
"""

import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import trimesh
from scipy.ndimage import gaussian_filter1d
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from capture_app.inspection import Inspection, look_over
from capture_app.simulator.demo_take import carried_box
from capture_app.simulator.simulated_phone import NO_NOISE, simulate
from ingest.formats import arkit_data_logger, stray_scanner, tum
from ingest.formats.registry import Format, read_session
from ingest.mount import Mount
from ingest.report.phone_place import phone_plate
from ingest.session import CaptureSession
from ingest.trajectory.trajectory_config import AS_LOGGED, Reading
from omomo_core.body.model import load_body
from omomo_core.errors import InputError
from omomo_core.geometry.transforms import inverse
from omomo_core.learning.evaluation.real_clips import clip_paths, read_clip
from omomo_core.motion import ObjectMesh, ObjectMotion
from tests.log_writers import write_session
from tests.simulator.slipping import slipping

FPS = 30
"""Frames a second of recorded clips."""
NOISES = {
    "quiet": (0.0001, 0.01, 0.0),
    "white 0.6 mm": (0.0006, 0.05, 0.0),
    "white 3 mm": (0.003, 0.2, 0.0),
    "slow 0.6 mm": (0.0, 0.0, 0.0006),
    "slow 3 mm": (0.0, 0.0, 0.003),
}
"""Standard deviations on each axis: of each pose (m, deg), and of what wanders within a second (m)."""
_WANDER = 0.5
"""Seconds over which slow noise is smooth."""
_STAND_OFF = 0.03
"""Metres of the camera from the surface that the phone is clamped to."""
FORMATS: tuple[Format, ...] = (stray_scanner, arkit_data_logger, tum)


@dataclass(frozen=True)
class Staged:
    """What somebody gives the program: what the phone logged, a mesh, a mount."""

    motion: ObjectMotion
    """What the object does, for who believes that the mount holds."""
    true_mount: Mount
    """With which the phone logs it."""
    mount: Mount
    """That is given."""
    mesh: ObjectMesh
    """That is given."""
    change: Callable[[CaptureSession], CaptureSession] = lambda session: session
    """What happens to the log."""
    reading: Reading = AS_LOGGED


def main() -> None:
    """Print what is asked for; everything if nothing is."""
    folder, *words = sys.argv[1:]
    takes = int(words[words.index("--takes") + 1]) if "--takes" in words else 40
    parts = {"--good": good_takes, "--wrong": wrong_set_ups, "--sizes": sizes}
    chosen = [part for word, part in parts.items() if word in words]
    for part in chosen or parts.values():
        part(Path(folder), takes)


def motions(folder: Path, most: int) -> list[tuple[str, ObjectMotion]]:
    """Recorded objects that rest at both ends, with a second more of each rest."""
    found: list[tuple[str, ObjectMotion]] = []
    body = load_body()
    for path in clip_paths(folder):
        motion = read_clip(path, body).motion
        T = motion.T_world_object
        still = [np.ptp(part[:, :3, 3], axis=0).max() < 0.02 for part in (T[:15], T[-15:])]
        if all(still):
            T = np.concatenate([np.repeat(T[:1], FPS, axis=0), T, np.repeat(T[-1:], FPS, axis=0)])
            found.append((path.stem, ObjectMotion(motion.mesh, T, np.ones(len(T), bool))))
    return found[:most]


def clamped(motion: ObjectMotion, seed: int) -> Mount:
    """A phone on a side of the object as it stands first, where it has room beside it and over the floor.

    Its camera looks outward, off the surface by a clamp's jaw; it is upright, on its side or on its head.
    """
    mesh, T_world_object = motion.mesh, motion.T_world_object[0]
    vertices = mesh.vertices @ T_world_object[:3, :3].T + T_world_object[:3, 3]
    solid = trimesh.Trimesh(vertices, mesh.faces, process=False)
    points, face = trimesh.sample.sample_surface(solid.convex_hull, 400, seed=seed)
    outward = solid.convex_hull.face_normals[face]
    at_hull = (
        KDTree(trimesh.sample.sample_surface(solid, 20_000, seed=0)[0]).query(points)[0] < 0.02
    )
    rng = np.random.default_rng(seed)
    for k in rng.permutation(np.flatnonzero((np.abs(outward[:, 2]) < 0.3) & at_hull)):
        for turn in (0, 90, 180, 270):
            T_world_phone = _at_surface(points[k], outward[k], turn, rng)
            plate = phone_plate() @ T_world_phone[:3, :3].T + T_world_phone[:3, 3]
            inside = (plate - points[k]) @ outward[k] < 0
            if plate[:, 2].min() > 0.02 and not inside.any():
                return Mount(inverse(T_world_phone) @ T_world_object, "benchmark")
    raise ValueError(f"no phone fits on {mesh.name}")


def _at_surface(
    point: np.ndarray, normal: np.ndarray, turn: float, rng: np.random.Generator
) -> np.ndarray:
    """The phone in the world; ARKit's camera has x down the upright phone and z out of its screen."""
    up = np.array([0.0, 0, 1]) - normal[2] * normal
    up /= np.linalg.norm(up)
    T = np.eye(4)
    T[:3, :3] = np.stack([-up, np.cross(-normal, -up), -normal], axis=1)
    crooked = np.radians([*rng.normal(scale=4, size=2), turn + rng.normal(scale=4)])
    T[:3, :3] = T[:3, :3] @ Rotation.from_rotvec(crooked).as_matrix()
    T[:3, 3] = point + _STAND_OFF * normal
    return T


def inspect(staged: Staged, format_: Format, noise: str, seed: int) -> Inspection | InputError:
    """Log a staged take, write and read it as an app does, and look it over."""
    session = simulate(staged.motion, staged.true_mount, seed=seed, noise=NO_NOISE)
    session = staged.change(_noisy(session, noise, seed))
    with tempfile.TemporaryDirectory() as folder:
        try:
            read = read_session(write_session(format_, session, Path(folder) / "take"))
            return look_over(read, staged.mesh, staged.mount, staged.reading)
        except InputError as problem:
            return problem


def _noisy(session: CaptureSession, noise: str, seed: int) -> CaptureSession:
    metres, degrees, slow = NOISES[noise]
    rng, T = np.random.default_rng([seed, 1]), session.T_world_phone.copy()
    T[:, :3, 3] += rng.normal(scale=metres, size=(len(T), 3))
    turn = rng.normal(scale=np.radians(degrees), size=(len(T), 3))
    T[:, :3, :3] = T[:, :3, :3] @ Rotation.from_rotvec(turn).as_matrix()
    if slow:
        rate = (len(T) - 1) / (session.times[-1] - session.times[0])
        walk = gaussian_filter1d(rng.normal(size=(len(T), 3)), _WANDER * rate, axis=0)
        T[:, :3, 3] += slow * walk / walk.std()
    return replace(session, T_world_phone=T)


def names(found: Inspection | InputError) -> tuple[str, list[str]]:
    """The verdict, and the names of what is amber or red, worst first."""
    if isinstance(found, InputError):
        return "refused", [found.code]
    problem = [] if found.problem is None else [found.problem.code]
    bad, warn = ([check.name for check in found.report.of(s)] for s in ("bad", "warn"))
    return found.verdict, list(dict.fromkeys([*problem, *bad, *warn]))


def good_takes(folder: Path, takes: int) -> None:
    """Print how many good takes have a clean verdict, and what is said of the others."""
    verdicts, said, count = Counter[str](), Counter[str](), 0
    for k, (name, motion) in enumerate(motions(folder, takes)):
        mount = clamped(motion, k)
        staged = Staged(motion, mount, mount, motion.mesh)
        for noise in NOISES:
            found = inspect(staged, FORMATS[count % 2], noise, count)
            verdict, checks = names(found)
            verdicts[verdict] += 1
            count += 1
            if verdict != "good":
                said.update(checks)
                print(f"  {name:22s} {noise:13s} {verdict}: {', '.join(checks)}")
    print(f"good takes: {count}; " + ", ".join(f"{n} {v}" for v, n in verdicts.most_common()))
    print(f"clean: {verdicts['good'] / max(1, count):.1%}; " + str(dict(said.most_common())))


def _turned(mount: Mount, degrees: float, axis: np.ndarray) -> Mount:
    """A mount turned in the object's axes, about the camera."""
    T = inverse(mount.T_phone_object)
    turn = Rotation.from_rotvec(np.radians(degrees) * np.asarray(axis)).as_matrix()
    T[:3, :3] = turn @ T[:3, :3]
    return Mount(inverse(T), "by hand")


def _moved(mount: Mount, metres: np.ndarray) -> Mount:
    T = inverse(mount.T_phone_object)
    T[:3, 3] += metres
    return Mount(inverse(T), "by hand")


def _outward(mount: Mount, metres: float) -> Mount:
    """Moved along the camera's axis, away from the surface; or into it."""
    T = inverse(mount.T_phone_object)
    T[:3, 3] -= metres * T[:3, 2]
    return Mount(inverse(T), "by hand")


def _scaled(mesh: ObjectMesh, factor: float) -> ObjectMesh:
    return replace(mesh, vertices=mesh.vertices * factor)


def _box(*size: float) -> ObjectMesh:
    solid = trimesh.creation.box(size)
    return ObjectMesh(np.asarray(solid.vertices), np.asarray(solid.faces), "another")


def _slip(motion: ObjectMotion, mount: Mount, degrees: float, axis: np.ndarray, metres: np.ndarray):
    """The motion that is logged while the clamp gives way in mid-carry."""
    slipped = _moved(_turned(mount, degrees, axis), metres)
    return slipping(motion, mount, slipped, len(motion.valid) / FPS / 2)


def _timed(factor: float) -> Callable[[CaptureSession], CaptureSession]:
    def change(session: CaptureSession) -> CaptureSession:
        times = session.times[0] + (session.times - session.times[0]) * factor
        return replace(session, times=times, video_times=times, imu=None)

    return change


def _world(axes: str, degrees: float) -> Callable[[CaptureSession], CaptureSession]:
    def change(session: CaptureSession) -> CaptureSession:
        T = np.eye(4)
        T[:3, :3] = Rotation.from_euler(axes, degrees, degrees=True).as_matrix()
        return replace(session, T_world_phone=T @ session.T_world_phone, imu=None)

    return change


def _camera(axes: str, degrees: float) -> Callable[[CaptureSession], CaptureSession]:
    def change(session: CaptureSession) -> CaptureSession:
        T = np.eye(4)
        T[:3, :3] = Rotation.from_euler(axes, degrees, degrees=True).as_matrix()
        return replace(session, T_world_phone=session.T_world_phone @ T, imu=None)

    return change


def _joined(rise: float, turn: float = 0.0) -> Callable[[CaptureSession], CaptureSession]:
    """Two takes in one log: the second half in a world of its own."""

    def change(session: CaptureSession) -> CaptureSession:
        T, half = session.T_world_phone.copy(), len(session.times) // 2
        T[half:, :3, 3] += [0.3, rise, 0]
        T[half:] = _turn_about(turn) @ T[half:]
        return replace(session, T_world_phone=T, imu=None)

    return change


def _turn_about(degrees: float) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3] = Rotation.from_euler("y", degrees, degrees=True).as_matrix()
    return T


def _hovering(motion: ObjectMotion, height: float) -> ObjectMotion:
    """The last rest is in the air: the object stays at a height, held by nobody."""
    T = motion.T_world_object.copy()
    part = np.clip((np.arange(len(T)) - len(T) // 2) / FPS, 0, 1)
    T[:, 2, 3] += height * part
    return replace(motion, T_world_object=T)


def _still(motion: ObjectMotion, metres: float) -> ObjectMotion:
    """Nothing happens, but for a push of so many metres."""
    T = np.repeat(motion.T_world_object[:1], len(motion.valid), axis=0)
    T[len(T) // 2 :, 0, 3] += metres
    return replace(motion, T_world_object=T)


def _dropped(motion: ObjectMotion, metres: float = 1.0) -> ObjectMotion:
    """Lifted within two seconds, and let go."""
    T = np.repeat(motion.T_world_object[:1], len(motion.valid), axis=0)
    up, fall = np.arange(2 * FPS) / (2 * FPS), np.arange(len(T)) / FPS
    T[FPS : 3 * FPS, 2, 3] += metres * (0.5 - 0.5 * np.cos(np.pi * up))
    T[3 * FPS :, 2, 3] += np.maximum(0.0, metres - 9.81 / 2 * fall[: len(T) - 3 * FPS] ** 2)
    return replace(motion, T_world_object=T)


MOUNT = {"phone on the object", "phone above the floor", "standing", "mount", "floor", "height"}
SLIP = {"mount slip", "standing", "height", "floor"}
LOG = {
    "gravity",
    "standing",
    "height",
    "floor",
    "axes",
    "units",
    "rate",
    "speed",
    "mount slip",
    "jump",
    "phone",
}
"""Words of the checks and errors that name the cause of a fault of each kind."""

SetUps = Iterator[tuple[str, Staged, set[str]]]


def set_ups(motion: ObjectMotion, mount: Mount) -> SetUps:
    """Wrong set-ups of one take: a name, what is given, and the checks that name the cause."""
    good = Staged(motion, mount, mount, motion.mesh)
    for kind in (_wrong_mounts, _wrong_meshes, _slips, _wrong_logs, _wrong_motions):
        yield from kind(good)


def _wrong_mounts(good: Staged) -> SetUps:
    mount = good.mount
    side, other, up = good.motion.T_world_object[0, :3, :3]
    for degrees in (30, 60, 90, 135, 180):
        for name, axis in (("side", side), ("other side", other), ("vertical", up)):
            wrong = replace(good, mount=_turned(mount, degrees, axis))
            yield f"mount turned by {degrees} deg about the {name}", wrong, MOUNT
    for metres in (0.1, 0.2, 0.3):
        yield f"mount {metres} m too far out", replace(good, mount=_outward(mount, metres)), MOUNT
        yield f"mount {metres} m too far in", replace(good, mount=_outward(mount, -metres)), MOUNT
    yield "mount 0.3 m too high", replace(good, mount=_moved(mount, 0.3 * up)), MOUNT
    inverted = Mount(inverse(mount.T_phone_object), "by hand")
    yield "mount the other way round", replace(good, mount=inverted), MOUNT


def _wrong_meshes(good: Staged) -> SetUps:
    causes = MOUNT | {"mesh"}
    for factor in (0.5, 0.7, 1.3, 1.5, 2.0):
        yield f"mesh at {factor}", replace(good, mesh=_scaled(good.mesh, factor)), causes
    yield "mesh of another thing", replace(good, mesh=_box(0.25, 0.9, 1.2)), causes
    yield "mesh of a small thing", replace(good, mesh=_box(0.12, 0.12, 0.12)), causes


def _slips(good: Staged) -> SetUps:
    motion, mount = good.motion, good.mount
    side, other, up = motion.T_world_object[0, :3, :3]
    for degrees, name, axis in ((10, "side", side), (30, "other side", other), (60, "side", side)):
        slip = _slip(motion, mount, degrees, axis, 0 * up)
        yield f"slip of {degrees} deg about the {name}", replace(good, motion=slip), SLIP
    for metres in (-0.1, 0.15, 0.2):
        slip = _slip(motion, mount, 0, side, metres * up)
        yield f"slip of {metres} m up the object", replace(good, motion=slip), SLIP


def _wrong_logs(good: Staged) -> SetUps:
    for rise in (0.2, -0.4, 1.0):
        yield (
            f"two takes joined, {rise} m apart in height",
            replace(good, change=_joined(rise)),
            LOG,
        )
    yield "two takes joined, a quarter turn apart", replace(good, change=_joined(0.0, 90)), LOG
    for factor in (0.25, 0.4, 4.0):
        causes = LOG | {"duration", "acceleration"}
        yield f"clock at {factor}", replace(good, change=_timed(factor)), causes
    for axes, degrees in (("x", 90), ("x", -90), ("z", 90), ("x", 180), ("x", 12), ("z", 30)):
        wrong = replace(good, change=_world(axes, degrees))
        yield f"world turned by {degrees} deg about {axes}", wrong, LOG
    for axes, degrees in (("x", 180), ("z", 90), ("y", 40)):
        wrong = replace(good, change=_camera(axes, degrees))
        yield f"camera turned by {degrees} deg about {axes}", wrong, LOG
    yield "floor given 0.9 m too low", replace(good, reading=Reading(floor=-2.0)), LOG


def _wrong_motions(good: Staged) -> SetUps:
    for metres in (0.0, 0.01):
        yield f"moved by {metres} m", replace(good, motion=_still(good.motion, metres)), {"path"}
    yield "dropped", replace(good, motion=_dropped(good.motion)), {"fall", "acceleration", "speed"}
    for height in (0.3, 0.9, 1.6):
        wrong = replace(good, motion=_hovering(good.motion, height))
        yield f"left hovering at {height} m", wrong, LOG


def wrong_set_ups(folder: Path, takes: int) -> None:
    """Print what is found of each wrong set-up, over objects, formats and noises."""
    clips = motions(folder, 10**6)
    kinds = list({name.split("_")[1]: (name, motion) for name, motion in clips}.items())
    chosen = [("demo", carried_box()), *((name, motion) for name, (_, motion) in kinds)]
    totals, count = Counter[str](), 0
    for which, (name, motion) in enumerate(chosen[: max(1, takes)]):
        mount = clamped(motion, 7 + which)
        for k, (label, staged, causes) in enumerate(set_ups(motion, mount)):
            noise, format_ = list(NOISES)[(which + k) % 5], FORMATS[(which + k) % 3]
            found = inspect(staged, format_, noise, count)
            verdict, checks = names(found)
            named = any(cause in check for cause in causes for check in checks)
            answer = "SILENT" if verdict == "good" else "named" if named else "other"
            totals[answer] += 1
            count += 1
            if answer != "named":
                print(
                    f"  {name:10s} {label:45s} {noise:13s} {answer}: {verdict}; {', '.join(checks)}"
                )
    print(f"wrong set-ups: {count}; " + ", ".join(f"{n} {a}" for a, n in totals.most_common()))


def sizes(folder: Path, takes: int) -> None:
    """Print the share of each fault that is named, by its size, over objects, formats and noises."""
    clips = {name.split("_")[1]: motion for name, motion in motions(folder, 10**6)}
    chosen = [carried_box(), *clips.values()][: max(1, takes)]
    for kind, unit, steps, causes in _SIZED:
        shares: list[str] = []
        for size in steps:
            named = sum(_is_named(kind, motion, size, causes, k) for k, motion in enumerate(chosen))
            shares.append(f"{size:g} {unit} {named / len(chosen) / len(NOISES):.0%}")
        print(f"{kind:28s} " + ", ".join(shares))


def _is_named(kind: str, motion: ObjectMotion, size: float, causes: set[str], which: int) -> int:
    """In how many of the noises one fault of one object is named."""
    mount = clamped(motion, 11 + which)
    good, named = Staged(motion, mount, mount, motion.mesh), 0
    for k, noise in enumerate(NOISES):
        found = inspect(_fault(kind, good, size), FORMATS[(which + k) % 3], noise, k)
        verdict, checks = names(found)
        named += verdict != "good" and any(cause in check for cause in causes for check in checks)
    return named


_SIZED = (
    ("mount tilted", "deg", (5, 10, 15, 20, 30), MOUNT),
    ("mount turned about up", "deg", (30, 60, 90, 135, 180), MOUNT),
    ("mount too far out", "m", (0.03, 0.06, 0.1, 0.2, 0.3), MOUNT),
    ("mount too far in", "m", (0.03, 0.06, 0.1, 0.2, 0.3), MOUNT),
    ("mesh too large", "times", (1.1, 1.3, 1.5, 2.0), MOUNT | {"mesh"}),
    ("mesh too small", "times", (0.9, 0.7, 0.5), MOUNT | {"mesh"}),
    ("slip that tilts", "deg", (2, 4, 6, 10, 20), SLIP),
    ("slip up the object", "m", (0.03, 0.06, 0.1, 0.2), SLIP),
    ("left hovering", "m", (0.05, 0.1, 0.3, 0.6, 0.9), SLIP),
    ("world tilted", "deg", (5, 10, 20, 30), LOG),
    ("moved at all", "m", (0.01, 0.03, 0.1, 0.3), {"path"}),
    ("dropped from", "m", (0.2, 0.5, 1.0), {"fall"}),
)
"""Kinds of faults with their units, sizes, and the checks that name them."""


def _fault(kind: str, good: Staged, size: float) -> Staged:
    """A take with one fault of a kind and a size."""
    side, _, up = good.motion.T_world_object[0, :3, :3]
    made: dict[str, Callable[[], Staged]] = {
        "mount tilted": lambda: replace(good, mount=_turned(good.mount, size, side)),
        "mount turned about up": lambda: replace(good, mount=_turned(good.mount, size, up)),
        "mount too far out": lambda: replace(good, mount=_outward(good.mount, size)),
        "mount too far in": lambda: replace(good, mount=_outward(good.mount, -size)),
        "mesh too large": lambda: replace(good, mesh=_scaled(good.mesh, size)),
        "mesh too small": lambda: replace(good, mesh=_scaled(good.mesh, size)),
        "slip that tilts": lambda: _slipped(good, size, side, 0 * up),
        "slip up the object": lambda: _slipped(good, 0.0, side, size * up),
        "left hovering": lambda: replace(good, motion=_hovering(good.motion, size)),
        "world tilted": lambda: replace(good, change=_world("x", size)),
        "moved at all": lambda: replace(good, motion=_still(good.motion, size)),
        "dropped from": lambda: replace(good, motion=_dropped(good.motion, size)),
    }
    return made[kind]()


def _slipped(good: Staged, degrees: float, axis: np.ndarray, metres: np.ndarray) -> Staged:
    return replace(good, motion=_slip(good.motion, good.mount, degrees, axis, metres))


if __name__ == "__main__":
    main()
