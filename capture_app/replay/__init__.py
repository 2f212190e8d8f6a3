"""Replay: a recorded session or a result as a scene that a browser plays."""

from pathlib import Path

VIEWER = Path(__file__).parent / "viewer"
"""The scripts, styles and page of the viewer, to be served or put into a file."""

PACK_VERSION = 2
"""Number of the layout of scene packs (docs/replay.md)."""
