"""Method screen: a board on the phone's own screen, seen by another camera together with the object."""
