"""Where the object is in the frame of the phone clamped to it: the ways to find out, and how sure each is."""
