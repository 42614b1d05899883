"""Compliance of a gear under loads on its flank: finite elements of the body, half-space and Hertz near the load."""
