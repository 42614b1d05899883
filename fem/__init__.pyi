from . import stress, units
from .contact.resolution import Resolution, Slices
from .elasticity.extrusion import hexahedra
from .elasticity.mesh_density import Density
from .elasticity.section_mesh import section
from .gear.data_sheet import DataSheet, Quantity
from .gear.gear import Gear
from .gear.material import STEEL, Material
from .gear.pinion_cutter import PinionCutter
from .gear.rim_support import Bolts, Bush
from .microgeometry.deviation import Grid, PitchDeviation
from .microgeometry.flank import Sides
from .microgeometry.modification import (
    EdgeBreak,
    EndRelief,
    HelixSlope,
    LeadCrowning,
    ProfileCrowning,
    RootRelief,
    TipRelief,
)
from .pair import iso6336
from .pair.mirror_image import mirror_image
from .pair.offsets import Offsets
from .pair.pair import GearPair
from .reference import dynamic, explicit, nonlinear
from .ste.cost import MapCost, map_cost
from .ste.inputs import UpTo
from .ste.ring_angle import over_pitches
from .ste.ring_deflection import ring_deflection
from .ste.ste_map import load, pair_of, save, ste_from_table, ste_map
from .ste.te_measures import peak_to_peak, te_harmonics
from .ste.transmission import static_transmission_error
from .stress.flank_measures import flank_measures
from .stress.load_distribution import load_distribution
from .stress.load_factors import load_factors
from .stress.root_stress import root_stress
from .support.version import __version__

__all__ = [
    "STEEL",
    "Bolts",
    "Bush",
    "DataSheet",
    "Density",
    "EdgeBreak",
    "EndRelief",
    "Gear",
    "GearPair",
    "Grid",
    "HelixSlope",
    "LeadCrowning",
    "MapCost",
    "Material",
    "Offsets",
    "PinionCutter",
    "PitchDeviation",
    "ProfileCrowning",
    "Quantity",
    "Resolution",
    "RootRelief",
    "Sides",
    "Slices",
    "TipRelief",
    "UpTo",
    "__version__",
    "dynamic",
    "explicit",
    "flank_measures",
    "hexahedra",
    "iso6336",
    "load",
    "load_distribution",
    "load_factors",
    "map_cost",
    "mirror_image",
    "nonlinear",
    "over_pitches",
    "pair_of",
    "peak_to_peak",
    "ring_deflection",
    "root_stress",
    "save",
    "section",
    "static_transmission_error",
    "ste_from_table",
    "ste_map",
    "stress",
    "te_harmonics",
    "units",
]
