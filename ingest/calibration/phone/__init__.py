"""iPhones: their sizes, and where the camera is in the body."""
