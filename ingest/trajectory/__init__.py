"""From phone poses to the object's motion: resample, split at tracking faults, find the floor."""
