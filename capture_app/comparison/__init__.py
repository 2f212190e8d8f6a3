"""Comparing motions: choosing, loading, aligning and measuring what is shown side by side."""
