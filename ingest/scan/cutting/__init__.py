"""An object cut out of the mesh of a room that an app made: where it stands, its surface, its texture."""
