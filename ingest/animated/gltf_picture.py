"""painted: the base colour picture of a glTF primitive (glTF 2.0, sections 3.8 and 3.9)."""

from io import BytesIO

import numpy as np
from jaxtyping import Int
from PIL import Image
from pygltflib import Primitive

from ingest.animated.gltf_file import GltfFile
from ingest.mesh_texture import Paint, pixels_of


def painted(file: GltfFile, primitive: Primitive, faces: Int[np.ndarray, "faces 3"]) -> Paint:
    """Places of the triangles' corners on the picture, and the picture.

    Two times None where the primitive has no picture inside the file, or one that cannot be read: it
    shapes no motion.
    """
    try:
        material = file.gltf.materials[primitive.material or 0].pbrMetallicRoughness
        told = None if primitive.material is None or material is None else material.baseColorTexture
        if told is None:
            return None, None
        places = getattr(primitive.attributes, f"TEXCOORD_{told.texCoord or 0}")
        uv = file.array(places).astype(np.float64)[faces]
        source = file.gltf.textures[told.index or 0].source
        return uv, pixels_of(Image.open(BytesIO(_bytes(file, source or 0))))
    except Exception:  # the decoders raise anything on a damaged file
        return None, None


def _bytes(file: GltfFile, index: int) -> bytes:
    image = file.gltf.images[index]
    if image.uri:
        return file.gltf.decode_data_uri(image.uri)
    view = file.gltf.bufferViews[image.bufferView]
    first = view.byteOffset or 0
    return file.buffers[view.buffer][first : first + view.byteLength]
