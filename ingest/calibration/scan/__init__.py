"""Method scan: the clamped phone's pictures, found again in the object's scan."""
