"""How well a scan of the real garden chair agrees with masks that were checked by hand.

Usage: omocap scan ../shared/data/scan/chair_3d_scanner_app -o chair.glb
       python -m benchmarks.scan_chair chair.glb [--save DIR]

Eight of the film's pictures have masks in `chair_masks` (0 background, 128 seat and back, 255 thin
parts: armrests, legs and bars), drawn as polygons and refined by GrabCut within four pixels of them.
The table says for each how well the mesh's silhouette agrees with it (intersection over union) and
which part of the thin parts it covers. The last lines compare the height of the seat with that in the app's
own mesh of the yard, and the metres of scan, poses and LiDAR with each other.
"""

import argparse
import json
from pathlib import Path

import cv2
import numpy as np
import trimesh
from jaxtyping import Float64, Int64, UInt8

from ingest.axes import T_ZUP_ARKIT
from ingest.colmap import read_model
from ingest.mesh import load_mesh
from ingest.report.take_inspection import work_folder
from ingest.scan.cameras.reconstruction import names_of, poses_of
from omomo_core.geometry.transforms import procrustes

MASKS = Path(__file__).with_name("chair_masks")
CHAIR = Path(__file__).parents[1] / "../shared/data/scan/chair_3d_scanner_app"
THIN = 255
_STEP = 3
"""Frames of the log between two pictures."""
_SHIFT = 4
"""Fractional bits of the places that OpenCV draws at."""
_PICTURE = 1920
"""Pixels of the width that the log's intrinsics are for."""
_LEVEL = 0.95
"""Part of a normal that points up where a surface is level."""
_YARD, _LOW = 1.2, 0.15
"""Metres around the chair and from our floor within which the app's floor is looked for."""
_HALF = 0.2
"""Metres to both sides of the chair's middle over which the seat is met."""
_SEAT = 0.3, 0.5
"""Metres over the floor between which it is the seat."""


def silhouette(
    vertices: Float64[np.ndarray, "verts 3"],
    faces: Int64[np.ndarray, "faces 3"],
    P: Float64[np.ndarray, "3 4"],
    shape: tuple[int, int],
) -> UInt8[np.ndarray, "h w"]:
    """1 where a camera with the projection P sees the mesh."""
    u, v, z = P[:, :3] @ vertices.T + P[:, 3:]
    places = np.rint(np.stack([u / z, v / z], axis=1) * 2**_SHIFT).astype(np.int32)
    mask = np.zeros(shape, np.uint8)
    for triangle in places[faces]:
        cv2.fillConvexPoly(mask, triangle, 1, cv2.LINE_8, _SHIFT)
    return mask


def agreement(mesh: Path, save: Path | None) -> list[tuple[str, float, float]]:
    """Name, intersection over union and recall of thin parts for each picture that has a mask."""
    shown, model = load_mesh(mesh), read_model(work_folder(mesh) / "model")
    cameras = {image.name: image for image in model.images.values() if image.has_pose}
    rows: list[tuple[str, float, float]] = []
    for file in sorted(MASKS.glob("*.png")):
        mask = np.asarray(cv2.imread(str(file), cv2.IMREAD_GRAYSCALE), np.uint8)
        image = cameras[f"{int(file.stem.removeprefix('frame_')) // _STEP:05d}.jpg"]
        camera = model.cameras[image.camera_id]
        scale = mask.shape[1] / camera.width
        K = camera.calibration_matrix() * [[scale], [scale], [1.0]]
        # COLMAP counts pixels from the corner of the first one.
        K[:2, 2] -= 0.5
        P = K @ image.cam_from_world().matrix()
        ours = silhouette(np.asarray(shown.vertices), np.asarray(shown.faces), P, mask.shape) > 0
        theirs, thin = mask > 0, mask == THIN
        union = float((ours | theirs).sum())
        rows.append((file.stem, (ours & theirs).sum() / union, (ours & thin).sum() / thin.sum()))
        if save:
            _draw(CHAIR / f"{file.stem}.jpg", ours, theirs, save / f"{file.stem}.png")
    return rows


def _draw(picture: Path, ours: np.ndarray, theirs: np.ndarray, file: Path) -> None:
    """The picture with what the mesh lacks in blue, and what it has too much of in red."""
    bgr = cv2.resize(np.asarray(cv2.imread(str(picture))), ours.shape[::-1])
    bgr[theirs & ~ours] = [255, 60, 60]
    bgr[ours & ~theirs] = [60, 60, 255]
    cv2.imwrite(str(file), bgr)


