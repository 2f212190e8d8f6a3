"""A phone that records a known motion: the demonstration take and its calibration."""
