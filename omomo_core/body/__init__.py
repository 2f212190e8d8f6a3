"""The body: model, forward kinematics, skinning, limb solvers and the shipped asset."""
