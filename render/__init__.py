"""Everything that goes to the eye: scenes, cameras, renderers and video."""
