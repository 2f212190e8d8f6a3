"""Rotations, rigid transforms and object encodings."""
