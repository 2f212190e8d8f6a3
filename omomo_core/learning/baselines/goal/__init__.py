"""GOAL (Taheri et al. 2022) adapted to moving objects, as the paper's section 5.1 describes."""
