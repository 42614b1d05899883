"""Decisions before a solve: coordinates of the bodies, axes of the maps, integrator and steps. No Exudyn."""
