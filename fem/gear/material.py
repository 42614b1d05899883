"""Material of a gear."""

from dataclasses import dataclass

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
