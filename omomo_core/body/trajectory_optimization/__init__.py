"""Trajectory optimisation: a whole clip is corrected at once, by Gauss-Newton on spline coefficients."""
