"""Flank modifications by design, deviations by manufacture, and the flank that they add up to."""
