"""From gear data to static transmission error maps by finite elements."""

from fem.flank import EndRelief, HelixSlope, LeadCrowning, ProfileCrowning, RootRelief, TipRelief
from fem.gear import STEEL, Gear, GearPair, Material
from fem.ste import load, save, ste_map
from fem.transmission import static_transmission_error

__all__ = [
    "STEEL",
    "EndRelief",
    "Gear",
    "GearPair",
    "HelixSlope",
    "LeadCrowning",
    "Material",
    "ProfileCrowning",
    "RootRelief",
    "TipRelief",
    "load",
    "save",
    "static_transmission_error",
    "ste_map",
]
