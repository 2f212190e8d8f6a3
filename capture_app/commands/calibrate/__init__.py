"""The ways to calibrate a mount: what each needs, for command line, jobs and HTTP alike."""
