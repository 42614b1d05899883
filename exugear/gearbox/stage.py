"""A stage as data: two gears on two shafts, the force law of their mesh, and the direction from shaft to shaft."""

from dataclasses import dataclass, field, fields, replace
from math import pi

import numpy as np
import xarray as xr

from exugear.friction.mesh_friction import MeshFriction
from exugear.gearbox.mesh_damping import check_damping, damping_of, mean_stiffness, reduced_mass
from exugear.gearbox.shaft import Shaft
from exugear.mesh_force.force import MeshForce
from fem.gear.gear import Gear
from fem.pair.pair import GearPair
from fem.ste.ste_map import pair_of
from fem.support.arguments import DERIVED, checked
from fem.support.representation import field_text, short
from fem.support.validation import require, require_finite, require_within
from fem.units import mm

#: Largest axial distance of the mid-planes of two gears that mesh [m].
FACING = 1e-6


@checked
@short(damping="N s/m", backlash="um", angle="deg", axial_position="mm")
@dataclass(frozen=True, eq=False)
class Stage:
    """One mesh: the pinion on shaft fast drives the wheel on shaft slow.

    fast, slow      `exugear.Shaft` of the pinion and of the wheel, whose mid-planes have the same axial position
    mesh            STE map (`fem.static_transmission_error`), or an `exugear.MeshForce` together with its pair
    pair            `fem.GearPair`, by default the map's
    damping         along the line of action [N s/m], by default none
    damping_ratio   instead of damping, in (0, 1), usually 0.03 to 0.17: share of the critical damping 2 sqrt(k m), with
                    the mean tangent stiffness k at the map's largest torque and the mass
                    m = 1 / (r_b1^2 / J_1 + r_b2^2 / J_2) of both shafts without the rotors behind their couplings. The
                    mode of two shafts that are free to spin has this ratio; where the drive prescribes the speed of the
                    fast shaft, the mode of the slow shaft alone has the ratio r_b2 sqrt(m / J_2) damping_ratio
    backlash        along the line of action [m], by default the pair's
    friction        `exugear.MeshFriction` of the pair, of both flanks; by default none
    angle           direction from the fast to the slow shaft, about z from x [rad]
    phase           of the mesh in the reference configuration, as share of a pitch; by default the phase that the
                    other meshes of its gears require, or 0 where they leave it free

    Derived from them:

    force             `exugear.MeshForce` with the damping
    axial_positions   of pinion and wheel on their shafts [m]

    Raises ValueError where the shafts do not carry the pair's gears at one axial position, or at several of which none
    is chosen, and for a damping that suggests another unit.
    """

    fast: Shaft
    slow: Shaft
    mesh: xr.Dataset | MeshForce
    pair: GearPair = field(default=DERIVED, kw_only=True)
    damping: float | None = field(default=None, kw_only=True)
    damping_ratio: float | None = field(default=None, kw_only=True)
    backlash: float | None = field(default=None, kw_only=True)
    friction: MeshFriction | None = field(default=None, kw_only=True)
    angle: float = field(default=0.0, kw_only=True)
    phase: float | None = field(default=None, kw_only=True)
    axial_position: float | None = field(default=None, kw_only=True)
    force: MeshForce = field(init=False, repr=False)
    axial_positions: tuple[float, float] = field(init=False, repr=False)

    def __post_init__(self):
        for name in ("fast", "slow"):
            shaft = getattr(self, name)
            require(isinstance(shaft, Shaft), f"{name} must be an exugear.Shaft, got {type(shaft).__name__}")
        require(self.fast.name != self.slow.name, f"fast and slow must be two shafts, both are {self.fast.name!r}")
        limit = f"angle must lie within 2 pi, got {self.angle:g}; pass radians: 30*deg"
        require(abs(self.angle) <= 2 * pi, limit)
        if self.phase is not None:
            require_finite("phase", self.phase, "pass a share of a pitch")
        mesh = self.mesh
        force = self._given_force(mesh) if isinstance(mesh, MeshForce) else self._force_of_map(mesh)
        object.__setattr__(self, "force", force)
        require(isinstance(self.pair, GearPair), f"pair must be a fem.GearPair, got {self.pair}; a MeshForce needs one")
        if self.friction is not None:
            self.friction.check_pair(self.pair)
        object.__setattr__(self, "axial_positions", self._find_gears())
        self._damp()

    def _given_force(self, force: MeshForce) -> MeshForce:
        unset = self.damping is None and self.backlash is None
        require(unset, "damping and backlash belong to the MeshForce already; leave them out of the stage")
        return force

    def _damp(self) -> None:
        """Give the force the damping of the ratio, and require a plausible damping."""
        mass, ratio = reduced_mass(self.pair, self.fast, self.slow), self.damping_ratio
        if ratio is not None:
            require_within("damping_ratio", ratio, 0, 1, remedy="(6 % of the critical damping: 0.06)")
            twice = f"damping_ratio replaces damping, got both: {ratio:g} and {self.force.damping:g} N s/m"
            require(self.damping is None and self.force.damping == 0, f"{twice}; leave one out")
            damping = damping_of(ratio, mean_stiffness(self.force, self.pair), mass)
            object.__setattr__(self, "force", replace(self.force, damping=damping))
        check_damping(self.force, mass)

    def _force_of_map(self, ste: xr.Dataset) -> MeshForce:
        mapped = pair_of(ste)
        if self.pair is None:
            object.__setattr__(self, "pair", mapped)
        given, of_map = ([(gear.z, gear.m_n, gear.beta) for gear in (p.pinion, p.wheel)] for p in (self.pair, mapped))
        alike = np.allclose(given, of_map, rtol=1e-9, atol=0.0)
        require(alike, f"pair must be that of the map, {mapped}, got {self.pair}; leave pair out beside a map")
        return MeshForce.from_ste(ste, damping=self.damping or 0.0, backlash=self.backlash)

    def _find_gears(self) -> tuple[float, float]:
        self._check_order()
        pinions = gear_positions(self.fast, self.pair.pinion, "pinion")
        wheels = gear_positions(self.slow, self.pair.wheel, "wheel")
        facing = [(s, t) for s in pinions for t in wheels if abs(s - t) < FACING]
        listed = f"{[s / mm for s in pinions]} mm, wheel at {[t / mm for t in wheels]} mm"
        facing_each_other = f"pinion and wheel must face each other at one axial position, got pinion at {listed}"
        require(bool(facing), f"{facing_each_other}; move a gear in the parts of its shaft")
        return self._chosen(facing)

    def _chosen(self, facing: list[tuple[float, float]]) -> tuple[float, float]:
        """The axial positions of the stage, of those where pinions and wheels face each other."""
        position, choice = self.axial_position, f"one of {[s / mm for s, _ in facing]} mm"
        if position is None:
            several = f"shafts {self.fast.name!r} and {self.slow.name!r} carry the pair more than once"
            require(len(facing) == 1, f"{several}; pass axial_position, {choice}")
            return facing[0]
        chosen = [ends for ends in facing if abs(ends[0] - position) < FACING]
        require(bool(chosen), f"axial_position must be {choice}, where the pair's gears are, got {position / mm:g} mm")
        return chosen[0]

    def _check_order(self) -> None:
        """Require that fast and slow are not swapped: the pinion on the fast shaft."""
        fast, slow, pair = self.fast.gears.values(), self.slow.gears.values(), self.pair
        swapped = pair.wheel in fast and pair.pinion in slow and pair.pinion not in fast
        meant = f"fast shaft {self.fast.name!r} carries the pair's wheel, slow shaft {self.slow.name!r} its pinion"
        remedy = "map the pair the other way round, fem.GearPair(wheel, pinion, a=...), or swap fast and slow"
        require(not swapped, f"{meant}; the pinion drives, also where it is the larger gear: {remedy}")

    @property
    def name(self) -> str:
        """Names of the fast and the slow shaft."""
        return f"{self.fast.name}-{self.slow.name}"

    @property
    def ends(self) -> tuple[tuple[str, float], tuple[str, float]]:
        """Pinion and wheel as (name of the shaft, axial position [m])."""
        return (self.fast.name, self.axial_positions[0]), (self.slow.name, self.axial_positions[1])


def gear_positions(shaft: Shaft, gear: Gear, role: str) -> list[float]:
    """Axial positions [m] of a gear on a shaft; ValueError where the shaft lacks it, naming the most similar gear."""
    positions = [axial for axial, candidate in shaft.gears.items() if candidate == gear]
    unlike = min((_differences(candidate, gear) for candidate in shaft.gears.values()), key=len)
    similar = f"the most similar gear there has {', '.join(unlike[:3])}"
    remedy = f"add it to its parts ({similar})"
    require(bool(positions), f"shaft {shaft.name!r} does not carry the pair's {role}; {remedy}")
    return positions


def _differences(candidate: Gear, wanted: Gear) -> list[str]:
    names = [part.name for part in fields(Gear) if getattr(candidate, part.name) != getattr(wanted, part.name)]
    values = [[field_text(Gear, name, getattr(gear, name)) for gear in (candidate, wanted)] for name in names]
    return [f"{name} {has} instead of {needs}" for name, (has, needs) in zip(names, values, strict=True)]
