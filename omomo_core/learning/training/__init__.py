"""Training: windows drawn from clips, losses, and a loop that can be stopped and resumed."""