def seat_height(mesh: Path) -> tuple[float, float, float]:
    """Height of the seat over the floor in our mesh and in the app's, and our metre in the log's.

    The app's mesh is what its LiDAR measured, laid at the logged cameras: where it shows seat and floor
    at once, their distance is in LiDAR's metre. It is not aligned with ours for that, as its thick and
    broken rims would pull; both are met from above at the same places of the seat.
    """
    ours, model = load_mesh(mesh), read_model(work_folder(mesh) / "model")
    names = names_of(model)
    T_object_camera = poses_of(model, names)
    logged = np.array([_logged(_STEP * int(name[:5])) for name in names])
    lay = procrustes(T_object_camera[:, :3, 3], logged, np.ones(len(logged)), scaled=True)
    app = trimesh.load_mesh(CHAIR / "export.obj", process=False)
    # Not scaled: LiDAR measured it from each of the cameras, which are on the whole laid on ours.
    shift = (T_object_camera[:, :3, 3] - logged @ lay.R.T).mean(axis=0)
    points = np.asarray(app.vertices) @ T_ZUP_ARKIT[:3, :3].T @ lay.R.T + shift
    theirs = trimesh.Trimesh(points, app.faces, process=False)
    flat = theirs.face_normals[:, 2] > _LEVEL
    centres = theirs.triangles_center
    near = np.linalg.norm(centres[:, :2], axis=1) < _YARD
    floor = float(np.median(centres[flat & near & (np.abs(centres[:, 2]) < _LOW), 2]))
    x, y = np.meshgrid(np.arange(-_HALF, _HALF, 0.02), np.arange(-_HALF, _HALF, 0.02))
    places = np.stack([x.ravel(), y.ravel()], axis=1)
    over_ours = _from_above(np.asarray(ours.vertices), np.asarray(ours.faces), places)
    over_app = _from_above(points, np.asarray(app.faces), places) - floor
    seat = [(h > _SEAT[0]) & (h < _SEAT[1]) for h in (over_ours, over_app)]
    both = seat[0] & seat[1]
    return float(np.median(over_ours[both])), float(np.median(over_app[both])), lay.scale


def _from_above(
    vertices: Float64[np.ndarray, "verts 3"],
    faces: Int64[np.ndarray, "faces 3"],
    places: Float64[np.ndarray, "places 2"],
) -> Float64[np.ndarray, " places"]:
    """Height of what a vertical ray meets first; NaN where it meets nothing."""
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    origins = np.column_stack([places, np.full(len(places), 3.0)])
    hits, rays, _ = mesh.ray.intersects_location(origins, np.tile([0.0, 0, -1], (len(places), 1)))
    heights = np.full(len(places), -np.inf)
    np.maximum.at(heights, rays, hits[:, 2])
    return np.where(np.isfinite(heights), heights, np.nan)


def metre_of_depth() -> tuple[float, float]:
    """LiDAR's metre in those of the logged poses, and its standard deviation.

    By the height of the camera over the floor in all depth maps against that in the log: it needs no
    feature of any picture.
    """
    pairs = [pair for file in sorted(CHAIR.glob("frame_*.json")) if (pair := _heights(file))]
    logged, measured = np.array(pairs).T
    design = np.column_stack([logged, np.ones(len(logged))])
    kept = np.ones(len(logged), np.bool_)
    line = np.zeros(2)
    for _ in range(5):
        line = np.linalg.lstsq(design[kept], measured[kept], rcond=None)[0]
        off = np.abs(measured - design @ line)
        kept = off < 3.7 * np.median(off)
    variance = (measured - design @ line)[kept].var()
    covariance = np.linalg.inv(design[kept].T @ design[kept]) * variance
    return float(line[0]), float(covariance[0, 0] ** 0.5)


def _heights(file: Path) -> tuple[float, float] | None:
    """Height of the camera in the log's world, and over the floor by the depth map."""
    record, number = json.loads(file.read_bytes()), file.stem.removeprefix("frame_")
    depth, sure = (
        cv2.imread(str(CHAIR / f"{kind}_{number}.png"), cv2.IMREAD_UNCHANGED)
        for kind in ("depth", "conf")
    )
    if depth is None or sure is None:
        return None
    metres = depth / 1e3
    K = np.array(record["intrinsics"]).reshape(3, 3)
    K[:2] *= depth.shape[1] / _PICTURE
    v, u = np.mgrid[: depth.shape[0], : depth.shape[1]] + 0.5
    rays = np.stack([(u - K[0, 2]) / K[0, 0], -(v - K[1, 2]) / K[1, 1], -np.ones_like(u)], axis=-1)
    T = np.array(record["cameraPoseARFrame"]).reshape(4, 4)
    below = -((rays @ T[1, :3]) * metres)[(sure == sure.max()) & (metres > 0.3) & (metres < 2.5)]
    counts, edges = np.histogram(below, bins=np.arange(0, 3, 0.01))
    most = edges[counts.argmax()] + 0.005
    return float(T[1, 3]), float(np.median(below[np.abs(below - most) < 0.03]))


def _logged(number: int) -> Float64[np.ndarray, "3"]:
    """Where the app says that the camera was, z up."""
    record = json.loads((CHAIR / f"frame_{number:05d}.json").read_bytes())
    T = np.array(record["cameraPoseARFrame"]).reshape(4, 4)
    return T_ZUP_ARKIT[:3, :3] @ T[:3, 3]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("mesh", type=Path)
    parser.add_argument(
        "--save", type=Path, help="folder for pictures of what is too little and too much"
    )
    given = parser.parse_args()
    if given.save:
        given.save.mkdir(parents=True, exist_ok=True)
    rows = agreement(given.mesh, given.save)
    print(f"{'picture':<14}{'IoU':>7}{'thin':>7}")
    for name, union, thin in rows:
        print(f"{name:<14}{union:7.3f}{thin:7.3f}")
    means = np.mean([row[1:] for row in rows], axis=0)
    print(f"{'mean':<14}{means[0]:7.3f}{means[1]:7.3f}")
    ours, app, factor = seat_height(given.mesh)
    print(f"seat over floor: {ours:.3f} m, by the app's mesh {app:.3f} m: {ours / app:.4f} of it")
    slope, sigma = metre_of_depth()
    print(f"the scan's metre is {factor:.4f} of that of the logged poses")
    print(f"LiDAR's, by camera heights over the floor: {slope:.3f}, standard deviation {sigma:.3f}")


if __name__ == "__main__":
    main()
