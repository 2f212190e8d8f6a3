"""Calibrating: the ways to a mount, its picture, picking points at the screen, and the guided flow."""
