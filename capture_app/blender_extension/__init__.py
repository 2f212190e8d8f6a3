"""The extension for Blender: results come in, go on the user's armature, and people are made for objects.

`omocap blender-extension` packs this folder. It holds no mathematics of motion: it calls the user's own
omocap in a process and reads the GLB that this writes. Only Blender registers it; other programs may
import its parts that do not need Blender.
"""


def register() -> None:
    """Add the operators, the panel and the preferences; Blender calls this."""
    from .extension_panel import register_all

    register_all()


def unregister() -> None:
    """Take them away again."""
    from .extension_panel import unregister_all

    unregister_all()
