"""Stage 2: from the palms and the object to the whole body."""
