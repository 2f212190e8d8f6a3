"""Which hand holds the object when, and where: decoded from probabilities or written by hand."""
