"""How good a scan is: verdicts on pictures, cameras and surface, and what to film again."""
