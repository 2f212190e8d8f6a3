"""Actions as episodes of taking a prop, moving it and leaving it, one writer for each."""
