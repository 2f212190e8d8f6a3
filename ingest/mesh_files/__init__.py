"""Readers of mesh files: each knows its format whole, and says what it leaves out."""
