"""The scene as data: shafts with gears and bearings, the stages that couple them, the gearbox they make."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import cos, inf, isfinite, pi, sin

import xarray as xr

from exugear.force import MeshForce
from fem.gear import Gear, GearPair, require
from fem.ste import pair_of
from fem.units import mm


@dataclass(frozen=True)
class Bearing:
    """Linear bearing at one axial place of a shaft.

    radial    stiffness in x and y [N/m]
    axial     stiffness in z [N/m]
    tilt      stiffness about x and y [N m/rad]
    damping   time by which the damping follows the stiffness [s]: force = stiffness (displacement + damping velocity)
    """

    radial: float
    axial: float = 0.0
    tilt: float = 0.0
    damping: float = 0.0

    def __post_init__(self):
        for name, unit in (("radial", "N/m"), ("axial", "N/m"), ("tilt", "N m/rad"), ("damping", "s")):
            value = getattr(self, name)
            require(0 <= value < inf, f"{name} must be >= 0 {unit} and finite, got {value}")
        require(self.damping < 0.1, f"damping must be below 0.1 s, got {self.damping}; pass damping / stiffness")


@dataclass(frozen=True)
class Shaft:
    """A rigid shaft along z. Without bearings it only spins; with them it moves in space.

    parts        axial place [m] -> fem.Gear or Bearing
    inertia      about z [kg m^2]; by default solid steel discs: each gear up to the mean of its tip and root circle,
                 its bore filled by the shaft over the face width
    mass         [kg], by default of the same discs
    transverse   inertia about x and y at the centre of mass [kg m^2]; by default inertia / 2 and the gears' widths and
                 places

    Raises ValueError for shafts without gears, negative inertia, bearings that leave the shaft loose.
    """

    name: str
    parts: Mapping[float, Gear | Bearing]
    inertia: float = field(default=None, kw_only=True)  # type: ignore[assignment]
    mass: float = field(default=None, kw_only=True)  # type: ignore[assignment]
    transverse: float = field(default=None, kw_only=True)  # type: ignore[assignment]
    centre: float = field(init=False, repr=False)

    def __post_init__(self):
        require(isinstance(self.parts, Mapping), f"parts must map axial places to gears and bearings, got {self.parts}")
        object.__setattr__(self, "parts", dict(sorted(self.parts.items())))
        for axial, part in self.parts.items():
            require(isinstance(part, Gear | Bearing), f"parts holds fem.Gear and Bearing, got {part} at {axial:g} m")
            place = f"axial places must lie within 10 m, got {axial:g}; pass metres: 30*mm"
            require(isfinite(axial) and abs(axial) < 10, place)
        require(bool(self.gears), f"shaft {self.name!r} carries no gear; add one to parts")
        self._fill_defaults()
        for name, unit in (("inertia", "kg m^2"), ("mass", "kg"), ("transverse", "kg m^2")):
            value = getattr(self, name)
            require(0 < value < inf, f"{name} of shaft {self.name!r} must be > 0 {unit}, got {value}")
        self._check_bearings()

    def _fill_defaults(self) -> None:
        discs = [(axial, gear.b, mean_radius(gear), blank_mass(gear)) for axial, gear in self.gears.items()]
        total = sum(m for *_, m in discs)
        object.__setattr__(self, "centre", sum(m * axial for axial, _, _, m in discs) / total)
        if self.mass is None:
            object.__setattr__(self, "mass", total)
        if self.inertia is None:
            object.__setattr__(self, "inertia", sum(m * r**2 / 2 for _, _, r, m in discs))
        if self.transverse is None:
            lever = sum(m * (b**2 / 12 + (axial - self.centre) ** 2) for axial, b, _, m in discs) / total
            object.__setattr__(self, "transverse", self.inertia / 2 + self.mass * lever)

    def _check_bearings(self) -> None:
        if not self.bearings:
            return
        radial, axial = (sum(getattr(x, name) for x in self.bearings.values()) for name in ("radial", "axial"))
        require(radial > 0 and axial > 0, f"bearings of shaft {self.name!r} need radial and axial stiffness in all")
        middle = sum(x.radial * s for s, x in self.bearings.items()) / radial
        tilt = sum(x.tilt + x.radial * (s - middle) ** 2 for s, x in self.bearings.items())
        require(tilt > 0, f"shaft {self.name!r} is free to tilt; give its bearing tilt stiffness or add a second one")

    @property
    def gears(self) -> dict[float, Gear]:
        """Axial place [m] -> gear."""
        return {axial: part for axial, part in self.parts.items() if isinstance(part, Gear)}

    @property
    def bearings(self) -> dict[float, Bearing]:
        """Axial place [m] -> bearing."""
        return {axial: part for axial, part in self.parts.items() if isinstance(part, Bearing)}


def mean_radius(gear: Gear) -> float:
    """Mean of tip and root radius [m]."""
    return (gear.r_a + gear.r_f) / 2


def blank_mass(gear: Gear) -> float:
    """Solid disc of the gear's steel up to its mean radius [kg]."""
    return gear.material.density * gear.b * pi * mean_radius(gear) ** 2


