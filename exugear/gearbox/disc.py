"""A rigid disc on a shaft: mass and inertia, and what they must fulfil."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf, sqrt
from typing import Any

from fem.gear.material import cylinder
from fem.support.arguments import checked
from fem.support.plausibility import check_density, check_rotor_mass
from fem.support.representation import short
from fem.support.validation import require

#: Range of the radius of gyration of discs [m], beyond which the user is taken to mean another unit.
GYRATION = 1e-5, 5.0


def require_all(owner: str, values: object, names: Mapping[str, str], low: float = 0.0) -> None:
    """Require low < value < inf for attributes of an object; names: attribute -> unit."""
    for name, unit in names.items():
        value = getattr(values, name)
        require(low < value < inf, f"{name} of {owner} must be > {low:g} {unit} and finite, got {value}")


def require_possible(owner: str, values: Any) -> None:
    """Require that the inertia about z is at most the sum of those about x and y."""
    got = f"got {values.inertia:g} and {values.transverse:g} kg m^2"
    possible = values.inertia <= 2 * values.transverse * (1 + 1e-9)
    remedy = "pass a transverse inertia of half the inertia or more"
    require(possible, f"inertia of {owner} cannot exceed twice its transverse inertia, {got}; {remedy}")


@checked
@short(mass="kg", inertia="kg m^2", transverse="kg m^2")
@dataclass(frozen=True)
class Disc:
    """A rigid body that turns with its shaft: a flywheel, a hub, the material of the shaft.

    mass         [kg]
    inertia      about z [kg m^2]
    transverse   inertia about x and y through the disc's centre of mass [kg m^2]

    Raises ValueError for impossible inertias and for values that suggest another unit.
    """

    mass: float
    inertia: float
    transverse: float

    def __post_init__(self):
        require_all("a disc", self, {"mass": "kg", "inertia": "kg m^2", "transverse": "kg m^2"})
        require_possible("a disc", self)
        gyration = sqrt(self.inertia / self.mass)
        far = f"a disc of {self.mass:g} kg and {self.inertia:g} kg m^2 has a radius of gyration of {gyration:.3g} m"
        least, largest = GYRATION
        require(least < gyration < largest, f"{far}; pass kg and kg m^2: 85 kg cm^2 are 85e-4")

    @classmethod
    @checked
    def cylinder(cls, length: float, d: float, d_bore: float = 0.0, density: float = 7850.0) -> "Disc":
        """A hollow cylinder of a length and diameters [m] and a density [kg/m^3], by default that of steel."""
        sizes = f"got length {length:g}, d {d:g}, d_bore {d_bore:g} m; pass metres: 30*mm"
        require(0 < length < 10 and 0 <= d_bore < d < 10, f"a cylinder needs length > 0 and d > d_bore >= 0, {sizes}")
        require(1 < density < 50e3, f"density must lie in (1, 50000) kg/m^3, got {density:g}")
        body = cylinder(density, length, d, d_bore)
        check_density(density)
        check_rotor_mass(body.mass)
        return cls(*body)
