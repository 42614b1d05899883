"""From gear data to static transmission error maps by finite elements."""

from fem.gear import STEEL, Gear, GearPair, Material

__all__ = ["STEEL", "Gear", "GearPair", "Material"]
