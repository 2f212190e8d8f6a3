"""Stage 1: from the object's motion to where the palms are and when they touch it."""
