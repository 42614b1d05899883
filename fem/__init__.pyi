from . import stress, units
from .contact.resolution import Resolution, Slices
from .elasticity.extrusion import hexahedra
from .elasticity.mesh_density import Density
from .elasticity.section_mesh import section
from .gear.data_sheet import DataSheet, Quantity
from .gear.gear import Gear
from .gear.iso1328 import FlankTolerances, drawn_deviations, iso1328
from .gear.material import STEEL, Material
from .gear.measured_flanks import flank_traces, pitch_chart, wobble
from .gear.pinion_cutter import PinionCutter
from .gear.rim_support import Bolts, Bush
from .housing.reduced_housing import ReducedHousing
from .housing.reduction import reduce_housing
from .microgeometry.deviation import Crack, Grid, OnTooth, PitchDeviation, Spall, Waviness
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
from .ste.crack import crack
from .ste.inputs import UpTo
from .ste.map_without_ring_modes import without_ring_modes
from .ste.ring_angle import over_pitches
from .ste.ring_deflection import ring_deflection
from .ste.ring_modes import ring_modes
from .ste.ste_map import load, pair_of, save, ste_from_table, ste_map
from .ste.te_measures import peak_to_peak, te_harmonics
from .ste.tooth_pairs import tooth_pair_map
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
    "Crack",
    "DataSheet",
    "Density",
    "EdgeBreak",
    "EndRelief",
    "FlankTolerances",
    "Gear",
    "GearPair",
    "Grid",
    "HelixSlope",
    "LeadCrowning",
    "MapCost",
    "Material",
    "Offsets",
    "OnTooth",
    "PinionCutter",
    "PitchDeviation",
    "ProfileCrowning",
    "Quantity",
    "ReducedHousing",
    "Resolution",
    "RootRelief",
    "Sides",
    "Slices",
    "Spall",
    "TipRelief",
    "UpTo",
    "Waviness",
    "__version__",
    "crack",
    "drawn_deviations",
    "dynamic",
    "explicit",
    "flank_measures",
    "flank_traces",
    "hexahedra",
    "iso1328",
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
    "pitch_chart",
    "reduce_housing",
    "ring_deflection",
    "ring_modes",
    "root_stress",
    "save",
    "section",
    "static_transmission_error",
    "ste_from_table",
    "ste_map",
    "stress",
    "te_harmonics",
    "tooth_pair_map",
    "units",
    "without_ring_modes",
    "wobble",
]
