"""Method points: the same points measured on the phone and on the object."""
