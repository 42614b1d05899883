"""A stage as data: two gears of two shafts, the law of their mesh, and where the wheel lies."""

from dataclasses import dataclass, field, fields, replace
from math import isfinite, pi

import xarray as xr

from exugear.gearbox.mesh_damping import check_damping, damping_of, mean_stiffness, reduced_mass
from exugear.gearbox.shaft import Shaft
from exugear.mesh_force.force import MeshForce
from fem.gear.gear import Gear
from fem.pair.pair import GearPair
from fem.ste.ste_map import pair_of
from fem.support.arguments import checked
from fem.support.representation import field_text, short
from fem.support.validation import require, require_within
from fem.units import mm


@checked
@short(damping="N s/m", backlash="um", angle="deg")
@dataclass(frozen=True, eq=False)
class Stage:
    """One mesh: the pinion on shaft fast drives the wheel on shaft slow.

    mesh       STE map (`fem.static_transmission_error`), or a MeshForce together with its pair
    pair       by default the map's
    damping    along the line of action [N s/m], by default none
    damping_ratio   instead of it, in (0, 1), usually 0.03 to 0.17: damping = 2 damping_ratio sqrt(k m) with the mean
               tangent stiffness k at the map's largest torque and the mass m = 1 / (r_b1^2 / J_1 + r_b2^2 / J_2) of
               both shafts, rotors behind couplings apart. The mode of two shafts that are free to spin has this ratio;
               where the fast shaft's speed is imposed, that of the slow one alone has r_b2 sqrt(m / J_2) times it
    backlash   along the line of action [m], by default the pair's
    angle      direction from the fast to the slow shaft, about z from x [rad]
    phase      of the mesh in the reference configuration, as share of a pitch; by default what the other meshes of its
               gears leave, and 0 where they leave it free
    places     axial places of pinion and wheel on their shafts [m]

    Raises ValueError where the shafts do not carry the pair's gears at one axial place.
    """

    fast: Shaft
    slow: Shaft
    mesh: xr.Dataset | MeshForce
    pair: GearPair = field(default=None, kw_only=True)  # type: ignore[assignment]
    damping: float | None = field(default=None, kw_only=True)
    damping_ratio: float | None = field(default=None, kw_only=True)
    backlash: float | None = field(default=None, kw_only=True)
    angle: float = field(default=0.0, kw_only=True)
    phase: float | None = field(default=None, kw_only=True)
    force: MeshForce = field(init=False, repr=False)
    places: tuple[float, float] = field(init=False, repr=False)

    def __post_init__(self):
        for name in ("fast", "slow"):
            shaft = getattr(self, name)
            require(isinstance(shaft, Shaft), f"{name} must be an exugear.Shaft, got {type(shaft).__name__}")
        require(self.fast.name != self.slow.name, f"fast and slow must be two shafts, both are {self.fast.name!r}")
        limit = f"angle must lie within 2 pi, got {self.angle:g}; pass radians: 30*deg"
        require(abs(self.angle) <= 2 * pi, limit)
        share = f"phase must be finite, a share of a pitch, got {self.phase}"
        require(self.phase is None or isfinite(self.phase), share)
        object.__setattr__(self, "force", self._given_force() if isinstance(self.mesh, MeshForce) else self._from_map())
        require(isinstance(self.pair, GearPair), f"pair must be a fem.GearPair, got {self.pair}; a MeshForce needs one")
        object.__setattr__(self, "places", self._find_gears())
        self._damp()

    def _given_force(self) -> MeshForce:
        own = self.damping is None and self.backlash is None
        require(own, "damping and backlash belong to the MeshForce already; leave them out of the stage")
        return self.mesh  # type: ignore[return-value]

    def _damp(self) -> None:
        """Give the force the damping that the ratio asks for."""
        mass, ratio = reduced_mass(self.pair, self.fast, self.slow), self.damping_ratio
        if ratio is not None:
            require_within("damping_ratio", ratio, 0, 1, remedy="(6 % of the critical damping: 0.06)")
            twice = f"damping_ratio stands instead of damping, got both: {ratio:g} and {self.force.damping:g} N s/m"
            require(self.damping is None and self.force.damping == 0, f"{twice}; leave one out")
            damping = damping_of(ratio, mean_stiffness(self.force, self.pair), mass)
            object.__setattr__(self, "force", replace(self.force, damping=damping))
        check_damping(self.force, mass)

    def _from_map(self) -> MeshForce:
        if self.pair is None:
            object.__setattr__(self, "pair", pair_of(self.mesh))
        return MeshForce.from_ste(self.mesh, damping=self.damping or 0.0, backlash=self.backlash)  # type: ignore[arg-type]

    def _find_gears(self) -> tuple[float, float]:
        self._check_order()
        pinions = carried(self.fast, self.pair.pinion, "pinion")
        wheels = carried(self.slow, self.pair.wheel, "wheel")
        facing = [(s, t) for s in pinions for t in wheels if abs(s - t) < 1e-6]
        where = f"{[s / mm for s in pinions]} mm, wheel at {[t / mm for t in wheels]} mm"
        require(bool(facing), f"pinion and wheel must face each other at one axial place, got pinion at {where}")
        return facing[0]

    def _check_order(self) -> None:
        """Require the pinion on the fast shaft, where the shafts carry the pair at all."""
        fast, slow, pair = self.fast.gears.values(), self.slow.gears.values(), self.pair
        swapped = pair.wheel in fast and pair.pinion in slow and pair.pinion not in fast
        meant = f"fast shaft {self.fast.name!r} carries the pair's wheel, slow shaft {self.slow.name!r} its pinion"
        remedy = "map the pair the other way round, fem.GearPair(wheel, pinion, a=...), or swap fast and slow"
        require(not swapped, f"{meant}; the pinion drives, also where it is the larger gear: {remedy}")

    @property
    def name(self) -> str:
        """Names of fast and slow shaft."""
        return f"{self.fast.name}-{self.slow.name}"

    @property
    def ends(self) -> tuple[tuple[str, float], tuple[str, float]]:
        """Pinion and wheel as (name of the shaft, axial place [m])."""
        return (self.fast.name, self.places[0]), (self.slow.name, self.places[1])


def carried(shaft: Shaft, gear: Gear, role: str) -> list[float]:
    """Axial places [m] of a gear on a shaft; ValueError where there is none, naming the most similar one."""
    places = [axial for axial, other in shaft.gears.items() if other == gear]
    unlike = min((_differences(other, gear) for other in shaft.gears.values()), key=len)
    similar = f"the most similar gear there has {', '.join(unlike[:3])}"
    remedy = f"add it to its parts ({similar})"
    require(bool(places), f"shaft {shaft.name!r} does not carry the pair's {role}; {remedy}")
    return places


def _differences(own: Gear, wanted: Gear) -> list[str]:
    names = [part.name for part in fields(Gear) if getattr(own, part.name) != getattr(wanted, part.name)]
    values = [[field_text(Gear, name, getattr(gear, name)) for gear in (own, wanted)] for name in names]
    return [f"{name} {has} instead of {needs}" for name, (has, needs) in zip(names, values, strict=True)]
