"""Poses of a scan's cameras: by the poses that a phone logged, by the pictures alone, or by a model."""
