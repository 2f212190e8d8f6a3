"""A ChArUco board fixed on the object: made, printed, seen by a second camera, and placed on the mesh."""
