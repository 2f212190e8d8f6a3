"""Many sessions at once: found, ordered, watched, and told of in one table."""
