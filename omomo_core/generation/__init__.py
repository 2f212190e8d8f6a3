"""From an ObjectMotion to people who move it: windows, sampling, solving, ranking."""
