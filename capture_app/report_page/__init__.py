"""The page of `omocap inspect --html`: one file that needs nothing else."""
