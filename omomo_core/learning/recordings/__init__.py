"""Motion for training: mocap readers, retargeting, synthesis of object motions, clip files."""
