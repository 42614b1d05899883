"""Plots of what is computed at rest: STE maps, contact, stress and meshes."""
