"""Diffusion in x0 form: the noise schedule, three samplers and the denoising transformer."""
