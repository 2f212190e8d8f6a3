"""A result carried over to a humanoid robot: its model, its targets, its joints, and files of them."""
