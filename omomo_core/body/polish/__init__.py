"""The whole clip re-solved at once: palms, feet, limits, collisions and balance weighed together."""
