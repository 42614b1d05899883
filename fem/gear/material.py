"""Material of a gear, and the mass and inertia of a cylinder of it."""

from dataclasses import dataclass
from math import pi
from typing import NamedTuple

from fem.support.plausibility import check_density
from fem.support.representation import short
from fem.support.validation import as_floats, require_within
from fem.units import GPa


@short(E="GPa", density="kg/m^3")
@dataclass(frozen=True)
class Material:
    """Isotropic linear elasticity: E [Pa], nu [1], density [kg/m^3].

    Raises ValueError for values out of range; warns of a density that no material has.
    """

    E: float = 210 * GPa
    nu: float = 0.3
    density: float = 7850.0

    def __post_init__(self):
        as_floats(self)
        require_within("E", self.E, 0.01 * GPa, 2000 * GPa, unit=GPa, remedy="GPa (pass pascal)")
        require_within("nu", self.nu, -1.0, 0.5, remedy="(Poisson's ratio)")
        require_within("density", self.density, 1.0, 50e3, remedy="kg/m^3")
        check_density(self.density)


STEEL = Material()


class Inertia(NamedTuple):
    """Mass [kg], inertia about the axis of revolution and about transverse ones through the centre [kg m^2]."""

    mass: float
    inertia: float
    transverse: float


def cylinder(density: float, length: float, d: float, d_bore: float = 0.0) -> Inertia:
    """Mass and inertia of a hollow cylinder of a density [kg/m^3], a length and diameters [m]."""
    mass = density * length * pi / 4 * (d**2 - d_bore**2)
    inertia = mass * (d**2 + d_bore**2) / 8
    return Inertia(mass, inertia, inertia / 2 + mass * length**2 / 12)
