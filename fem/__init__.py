"""From gear data to static transmission error maps by finite elements."""

from fem.accuracy import UpTo
from fem.deviation import Grid, PitchDeviation
from fem.flank import Sides
from fem.gear import STEEL, Gear, GearPair, Material
from fem.modification import EndRelief, HelixSlope, LeadCrowning, ProfileCrowning, RootRelief, TipRelief
from fem.offsets import Offsets
from fem.ste import load, save, ste_map
from fem.sweep import Resolution
from fem.transmission import static_transmission_error

__all__ = [
    "STEEL",
    "EndRelief",
    "Gear",
    "GearPair",
    "Grid",
    "HelixSlope",
    "LeadCrowning",
    "Material",
    "Offsets",
    "PitchDeviation",
    "ProfileCrowning",
    "Resolution",
    "RootRelief",
    "Sides",
    "TipRelief",
    "UpTo",
    "load",
    "save",
    "static_transmission_error",
    "ste_map",
]