@dataclass(frozen=True, eq=False)
class Stage:
    """One mesh: the pinion on shaft fast drives the wheel on shaft slow.

    mesh       STE map (`fem.static_transmission_error`), or a MeshForce together with its pair
    pair       by default the map's
    damping    along the line of action [N s/m], by default none
    backlash   along the line of action [m], by default the pair's
    angle      direction from the fast to the slow shaft, about z from x [rad]

    Raises ValueError where the shafts do not carry the pair's gears at one axial place.
    """

    fast: Shaft
    slow: Shaft
    mesh: xr.Dataset | MeshForce
    pair: GearPair = field(default=None, kw_only=True)  # type: ignore[assignment]
    damping: float | None = field(default=None, kw_only=True)
    backlash: float | None = field(default=None, kw_only=True)
    angle: float = field(default=0.0, kw_only=True)
    force: MeshForce = field(init=False, repr=False)
    places: tuple[float, float] = field(init=False, repr=False)

    def __post_init__(self):
        for name in ("fast", "slow"):
            shaft = getattr(self, name)
            require(isinstance(shaft, Shaft), f"{name} must be an exugear.Shaft, got {type(shaft).__name__}")
        require(self.fast.name != self.slow.name, f"fast and slow must be two shafts, both are {self.fast.name!r}")
        limit = f"angle must lie within 2 pi, got {self.angle:g}; pass radians: 30*deg"
        require(abs(self.angle) <= 2 * pi, limit)
        object.__setattr__(self, "force", self._given_force() if isinstance(self.mesh, MeshForce) else self._from_map())
        require(isinstance(self.pair, GearPair), f"pair must be a fem.GearPair, got {self.pair}; a MeshForce needs one")
        object.__setattr__(self, "places", self._find_gears())

    def _given_force(self) -> MeshForce:
        own = self.damping is None and self.backlash is None
        require(own, "damping and backlash belong to the MeshForce already; leave them out of the stage")
        return self.mesh  # type: ignore[return-value]

    def _from_map(self) -> MeshForce:
        kind = type(self.mesh).__name__
        require(isinstance(self.mesh, xr.Dataset), f"mesh must be an STE map or a MeshForce, got {kind}")
        if self.pair is None:
            object.__setattr__(self, "pair", pair_of(self.mesh))
        return MeshForce.from_ste(self.mesh, damping=self.damping or 0.0, backlash=self.backlash)

    def _find_gears(self) -> tuple[float, float]:
        pinions = [s for s, gear in self.fast.gears.items() if gear == self.pair.pinion]
        wheels = [s for s, gear in self.slow.gears.items() if gear == self.pair.wheel]
        require(bool(pinions), f"shaft {self.fast.name!r} does not carry the pair's pinion; add it to its parts")
        require(bool(wheels), f"shaft {self.slow.name!r} does not carry the pair's wheel; add it to its parts")
        facing = [(s, t) for s in pinions for t in wheels if abs(s - t) < 1e-6]
        where = f"{[s / mm for s in pinions]} mm, wheel at {[t / mm for t in wheels]} mm"
        require(bool(facing), f"pinion and wheel must face each other at one axial place, got pinion at {where}")
        return facing[0]


