"""Damaged files of every kind that is read: refused by name or read, quickly and in little memory.

    python -m tests.fuzz_files --count 5000 --seed 1 [--kind film]

Each case damages one file (bits flipped, pieces cut, doubled, zeroed, numbers replaced) and reads it as the
program would, in a child process with 20 s of CPU and 2 GB more memory. Prints what broke, and fails then.
"""

import argparse
import os
import random
import resource
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np
import trimesh

from capture_app.inspection import inspect_take
from capture_app.overlay.overlay_film import open_video
from capture_app.simulator.demo_take import box_mesh, carried_box, clamped_phone
from capture_app.simulator.simulated_phone import simulate
from ingest.animated.animated_take import to_animated_take
from ingest.animated.detect import is_animation, read_animation
from ingest.calibration.board.board_spec import parse_board
from ingest.calibration.board.board_track import track_video
from ingest.calibration.board.camera_file import load_camera
from ingest.formats import nerfcapture, stray_scanner
from ingest.formats.registry import FORMATS
from ingest.formats.still_images import load_millimetres, save_millimetres
from ingest.mesh import load_mesh
from ingest.mount_file import load_mount, save_mount
from ingest.scan.mesh_sources import read_scan_mesh
from ingest.scan.scan_pictures import load_picture
from ingest.scan.scan_sources import read_source
from omomo_core.contact.contact_file import read_contacts
from omomo_core.errors import OmocapError
from omomo_core.geometry.surface import sample_surface
from tests.log_writers import write_session

CPU_SECONDS, MEMORY = 20, 2 * 2**30
_NUMBERS = (
    b"nan",
    b"inf",
    b"1e308",
    b"-1e155",
    b"9" * 400,
    b"",
    b"0",
    b"-1",
    b"null",
    b'"x"',
    b"\xff",
)


@dataclass(frozen=True)
class Kind:
    """Files of one kind: how to make a good one, and how the program reads it."""

    make: Callable[[Path], object]
    """Writes what is read into an empty folder."""
    damaged: tuple[str, ...]
    """Patterns of the files that are damaged."""
    read: Callable[[Path], object]


