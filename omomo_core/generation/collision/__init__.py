"""Collision avoidance: root, limbs, feet and hands take the cheapest side of the object over time."""
