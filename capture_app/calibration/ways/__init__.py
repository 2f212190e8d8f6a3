"""From recordings to a mount: each way as the command line and the jobs of the page ask for it."""