def damage(data: bytes, rng: random.Random) -> bytes:
    """One to three things that happen to files."""
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        at = rng.randrange(len(data) + 1)
        length = rng.choice((1, 4, 80, 4096, max(1, len(data) // 3)))
        match rng.randrange(8):
            case 0 | 1:
                flipped = bytearray(data)
                for _ in range(rng.choice((1, 8, 64))):
                    if flipped:
                        flipped[rng.randrange(len(flipped))] ^= 1 << rng.randrange(8)
                data = bytes(flipped)
            case 2:
                data = data[:at]
            case 3:
                data = data[:at] + data[at + length :]
            case 4:
                data = data[:at] + data[at : at + length] * 2 + data[at + length :]
            case 5:
                data = data[:at] + bytes([rng.choice((0, 255))]) * length + data[at + length :]
            case 6:
                data = data[:at] + rng.randbytes(rng.randrange(1, 40)) + data[at:]
            case _:
                data = _other_number(data, at, rng)
    return data


def _other_number(data: bytes, at: int, rng: random.Random) -> bytes:
    ends = b" ,\n\r[]{}:"
    start = next((i + 1 for i in range(at - 1, max(-1, at - 60), -1) if data[i] in ends), at)
    stop = next((i for i in range(at, min(len(data), at + 60)) if data[i] in ends), at)
    return data[:start] + rng.choice(_NUMBERS) + data[stop:]


def _film(path: Path, frames: int = 24, size: tuple[int, int] = (160, 120)) -> None:
    rng = np.random.default_rng(0)
    still = cv2.GaussianBlur(rng.integers(0, 255, (size[1], size[0], 3), np.uint8), (0, 0), 2)
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=30)
        stream.width, stream.height, stream.pix_fmt = *size, "yuv420p"
        stream.time_base, stream.gop_size = Fraction(1, 30), 6
        for k in range(frames):
            frame = av.VideoFrame.from_ndarray(np.roll(still, 3 * k, axis=1), format="rgb24")
            frame.pts = k
            container.mux(stream.encode(frame))
        container.mux(stream.encode())


def _picture(path: Path) -> None:
    pixels = np.random.default_rng(1).integers(0, 255, (90, 120, 3), np.uint8)
    cv2.imwrite(str(path), cv2.GaussianBlur(pixels, (0, 0), 2))


def _take(folder: Path) -> None:
    mesh = box_mesh()
    trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).export(folder / "box.obj")
    save_mount(clamped_phone(), folder / "mount.json")


def _session(format_, *, film: bool = False) -> Callable[[Path], None]:
    def make(folder: Path) -> None:
        _take(folder)
        write_session(format_, simulate(carried_box(), clamped_phone(), seed=0), folder / "session")
        if film:
            _film(folder / "session" / "rgb.mp4")

    return make


def _inspect(folder: Path) -> None:
    inspect_take(folder / "session", folder / "box.obj", folder / "mount.json", images=True)


def _photos(folder: Path) -> None:
    for k in range(3):
        _picture(folder / f"{k}.jpg")


def _scan_photos(folder: Path) -> None:
    for file in sorted(folder.iterdir()):
        load_picture(file, keep=True)
    read_source(folder)


def _meshes(suffix: str, **options: str) -> Callable[[Path], None]:
    def make(folder: Path) -> None:
        mesh = box_mesh()
        solid = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
        solid.export(folder / f"m.{suffix}", **options)

    return make


def _only(folder: Path) -> Path:
    return next(folder.iterdir())


def _mesh(folder: Path) -> None:
    load_mesh(_only(folder))
    read_scan_mesh(_only(folder))


def _animation(folder: Path) -> None:
    path = _only(folder)
    if is_animation(path, mounted=False):
        to_animated_take(read_animation(path), None)


def _text(name: str, text: str) -> Callable[[Path], None]:
    return lambda folder: (folder / name).write_text(text, encoding="utf-8")


def _keys(folder: Path) -> None:
    rows = [f"{k / 10},{k / 50},0,1,0,0,0,1" for k in range(30)]
    (folder / "keys.csv").write_text("\n".join(["time,x,y,z,qx,qy,qz,qw", *rows, ""]))


def _usd(folder: Path) -> None:
    from pxr import Gf, Usd, UsdGeom

    stage = Usd.Stage.CreateNew(str(folder / "m.usdc"))
    mesh = UsdGeom.Mesh.Define(stage, "/box")
    corners = trimesh.creation.box((0.4, 0.3, 0.5))
    mesh.CreatePointsAttr([Gf.Vec3f(*map(float, v)) for v in corners.vertices])
    mesh.CreateFaceVertexCountsAttr([3] * len(corners.faces))
    mesh.CreateFaceVertexIndicesAttr(corners.faces.ravel().tolist())
    move = mesh.AddTranslateOp()
    for k in range(30):
        move.Set(Gf.Vec3d(0.01 * k, 0.0, 1.0), float(k))
    stage.GetRootLayer().Save()


def _usd_read(folder: Path) -> None:
    read_scan_mesh(_only(folder))
    _animation(folder)


_CONTACTS = (
    '{"version": 1, "fps": 30, "frames": 90, "segments": [{"hand": "left", "start": 4, "stop": 60, '
    '"anchor": [0.2, 0.1, 0.0]}, {"hand": "right", "start": 4, "stop": 60}]}'
)
_CAMERA = (
    '{"fx": 900.0, "fy": 900.0, "cx": 640.0, "cy": 360.0, "k1": 0.1, "width": 1280, "height": 720}'
)

KINDS: dict[str, Kind] = {
    "film of the take": Kind(_session(stray_scanner, film=True), ("session/rgb.mp4",), _inspect),
    "film of a board": Kind(
        lambda f: _film(f / "film.mp4", 40),
        ("film.mp4",),
        lambda f: track_video(f / "film.mp4", parse_board("A4")),
    ),
    "film to overlay": Kind(
        lambda f: _film(f / "film.mp4"),
        ("film.mp4",),
        lambda f: list((film := open_video(f / "film.mp4")).read(0, min(8, len(film.times)))),
    ),
    "film to scan": Kind(
        lambda f: _film(f / "film.mp4"), ("film.mp4",), lambda f: read_source(f / "film.mp4")
    ),
    "photos to scan": Kind(_photos, ("*.jpg",), _scan_photos),
    "pictures of the take": Kind(_session(nerfcapture), ("session/**/*",), _inspect),
    "PNG": Kind(lambda f: _picture(f / "a.png"), ("a.png",), lambda f: load_picture(f / "a.png", keep=False)),
    "depth map": Kind(
        lambda f: save_millimetres(np.full((48, 64), 1.5, np.float32), f / "d.png"),
        ("d.png",),
        lambda f: load_millimetres(f / "d.png"),
    ),
    "OBJ": Kind(_meshes("obj"), ("m.obj",), _mesh),
    "PLY": Kind(_meshes("ply"), ("m.ply",), _mesh),
    "ASCII PLY": Kind(_meshes("ply", encoding="ascii"), ("m.ply",), _mesh),
    "STL": Kind(_meshes("stl"), ("m.stl",), _mesh),
    "GLB": Kind(_meshes("glb"), ("m.glb",), _mesh),
    "GLB as an animation": Kind(_meshes("glb"), ("m.glb",), _animation),
    "USD": Kind(_usd, ("m.usdc",), _usd_read),
    "keyframes": Kind(_keys, ("keys.csv",), _animation),
    "mount": Kind(_take, ("mount.json",), lambda f: load_mount(f / "mount.json")),
    "contacts": Kind(
        _text("contacts.json", _CONTACTS),
        ("contacts.json",),
        lambda f: read_contacts(f / "contacts.json", 90, sample_surface(box_mesh())),
    ),
    "camera": Kind(_text("camera.json", _CAMERA), ("camera.json",), lambda f: load_camera(f / "camera.json")),
    **{f"log of {f.NAME}": Kind(_session(f), ("session/**/*",), _inspect) for f in FORMATS},
}  # fmt: skip


@dataclass(frozen=True)
class Outcome:
    """What came of a case."""

    what: str
    """"read", "refused", or what broke."""
    seconds: float


def run_case(kind: Kind, good: Path, rng: random.Random) -> Outcome:
    """Damage one file of a good set, read it in a child, and put the file back."""
    files = sorted({p for pattern in kind.damaged for p in good.glob(pattern) if p.is_file()})
    file = rng.choice(files)
    whole = file.read_bytes()
    file.write_bytes(damage(whole, rng))
    began = time.monotonic()
    try:
        return Outcome(_in_a_child(lambda: kind.read(good)), time.monotonic() - began)
    finally:
        file.write_bytes(whole)


def _in_a_child(work: Callable[[], object]) -> str:
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(read)
        os.write(write, _outcome(work).encode()[-4000:])
        os._exit(0)
    os.close(write)
    told = b""
    while piece := os.read(read, 65536):
        told += piece
    os.close(read)
    _, status = os.waitpid(child, 0)
    return told.decode() if told else f"broke: the child ended with status {status}"


def _outcome(work: Callable[[], object]) -> str:
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    most = pages * resource.getpagesize() + MEMORY
    resource.setrlimit(resource.RLIMIT_AS, (most, most))
    resource.setrlimit(resource.RLIMIT_CPU, (CPU_SECONDS, CPU_SECONDS + 1))
    with open(os.devnull, "w") as nowhere:
        os.dup2(nowhere.fileno(), 1)
        os.dup2(nowhere.fileno(), 2)
    try:
        work()
    except OmocapError as error:
        return "refused" if error.what and error.code else "broke: an error without words"
    except BaseException:
        return f"broke: {traceback.format_exc(limit=-4)}"
    return "read"


def main() -> None:
    """Run cases of all kinds in turn."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--count", type=int, default=5000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kind", choices=KINDS, action="append")
    given = parser.parse_args()
    names = given.kind or list(KINDS)
    tally, slowest = Counter[str](), 0.0
    for n, name in enumerate(names):
        share = given.count // len(names) + (n < given.count % len(names))
        with tempfile.TemporaryDirectory() as folder:
            KINDS[name].make(Path(folder))
            for k in range(share):
                outcome = run_case(
                    KINDS[name], Path(folder), random.Random(f"{given.seed} {name} {k}")
                )
                tally[outcome.what.partition(":")[0]] += 1
                slowest = max(slowest, outcome.seconds)
                if outcome.what.startswith("broke"):
                    print(f"{name}, case {k}: {outcome.what}", flush=True)
        print(f"{name}: {share} cases", flush=True)
    print(f"{dict(tally)}; the slowest took {slowest:.1f} s")
    sys.exit(1 if tally["broke"] else 0)


if __name__ == "__main__":
    main()
