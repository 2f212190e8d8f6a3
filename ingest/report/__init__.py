"""What is right and wrong with a take before time is spent on it: data, no printing."""
