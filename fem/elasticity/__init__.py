"""How a gear yields to loads on its flank: finite elements of the body, half-space and Hertz next to the load."""
