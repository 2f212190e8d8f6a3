"""A measured surface made into the mesh of an object: whole, small, in a frame of its own."""
