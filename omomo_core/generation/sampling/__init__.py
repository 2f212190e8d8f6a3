"""Sampling: the features of both stages by diffusion over overlapping windows, without spikes."""
