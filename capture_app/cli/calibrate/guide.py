"""`omocap calibrate` without a method: asks what you have and walks you through recording."""


def guide() -> None:
    """Ask what the person has, walk through recording, check each step, and write the mount."""
