"""Baselines: simpler methods that the generator is compared with."""
