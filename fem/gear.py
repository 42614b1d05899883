"""The door to the macro-geometry: gears, pairs, materials, and the checks of their input."""

from fem.checks import number, numbers, require, require_kind, require_within, told
from fem.cylindrical import Gear
from fem.material import STEEL, Material
from fem.pair import GearPair
from fem.root import involute

__all__ = [
    "STEEL",
    "Gear",
    "GearPair",
    "Material",
    "involute",
    "number",
    "numbers",
    "require",
    "require_kind",
    "require_within",
    "told",
]
