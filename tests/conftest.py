"""Fixtures shared by every test."""

import os
from pathlib import Path

import pytest

REPO = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of third-party data beside the repository; tests that need it skip without it."""
    folder = Path(os.environ.get("OMOCAP_SHARED", REPO.parent / "shared"))
    if not (folder / "data").is_dir():
        pytest.skip("third-party data folder is not there (set OMOCAP_SHARED)")
    return folder
