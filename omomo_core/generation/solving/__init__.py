"""Solving: planted feet stay in place, holding palms reach their contacts, flesh stays outside."""
