"""Everything that comes in: phone logs, meshes and mounts become an ObjectMotion."""
