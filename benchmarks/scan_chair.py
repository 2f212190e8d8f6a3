"""How well a scan of the real garden chair agrees with masks that were checked by hand.

Usage: omocap scan ../shared/data/scan/chair_3d_scanner_app -o chair.glb
       python -m benchmarks.scan_chair chair.glb [--save DIR]

Eight of the film's pictures have masks in `chair_masks` (0 background, 128 seat and back, 255 thin
parts: armrests, legs and bars), drawn as polygons and refined by GrabCut within four pixels of them.
The table says for each how well the mesh's silhouette agrees with it (intersection over union) and
which part of the thin parts it covers. The last line compares the size with that of the app's own mesh
of the yard: the scale of the similarity that lays one on the other, wherever they are near.
"""

import argparse
import json
from pathlib import Path

import cv2
import igl
import numpy as np
import trimesh
from jaxtyping import Float64, Int64, UInt8

from ingest.axes import T_ZUP_ARKIT
from ingest.colmap_files import read_model
from ingest.mesh import load_mesh
from ingest.report.scanned import work_folder
from ingest.scan.cameras.reconstruction import names_of, poses_of
from omomo_core.geometry.procrustes import procrustes

MASKS = Path(__file__).with_name("chair_masks")
CHAIR = Path(__file__).parents[1] / "../shared/data/scan/chair_3d_scanner_app"
THIN = 255
_STEP = 3
"""Frames of the log between two pictures."""
_SHIFT = 4
"""Fractional bits of the places that OpenCV draws at."""
_FAR, _NEAR = 0.1, 0.025
"""Metres between the app's mesh and ours where they show the same, at first and in the end."""
_ABOVE = 0.05
"""Metres over the floor."""
_ROUNDS = 40


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


def size_against_app(mesh: Path) -> tuple[float, int]:
    """How many times as large as the app's chair ours is, and by how many of the app's vertices."""
    ours, model = load_mesh(mesh), read_model(work_folder(mesh) / "model")
    names = names_of(model)
    T_object_camera = poses_of(model, names)
    numbers = [_STEP * int(name[:5]) for name in names]
    logged = np.array([_logged(number) for number in numbers])
    lay = procrustes(T_object_camera[:, :3, 3], logged, np.ones(len(logged)), scaled=True)
    app = trimesh.load_mesh(CHAIR / "export.obj", process=False)
    # The app's mesh is what LiDAR measured from each camera, so it is placed by them and not scaled.
    shift = (T_object_camera[:, :3, 3] - logged @ lay.R.T).mean(axis=0)
    points, scale = np.asarray(app.vertices) @ T_ZUP_ARKIT[:3, :3].T @ lay.R.T + shift, 1.0
    vertices, faces = np.asarray(ours.vertices, float), np.asarray(ours.faces, np.int64)
    kept = np.zeros(len(points), np.bool_)
    for near in np.linspace(_FAR, _NEAR, _ROUNDS):
        away, _, nearest = igl.point_mesh_squared_distance(points, vertices, faces)
        kept = (np.asarray(away) < near**2) & (points[:, 2] > _ABOVE)
        fit = procrustes(np.asarray(nearest)[kept], points[kept], np.ones(kept.sum()), scaled=True)
        points = fit.scale * points @ fit.R.T + fit.t
        scale *= fit.scale
    return scale, int(kept.sum())


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
    scale, count = size_against_app(given.mesh)
    print(f"size: {scale:.4f} of the app's mesh ({count} of its vertices)")


if __name__ == "__main__":
    main()
