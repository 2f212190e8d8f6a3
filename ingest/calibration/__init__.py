"""Calibration of the mount: the object's pose in the frame of the clamped phone, and its bounds."""
