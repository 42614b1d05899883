"""A stage as data: two gears on two shafts, the force law of their mesh, and the direction from shaft to shaft."""

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from math import pi

import numpy as np
import xarray as xr

from exugear.gearbox.mesh_damping import check_damping, critical_damping
from exugear.gearbox.shaft import Shaft
from exugear.mesh_force.force import DAMPING_RAMP, MeshForce, damped
from exugear.mesh_force.mesh_friction import MeshFriction
from exugear.mesh_force.ring_pair import Ring, RingPair
from fem.gear.gear import Gear
from fem.pair.pair import GearPair
from fem.ste.ste_map import pair_of
from fem.support.arguments import DERIVED, checked
from fem.support.representation import field_text, short
from fem.support.validation import require, require_finite, require_within, set_fields
from fem.units import mm

#: Distance [m] within which an axial position is that of a gear.
NEAR = 1e-6
#: Least share of the narrower face that must lie opposite the mate, as for `fem.Offsets`.
LEAST_FACE = 0.1


@checked
@short(damping="N s/m", damping_ramp="um", backlash="um", angle="deg", axial_position="mm")
@dataclass(frozen=True, eq=False)
class Stage:
    """One mesh: the pinion on shaft fast drives the wheel on shaft slow.

    fast, slow      `exugear.Shaft` of the pinion and of the wheel; where the axial positions of their mid-planes
                    differ, the map must be made for that axial offset, or have it within its axis
    mesh            STE map (`fem.static_transmission_error`), or an `exugear.MeshForce` together with its pair
    pair            `fem.GearPair`, by default the map's; where the wheel is a ring, around the fast shaft, a
                    `fem.GearPair(planet, ring)` or a `RingPair`
    damping         along the line of action [N s/m], by default none
    damping_ratio   instead of damping, in (0, 1), usually 0.03 to 0.17: its share of `critical_damping`. The mode of
                    two shafts that are free to spin has this ratio; where the drive prescribes the speed of the fast
                    shaft, the mode of the slow shaft alone has the ratio r_b2 sqrt(m / J_2) damping_ratio, of two
                    equal shafts 1/sqrt(2) of it
    damping_ramp    penetration over which the damping ramps in [m], by default 1 um (`exugear.MeshForce`)
    backlash        along the line of action [m], by default the pair's
    friction        `exugear.MeshFriction` of the pair, of both flanks; by default none
    angle           direction from the fast to the slow shaft, about z from x [rad]; of a ring, whose a is < 0, from the
                    slow shaft to the fast one, which is the side where the teeth mesh
    phase           of the mesh in the reference configuration, as share of a pitch, in pitches of a law over several;
                    by default the phase that the other meshes of its gears require, or 0 where they leave it free
    carrier         `exugear.Shaft` on which the axes of the gears turn: a sun (fast) and a planet, a planet (fast) and
                    a ring, or two planets; the first stage on a carrier has its sun as fast shaft.
                    `exugear.Planetary` writes all stages of a set

    Derived from them:

    force             `exugear.MeshForce` with the damping
    axial_positions   of pinion and wheel on their shafts [m]
    critical_damping  2 sqrt(k m) [N s/m] with the mass m = 1 / (r_b1^2 / J_1 + r_b2^2 / J_2) of both shafts, free to
                      spin, without the rotors behind their couplings, on a carrier that stands, and the mean k over a
                      pitch of the tangent stiffness at the largest torque of the map, the gears aligned

    Raises ValueError where the shafts do not carry the pair's gears opposite each other, or at several axial positions
    of which none is chosen, and for a damping that suggests another unit.
    """

    fast: Shaft
    slow: Shaft
    mesh: xr.Dataset | MeshForce
    pair: GearPair | RingPair = field(default=DERIVED, kw_only=True)
    damping: float | None = field(default=None, kw_only=True)
    damping_ratio: float | None = field(default=None, kw_only=True)
    damping_ramp: float | None = field(default=None, kw_only=True)
    backlash: float | None = field(default=None, kw_only=True)
    friction: MeshFriction | None = field(default=None, kw_only=True)
    angle: float = field(default=0.0, kw_only=True)
    phase: float | None = field(default=None, kw_only=True)
    axial_position: float | None = field(default=None, kw_only=True)
    carrier: Shaft | None = field(default=None, kw_only=True)
    force: MeshForce = field(init=False, repr=False)
    axial_positions: tuple[float, float] = field(init=False, repr=False)

    def __post_init__(self):
        for name in ("fast", "slow"):
            shaft = getattr(self, name)
            require(isinstance(shaft, Shaft), f"{name} must be an exugear.Shaft, got {type(shaft).__name__}")
        require(self.fast.name != self.slow.name, f"fast and slow must be two shafts, both are {self.fast.name!r}")
        if self.carrier is not None:
            third = f"carrier must be a third shaft, got {self.carrier.name!r}, which carries a gear of the stage"
            require(self.carrier.name not in (self.fast.name, self.slow.name), third)
        limit = f"angle must lie within 2 pi, got {self.angle:g}; pass radians: 30*deg"
        require(abs(self.angle) <= 2 * pi, limit)
        if self.phase is not None:
            require_finite("phase", self.phase, "pass a share of a pitch")
        mesh = self.mesh
        force = self._given_force(mesh) if isinstance(mesh, MeshForce) else self._force_of_map(mesh)
        set_fields(self, force=force)
        given = isinstance(self.pair, GearPair | RingPair)
        require(given, f"pair must be a fem.GearPair or a RingPair, got {self.pair}; a MeshForce needs one")
        if self.friction is not None:
            self.friction.check_pair(self.pair)
        set_fields(self, axial_positions=self._find_gears())
        self._damp()

    def _given_force(self, force: MeshForce) -> MeshForce:
        unset = self.damping is None and self.damping_ramp is None and self.backlash is None
        belong = "damping, damping_ramp and backlash belong to the MeshForce already; leave them out of the stage"
        require(unset, belong)
        return force

    def _damp(self) -> None:
        """Give the force the damping of the ratio, and require a plausible damping."""
        ratio = self.damping_ratio
        if ratio is not None:
            require_within("damping_ratio", ratio, 0, 1, remedy="(6 % of the critical damping: 0.06)")
            twice = f"damping_ratio replaces damping, got both: {ratio:g} and {self.force.damping:g} N s/m"
            require(self.damping is None and self.force.damping == 0, f"{twice}; leave one out")
            set_fields(self, force=damped(self.force, ratio * self.critical_damping))
        check_damping(self.force.damping, self.critical_damping)

    def _force_of_map(self, ste: xr.Dataset) -> MeshForce:
        mapped = pair_of(ste)
        if self.pair is None:
            set_fields(self, pair=mapped)
        given, of_map = ([(gear.z, gear.m_n, gear.beta) for gear in (p.pinion, p.wheel)] for p in (self.pair, mapped))
        alike = np.allclose(given, of_map, rtol=1e-9, atol=0.0)
        require(alike, f"pair must be that of the map, {mapped}, got {self.pair}; leave pair out beside a map")
        ramp = DAMPING_RAMP if self.damping_ramp is None else self.damping_ramp
        return MeshForce.from_ste(ste, damping=self.damping or 0.0, damping_ramp=ramp, backlash=self.backlash)

    def _find_gears(self) -> tuple[float, float]:
        """Axial positions of pinion and wheel: each pinion meshes with the nearest wheel opposite it."""
        self._check_order()
        pinions = gear_positions(self.fast, self.pair.pinion, "pinion")
        wheels = gear_positions(self.slow, self.pair.wheel, "wheel")
        reach = (self.pair.pinion.b + self.pair.wheel.b) / 2 - LEAST_FACE * self.pair.b
        nearest = [(s, min(wheels, key=lambda t: abs(t - s))) for s in pinions]
        meshing = [(s, t) for s, t in nearest if abs(t - s) <= reach]
        listed = f"got pinion at {[s / mm for s in pinions]} mm, wheel at {[t / mm for t in wheels]} mm"
        opposite = "pinion and wheel must face each other along a tenth of their face width or more"
        require(bool(meshing), f"{opposite}, {listed}; move a gear in the parts of its shaft")
        return self._chosen(meshing)

    def _chosen(self, meshing: list[tuple[float, float]]) -> tuple[float, float]:
        """The axial positions of the stage, of those where pinions and wheels face each other."""
        position, choice = self.axial_position, f"one of {[s / mm for s, _ in meshing]} mm"
        if position is None:
            several = f"shafts {self.fast.name!r} and {self.slow.name!r} carry the pair more than once"
            require(len(meshing) == 1, f"{several}; pass axial_position, {choice}")
            return meshing[0]
        chosen = [ends for ends in meshing if abs(ends[0] - position) < NEAR]
        require(bool(chosen), f"axial_position must be {choice}, where the pair's gears are, got {position / mm:g} mm")
        return chosen[0]

    def _check_order(self) -> None:
        """Require that fast and slow are not swapped: the pinion on the fast shaft."""
        fast, slow, pair = self.fast.gears.values(), self.slow.gears.values(), self.pair
        swapped = pair.wheel in fast and pair.pinion in slow and pair.pinion not in fast
        meant = f"fast shaft {self.fast.name!r} carries the pair's wheel, slow shaft {self.slow.name!r} its pinion"
        remedy = "map the pair the other way round, fem.GearPair(wheel, pinion, a=...), or swap fast and slow"
        require(not swapped, f"{meant}; the pinion drives, also where it is the larger gear: {remedy}")

    @cached_property
    def critical_damping(self) -> float:
        """2 sqrt(k m) [N s/m], the damping of a damping ratio of 1."""
        return critical_damping(self.force, self.pair, self.fast, self.slow)

    @property
    def name(self) -> str:
        """Names of the fast and the slow shaft."""
        return f"{self.fast.name}-{self.slow.name}"

    @property
    def shafts(self) -> tuple[Shaft, ...]:
        """Shafts of pinion and wheel, and their carrier, if any."""
        return (self.fast, self.slow) if self.carrier is None else (self.fast, self.slow, self.carrier)

    @property
    def ends(self) -> tuple[tuple[str, float], tuple[str, float]]:
        """Pinion and wheel as (name of the shaft, axial position [m])."""
        return (self.fast.name, self.axial_positions[0]), (self.slow.name, self.axial_positions[1])


