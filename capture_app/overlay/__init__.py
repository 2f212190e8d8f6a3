"""The motion over a real film: where its camera was, and when."""
