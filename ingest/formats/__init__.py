"""Phone logs: one file per app (detect, read and write side by side), and the choice among them."""
