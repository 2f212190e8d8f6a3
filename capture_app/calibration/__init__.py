"""Calibrating with a person at the screen: picking points, and the guided flow."""
