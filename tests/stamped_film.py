"""Small films whose frames are told apart by their brightness, stamped as they are told."""

from fractions import Fraction
from pathlib import Path

import av
import numpy as np

RATE = 30


def film(
    path: Path,
    numbers: list[int],
    *,
    first: int = 0,
    matrix=None,
    title: str = "",
    seconds: np.ndarray | None = None,
) -> Path:
    """Write a film whose frame k is as bright as 6 k, stamped as picture number k of 30 a second.

    Or at the k-th of these seconds, to the millisecond.
    """
    with av.open(str(path), "w") as container:
        if title:
            container.metadata["title"] = title
        stream = container.add_stream(
            "libx264", rate=RATE, options={"crf": "4", "g": "10", "bf": "0"}
        )
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"
        stream.time_base = Fraction(1, 600)
        if seconds is not None:
            stream.codec_context.time_base = Fraction(1, 600)
        if matrix is not None:
            stream.set_display_matrix(matrix)
        for k in numbers:
            grey = np.full((48, 64, 3), 6 * k % 250, np.uint8)
            grey[:12, :16] = 255  # the top left corner
            frame = av.VideoFrame.from_ndarray(grey, format="rgb24")
            at = (k + first) * 600 // RATE if seconds is None else round(600 * seconds[k])
            frame.pts, frame.time_base = at, Fraction(1, 600)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return path
