"""Objects that were animated instead of filmed: one file per kind, and the take they become."""