def gear_positions(shaft: Shaft, gear: Gear | Ring, role: str) -> list[float]:
    """Axial positions [m] of a gear on a shaft; ValueError where the shaft lacks it, naming the most similar gear."""
    require(bool(shaft.gears), f"shaft {shaft.name!r} carries no gear; add the pair's {role} to its parts")
    positions = [axial for axial, candidate in shaft.gears.items() if candidate == gear]
    unlike = min((_differences(candidate, gear) for candidate in shaft.gears.values()), key=len)
    similar = f"the most similar gear there has {', '.join(unlike[:3])}"
    remedy = f"add it to its parts ({similar})"
    require(bool(positions), f"shaft {shaft.name!r} does not carry the pair's {role}; {remedy}")
    return positions


def _differences(candidate: Gear | Ring, wanted: Gear | Ring) -> list[str]:
    kinds = type(candidate), type(wanted)
    if kinds[0] is not kinds[1]:
        return [f"z {candidate.z} instead of {wanted.z}"]
    names = [part.name for part in fields(kinds[0]) if getattr(candidate, part.name) != getattr(wanted, part.name)]
    values = [[field_text(kinds[0], name, getattr(gear, name)) for gear in (candidate, wanted)] for name in names]
    return [f"{name} {has} instead of {needs}" for name, (has, needs) in zip(names, values, strict=True)]


def stage_number(labels: Sequence[str], stage: int | str) -> int:
    """Number of a stage, by its number or its label; ValueError for stages that are not among the labels."""
    given = f"stage must be 0 to {len(labels) - 1}, or a label, got {stage!r}; the stages are {list(labels)}"
    require(stage in labels or stage in range(-len(labels), len(labels)), given)
    return labels.index(stage) if isinstance(stage, str) else int(stage) % len(labels)
