"""Steps that end with a file that is there already: the object's mesh, its scan."""

import numpy as np

from capture_app.calibration.guide.prompt import Prompt
from capture_app.calibration.guide.steps import GuideState, GuideStep, Words
from ingest.calibration.pose_file import load_similarity
from ingest.calibration.session_mount import load_scan
from ingest.colmap import read_model
from ingest.mesh import load_mesh
from omomo_core.errors import InputError


def _ask_mesh(prompt: Prompt, state: GuideState) -> Words:
    if state.mesh is not None:
        prompt.good(f"{state.mesh_file}, as before")
    else:
        path = prompt.path("Mesh of the object: OBJ, PLY, STL or GLB")
        try:
            state.mesh = load_mesh(path)
        except InputError as error:
            if error.code != "mesh-units":
                raise
            raise InputError(
                error.code,
                error.what,
                where=error.where,
                fix="Scale it in a 3D program (by 0.001 from millimetres, 0.01 from centimetres) and "
                "save it again.",
            ) from None
        state.mesh_file = path
        x, y, z = np.ptp(state.mesh.vertices, axis=0)
        prompt.good(
            f"{path.name} measures {100 * x:.0f} x {100 * y:.0f} x {100 * z:.0f} cm, "
            f"{len(state.mesh.faces):,} triangles"
        )
    return ["--object", str(state.mesh_file)]


MESH = GuideStep("The object", (), _ask_mesh, ("--object", "MESH"))


def _ask_scan(prompt: Prompt, state: GuideState) -> Words:
    path = prompt.path("Mesh that the app made in that recording")
    scan = load_scan(path)
    x, y, z = np.ptp(scan.vertices, axis=0)
    prompt.good(
        f"{path.name} measures {x:.1f} x {y:.1f} x {z:.1f} m, {len(scan.faces):,} triangles"
    )
    return ["--scan", str(path)]


SCAN = GuideStep(
    "The scan",
    (
        "Export the mesh of that very recording as the app made it: not turned, not moved, not "
        "cropped to a new origin. The floor and other things may be in it.",
    ),
    _ask_scan,
    ("--scan", "SCAN"),
)


def colmap(*words: str) -> GuideStep:
    """The model of a scan, after these words."""

    def ask(prompt: Prompt, state: GuideState) -> Words:
        path = prompt.path("COLMAP model: folder of cameras, images and points3D")
        model = read_model(path)
        prompt.good(f"{len(model.images):,} pictures, {len(model.points3D):,} points")
        return [*words, str(path)]

    return GuideStep("The scan's model", (), ask, (*words, "MODEL"))


def _ask_model_pictures(prompt: Prompt, state: GuideState) -> Words:
    path = prompt.path("Folder of its pictures, or COLMAP's database.db")
    if path.is_file():
        return ["--database", str(path)]
    count = sum(1 for file in path.rglob("*") if file.is_file())
    if not count:
        raise InputError("model-images", "There are no pictures.", where=str(path))
    prompt.good(f"{count:,} files")
    return ["--images", str(path)]


MODEL_PICTURES = GuideStep("Its pictures", (), _ask_model_pictures, ("--images", "PICTURES"))


def to_object(option: str) -> GuideStep:
    """How the model lies to the mesh, by an option of that name."""

    def ask(prompt: Prompt, state: GuideState) -> Words:
        if prompt.yes("Was the mesh made from that model, so that it has its frame?", default=True):
            return []
        path = prompt.path(
            "File with the four rows of four that take the model into the mesh's frame"
        )
        _, scale = load_similarity(path)
        prompt.good(f"it scales the model by {scale:.4g}")
        return [option, str(path)]

    return GuideStep("The model and the mesh", (), ask, (option, "MATRIX"))
