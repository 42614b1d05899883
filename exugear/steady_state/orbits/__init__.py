"""Periodic orbits of a mesh in its linear surroundings: motion over mesh cycles, shooting, stability."""