@dataclass(frozen=True, eq=False)
class Gearbox:
    """Stages that couple shafts to one tree. The first stage's fast shaft drives, the last stage's slow one is driven.

    flow       stages in the order of the power: (index, whether the fast shaft comes first)
    turns      +1 or -1 per shaft: sense of rotation about z, +1 for the driving shaft
    places     x, y of every shaft [m], the driving one at 0

    Raises ValueError for gears without mate, shafts that are not coupled or coupled twice, two shafts of one name,
    shafts with and without bearings in one box.
    """

    stages: tuple[Stage, ...]
    flow: tuple[tuple[int, bool], ...] = field(init=False, repr=False)
    turns: dict[str, int] = field(init=False, repr=False)
    places: dict[str, tuple[float, float]] = field(init=False, repr=False)

    def __post_init__(self):
        listed = isinstance(self.stages, list | tuple) and all(isinstance(stage, Stage) for stage in self.stages)
        require(listed, f"stages must be a list of Stage, got {type(self.stages).__name__}; write Gearbox([stage])")
        object.__setattr__(self, "stages", tuple(self.stages))
        require(bool(self.stages), "stages must hold at least one Stage, got none")
        self._check_names()
        self._check_mates()
        self._check_bearings()
        for name, value in zip(("flow", "turns", "places"), self._walk(), strict=True):
            object.__setattr__(self, name, value)

    @property
    def shafts(self) -> tuple[Shaft, ...]:
        """In the order of the stages, each once."""
        return tuple({shaft.name: shaft for stage in self.stages for shaft in (stage.fast, stage.slow)}.values())

    @property
    def driving(self) -> Shaft:
        """Shaft whose speed is imposed."""
        return self.stages[0].fast

    @property
    def driven(self) -> Shaft:
        """Shaft that carries the load torque."""
        return self.stages[-1].slow

    @property
    def ratios(self) -> dict[str, float]:
        """Speed of every shaft over that of the driving one."""
        ratios = {self.driving.name: 1.0}
        for i, onward in self.flow:
            stage = self.stages[i]
            ratio = -stage.pair.pinion.z / stage.pair.wheel.z
            if onward:
                ratios[stage.slow.name] = ratios[stage.fast.name] * ratio
            else:
                ratios[stage.fast.name] = ratios[stage.slow.name] / ratio
        return ratios

    def static_forces(self, load: float) -> list[float]:
        """Mesh forces [N] under a load [N m] against the driven shaft's motion, > 0 on the driving flanks."""
        torque = dict.fromkeys((shaft.name for shaft in self.shafts), 0.0) | {self.driven.name: load}
        forces = [0.0] * len(self.stages)
        for i, onward in reversed(self.flow):
            stage = self.stages[i]
            r_b1, r_b2 = stage.pair.pinion.r_b, stage.pair.wheel.r_b
            forces[i] = torque[stage.slow.name] / r_b2 if onward else -torque[stage.fast.name] / r_b1
            if onward:
                torque[stage.fast.name] += forces[i] * r_b1
            else:
                torque[stage.slow.name] -= forces[i] * r_b2
        return forces

    def _check_names(self) -> None:
        for stage in self.stages:
            for shaft in (stage.fast, stage.slow):
                same = [other for other in self.shafts if other.name == shaft.name]
                require(same[0] == shaft, f"two different shafts are named {shaft.name!r}; rename one")

    def _check_mates(self) -> None:
        mated = {(s.fast.name, s.places[0]) for s in self.stages} | {(s.slow.name, s.places[1]) for s in self.stages}
        for shaft in self.shafts:
            alone = [axial / mm for axial in shaft.gears if (shaft.name, axial) not in mated]
            remedy = "add a stage or remove the gear"
            require(not alone, f"gear without mate on shaft {shaft.name!r} at {alone} mm; {remedy}")

    def _check_bearings(self) -> None:
        loose = [shaft.name for shaft in self.shafts if not shaft.bearings]
        either = f"shafts {loose} have no bearings, the others have; give bearings to all shafts or to none"
        require(len(loose) in (0, len(self.shafts)), either)

    def _walk(self):
        """From the driving shaft on: stages as (index, whether the fast shaft comes first), senses and places."""
        flow: list[tuple[int, bool]] = []
        turns, places = {self.driving.name: 1}, {self.driving.name: (0.0, 0.0)}
        waiting = dict(enumerate(self.stages))
        while waiting:
            near = [i for i, stage in waiting.items() if {stage.fast.name, stage.slow.name} & turns.keys()]
            unreached = [(stage.fast.name, stage.slow.name) for stage in waiting.values()]
            require(bool(near), f"stages {unreached} are not coupled to shaft {self.driving.name!r}; connect them")
            stage = waiting.pop(near[0])
            onward = stage.fast.name in turns
            old, new = (stage.fast, stage.slow) if onward else (stage.slow, stage.fast)
            twice = f"shafts {old.name!r} and {new.name!r} are coupled twice; drop a stage"
            require(new.name not in turns, twice)
            way = stage.pair.a if onward else -stage.pair.a
            x, y = places[old.name]
            flow.append((near[0], onward))
            turns[new.name] = -turns[old.name]
            places[new.name] = (x + way * cos(stage.angle), y + way * sin(stage.angle))
        return tuple(flow), turns, places
