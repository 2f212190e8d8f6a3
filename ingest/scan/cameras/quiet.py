"""COLMAP without its log output."""

from ingest.colmap import pycolmap

THREADS = 2
"""More gain little: reading pictures and the disk hold them up."""


def quiet() -> None:
    """Let COLMAP log nothing but errors; its defaults come back with each process."""
    pycolmap.logging.minloglevel = pycolmap.logging.Level.ERROR.value
    pycolmap.logging.stderrthreshold = pycolmap.logging.Level.ERROR.value
    pycolmap.logging.logtostderr = False
    pycolmap.logging.alsologtostderr = False
