"""The force law of a gear mesh, made from an STE map and tabulated for compiled code."""
