"""The weights that ship, and how to load them or a user's own."""
