"""From gear data to static transmission error maps by finite elements."""

from fem.flank import EndRelief, HelixSlope, LeadCrowning, ProfileCrowning, RootRelief, TipRelief
from fem.gear import STEEL, Gear, GearPair, Material
from fem.offsets import Offsets
from fem.ste import load, save, ste_map
from fem.transmission import Resolution, static_transmission_error

__all__ = [
    "STEEL",
    "EndRelief",
    "Gear",
    "GearPair",
    "HelixSlope",
    "LeadCrowning",
    "Material",
    "Offsets",
    "ProfileCrowning",
    "Resolution",
    "RootRelief",
    "TipRelief",
    "load",
    "save",
    "static_transmission_error",
    "ste_map",
]
