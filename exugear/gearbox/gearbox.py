"""The gearbox as data: stages that couple parallel shafts, in trees and in loops, and planetary sets."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property, partial
from math import hypot, isfinite, pi
from typing import Any

import numpy as np

from exugear.gearbox.drag import DragTerms
from exugear.gearbox.elastic_carrier import SeriesPin, check_carrier, pins_in_series
from exugear.gearbox.elastic_ring import ElasticRing
from exugear.gearbox.gear_train import (
    CLOSED,
    Traversal,
    meshes_of,
    shaft_positions,
    speed_ratios,
    traverse,
    traverse_shafts,
)
from exugear.gearbox.housing import Housing, Seat, check_seats, seat_label
from exugear.gearbox.inner_planets import InnerPlanets
from exugear.gearbox.mesh_phasing import SteppedPlanet, phasing
from exugear.gearbox.planetary import Planetary
from exugear.gearbox.planetary_kinematics import motions_of_members, speeds_of_members
from exugear.gearbox.planetary_phases import ring_phase
from exugear.gearbox.seats_on_shafts import (
    DragBetween,
    checked_seats,
    drags_between,
    drags_of_planets,
    without_any_drag,
    without_drags,
)
from exugear.gearbox.shaft import Shaft
from exugear.gearbox.stage import Stage
from exugear.gearbox.static_offsets import stage_offsets
from fem.support.arguments import DERIVED, Finite, Numbers, checked
from fem.support.validation import require, set_fields, text_of
from fem.units import mm

#: Share of the largest mesh force below which a force is rounding.
ROUNDING = 1e-9
#: Share of the largest mesh force below which a mesh is idle: it is the rounding of the solve.
IDLE = 1e-12
#: Share of a pitch within which the loaded flanks of a loop touch at the same time.
TOGETHER = 1e-6
#: Singular value of speeds per speeds below which they depend on one another.
DEPENDENT = 1e-9


@dataclass(frozen=True, eq=False)
class Gearbox:
    """Stages and planetary sets that couple parallel shafts.

    stages      `exugear.Stage`, `exugear.Planetary` and `InnerPlanets`, in a tree or in loops; afterwards the stages
                alone, those of a set in the order of its planets, sun first
    held        name of the shaft that the housing holds, or several: ring, sun or carrier, which take the reaction
    speeds      where sets leave several speeds free: as many names of shafts with their speeds about z in nominal
                operation, of which only the ratios count, such as speeds={"sun": 1.0, "ring": -0.2}. `run_up`
                prescribes them all in these ratios; drives and loads of `run` impose speeds or torques on any of them
    driving     shaft whose speed the drive of `run_up` prescribes, or its name: by default the first of speeds that
                turns, else the first stage's fast shaft, of a set its sun, or its ring where the sun is held
    driven      shaft that carries the load of `run_up`, or its name: by default the last stage's slow shaft, of a set
                its carrier, or its ring where the carrier is held or drives
    housing     `exugear.Housing` on whose seats bearings stand; by default it is rigid
    between     bearings whose outer rings another coaxial shaft carries, say of an idler gear: name of the shaft and
                axial position [m] of the bearing -> the same on the shaft that carries its seat, such as
                between={("idler", 0.01): ("main", 0.05)}

    Derived from them, by the name of the shaft or in the order of the stages:

    sets              the `exugear.Planetary` among the stages that were given
    ratios            speed of every shaft over that of the driving shaft, 0 if held; on a carrier that of the planet
                      itself, not that relative to the carrier. Where several speeds are free: in nominal operation
    motions           (n_free, n_shaft) speed of every shaft per speed of each of the `independent` ones
    directions        sense of rotation of every shaft about z, +1 or -1; +1 for the driving shaft and where it stands
    flank_senses      of every stage: sense +1 or -1 in which the pinion drives with the flanks for which the map is.
                      Without carriers its sense of rotation; on a carrier that of the torque that drives it
    shaft_positions   x, y of every shaft [m], the first stage's fast shaft at 0; of planets while their carrier stands
                      in the reference configuration
    phases            of every stage in the reference configuration, where all driving flanks touch, as share of a
                      pitch; in pitches of a law over several: there tooth 0 of the first gear meets tooth 0 of its
                      mate, and every further gear is mounted with tooth 0 at the pitch point of its first mesh, or the
                      next tooth behind it
    gaps              of every stage [m] where they do not, as planets have thinner (> 0) or thicker teeth (< 0) than
                      the first one

    Raises ValueError for gears without a mate, shafts that are not coupled, two shafts of the same name, loops that do
    not close, jam, do not assemble, or whose loaded flanks do not touch at the same time, and for planetary sets in
    which no member takes the reaction.
    """

    stages: tuple[Stage, ...]
    held: Sequence[str] = field(default=(), kw_only=True)
    speeds: Mapping[str, float] | None = field(default=None, kw_only=True)
    driving: Shaft = field(default=DERIVED, kw_only=True)
    driven: Shaft = field(default=DERIVED, kw_only=True)
    housing: Housing | None = field(default=None, kw_only=True)
    between: Mapping[Seat, Seat] = field(default_factory=dict, kw_only=True)
    sets: tuple[Planetary, ...] = field(init=False, repr=False)
    ratios: dict[str, float] = field(init=False, repr=False)
    motions: np.ndarray = field(init=False, repr=False)
    directions: dict[str, int] = field(init=False, repr=False)
    flank_senses: tuple[int, ...] = field(init=False, repr=False)
    shaft_positions: dict[str, tuple[float, float]] = field(init=False, repr=False)
    phases: tuple[float, ...] = field(init=False, repr=False)
    gaps: tuple[float, ...] = field(init=False, repr=False)

    def __post_init__(self):
        members = self.stages if isinstance(self.stages, list | tuple) else [self.stages]
        listed = isinstance(self.stages, list | tuple) and all(
            isinstance(x, Stage | Planetary | InnerPlanets) for x in members
        )
        kinds = f"stages must be a list of Stage, Planetary and InnerPlanets, got {type(self.stages).__name__}"
        require(listed, f"{kinds}; write Gearbox([stage])")
        stages = [stage for member in members for stage in getattr(member, "stages", (member,))]
        set_fields(self, stages=tuple(stages))
        set_fields(self, sets=tuple(member for member in members if isinstance(member, Planetary)))
        require(bool(self.stages), "stages must hold at least one Stage, got none")
        self._check_names()
        self._choose_ends()
        self._check_elastic_rings()
        self._check_mates()
        self._check_item_names()
        self._place_shafts()
        self._check_housing()
        self._check_elastic_carriers()
        self._check_loads()
        by_name = {shaft.name: shaft for shaft in self.shafts}
        seats = checked_seats(self.between, self.stages, by_name, self.shaft_positions, self.housing)
        set_fields(self, between=seats)
        ends = f"shaft {self.driving.name!r} drives and is driven; list the stage of the driven shaft last"
        require(self.driving.name != self.driven.name, f"{ends}, or name driving= and driven=")
        set_fields(self, flank_senses=self._senses_of_flanks())
        self._check_flanks()
        scene = self.stages, self.flank_senses, self.shaft_positions
        of_teeth = phasing(*scene, self._stepped_planets(members))
        set_fields(self, phases=of_teeth.phases, gaps=of_teeth.gaps)

    def __repr__(self) -> str:
        pairs = [(label, stage.pair) for label, stage in zip(self.labels, self.stages, strict=True)]
        return f"Gearbox({', '.join(f'{label}: {pair.pinion.z}/{pair.wheel.z} teeth' for label, pair in pairs)})"

    @cached_property
    def shafts(self) -> tuple[Shaft, ...]:
        """All shafts in the order of the stages, each once, a carrier behind the shafts of its first stage."""
        return tuple({shaft.name: shaft for stage in self.stages for shaft in stage.shafts}.values())

    @cached_property
    def planets(self) -> dict[str, Shaft]:
        """Carrier of each planet by the planet's name: of a shaft on a carrier that lies beside the carrier's axis."""
        carriers: dict[str, Shaft] = {}
        for stage in self.stages:
            if stage.carrier is None:
                continue
            for shaft in (stage.fast, stage.slow):
                if self._orbit(shaft, stage.carrier) > CLOSED * abs(stage.pair.a):
                    carriers[shaft.name] = stage.carrier
        return carriers

    @property
    def _orbiting(self) -> dict[str, Shaft]:
        """Carrier by the name of each planet whose carrier turns."""
        return {name: carrier for name, carrier in self.planets.items() if carrier.name not in self.held}

    @cached_property
    def elastic_rings(self) -> dict[str, ElasticRing]:
        """Rings that vibrate in modes, by the names of their shafts."""
        rings = [of_set.elastic_ring for of_set in self.sets]
        return {ring.name: ring for ring in rings if ring}

    @cached_property
    def drags_between(self) -> tuple[DragBetween, ...]:
        """Drags of bearings between shafts and of planets, which act by the difference of two speeds.

        Carriers that are held stand: planets on these are among `braked_on_ground`.
        """
        return drags_between(self.between, self.ends) + drags_of_planets(self._orbiting, self.ends)

    @cached_property
    def braked_on_ground(self) -> dict[str, Shaft]:
        """Shafts by their names with the drags that act by their own speed alone, without those of `drags_between`."""
        between = [*self.between]
        on_ground = [without_drags(x, [at for name, at in between if name == x.name]) for x in self.shafts]
        return {x.name: without_any_drag(x) if x.name in self._orbiting else x for x in on_ground}

    @cached_property
    def drag_terms(self) -> tuple[list[list[DragTerms]], list[tuple[int, int, DragTerms]]]:
        """Terms of the drags of `braked_on_ground`, by the shafts; numbers of both shafts and terms of others."""
        numbers = {shaft.name: number for number, shaft in enumerate(self.shafts)}
        on_ground = [[drag.terms for _, drag in shaft.drags] for shaft in self.braked_on_ground.values()]
        between = [(numbers[carried], numbers[carrying], drag.terms) for carried, carrying, drag in self.drags_between]
        return on_ground, between

    @cached_property
    def elastic_carriers(self) -> dict[str, Housing]:
        """Stiffness of the carriers that yield between the pins of their planets, by the names of their shafts."""
        return {x.carrier.name: x.carrier_stiffness for x in self.sets if x.carrier_stiffness}

    @cached_property
    def series_pins(self) -> dict[str, SeriesPin]:
        """Bearings of planets in series with carriers that yield, by the names of the planets."""
        planets = self.planets_by_carrier
        of_carriers = [pins_in_series(x, planets[name]) for name, x in self.elastic_carriers.items()]
        return {name: pin for pins in of_carriers for name, pin in pins.items()}

    @property
    def ring_angles(self) -> tuple[float, ...]:
        """Position of every mesh on its ring in the reference configuration [rad], as the teeth of the ring count.

        At angle 0 tooth 0 touches at the pitch point, of the first mesh of the ring; 0 of stages without a ring.
        """
        first: dict[str, tuple[float, float]] = {}
        angles = []
        for stage, phase, sense in zip(self.stages, self.phases, self.flank_senses, strict=True):
            pitch = 2 * pi / abs(stage.pair.wheel.z)
            angle, start = first.setdefault(stage.slow.name, (stage.angle, pitch * phase))
            angles.append(start - sense * (stage.angle - angle) if stage.pair.wheel.z < 0 else 0.0)
        return tuple(angles)

    @cached_property
    def planets_on_pins(self) -> tuple[str, ...]:
        """Names of the planets on elastic pins, which move in the plane or in space."""
        return tuple(shaft.name for shaft in self.shafts if shaft.name in self.planets and shaft.bearings)

    @property
    def carriers_of_pins(self) -> set[str]:
        """Names of the carriers of such planets."""
        return {self.planets[name].name for name in self.planets_on_pins}

    @property
    def planets_by_carrier(self) -> dict[str, list[Shaft]]:
        """The planets on elastic pins by the name of their carrier."""
        planets = [shaft for shaft in self.shafts if shaft.name in self.planets_on_pins]
        return {name: [x for x in planets if self.planets[x.name].name == name] for name in self.carriers_of_pins}

    @cached_property
    def arms_of_pins(self) -> dict[str, np.ndarray]:
        """(2,) position [m] of each planet on a pin from the axis of its carrier."""
        at = self.shaft_positions
        return {name: np.subtract(at[name], at[self.planets[name].name]) for name in self.planets_on_pins}

    def _orbit(self, shaft: Shaft, carrier: Shaft) -> float:
        """Distance [m] of a shaft from the axis of a carrier."""
        return hypot(*np.subtract(self.shaft_positions[shaft.name], self.shaft_positions[carrier.name]))

    @cached_property
    def inertias(self) -> dict[str, float]:
        """Inertia of each shaft about z [kg m^2], of a carrier with the masses of its planets on their circle.

        That of the end of an elastic shaft, which turns on its own, is left out.
        """
        by_name = {shaft.name: shaft.body_inertia for shaft in self.shafts}
        for shaft in self.shafts:
            if carrier := self.planets.get(shaft.name):
                by_name[carrier.name] += shaft.mass * self._orbit(shaft, carrier) ** 2
        return by_name

    @property
    def body_inertias(self) -> dict[str, float]:
        """Inertia of the body of each shaft about z [kg m^2]: `inertias`, but for planets that move on their own."""
        by_name = dict(self.inertias)
        for shaft in self.shafts:
            if shaft.name in self.planets_on_pins:
                carrier = self.planets[shaft.name]
                by_name[carrier.name] -= shaft.mass * self._orbit(shaft, carrier) ** 2
        return by_name

    @property
    def reaction_members(self) -> tuple[str, ...]:
        """Names of the shafts that do not turn: held ones, and those on a `TorqueSupport`."""
        return (*self.held, *(shaft.name for shaft in self.shafts if shaft.torque_supports))

    @property
    def turning_inertias(self) -> dict[str, float]:
        """`inertias` with those of the rotors behind the couplings of each shaft [kg m^2]."""
        return {shaft.name: self.inertias[shaft.name] + shaft.rotor_inertia for shaft in self.shafts}

    @cached_property
    def ends(self) -> dict[str, Shaft]:
        """Shaft by the name of each body that a drive or a load may act on: the shafts, and the rotors behind them."""
        shafts = {shaft.name: shaft for shaft in self.shafts}
        return shafts | {rotor.name: shaft for shaft in self.shafts for rotor in shaft.rotors}

    @property
    def labels(self) -> tuple[str, ...]:
        """Names of the stages, with the axial position where two couple the same shafts."""
        names = [stage.name for stage in self.stages]
        long = [f"{stage.name} at {stage.axial_positions[0] / mm:g} mm" for stage in self.stages]
        return tuple(x if names.count(name) > 1 else name for name, x in zip(names, long, strict=True))

    @property
    def rows(self) -> np.ndarray:
        """(n_stage, n_shaft) deflections of the meshes per spin of the shafts [m/rad]: deflections = rows @ spins."""
        return self._rows(self.flank_senses)

    def _rows(self, senses: Sequence[int]) -> np.ndarray:
        """`rows` for other senses of the flanks (n_stage,)."""
        column = {shaft.name: j for j, shaft in enumerate(self.shafts)}
        rows = np.zeros((len(self.stages), len(column)))
        for row, stage, sense in zip(rows, self.stages, senses, strict=True):
            r_1, r_2 = stage.pair.pinion.r_b, stage.pair.wheel.r_b
            row[column[stage.fast.name]] = sense * r_1
            row[column[stage.slow.name]] = sense * r_2
            if stage.carrier:
                row[column[stage.carrier.name]] = -sense * (r_1 + r_2)
        return rows

    @checked
    def direction_of(self, stage: Stage) -> int:
        """Sense +1 or -1 in which the pinion of a stage drives with its driving flanks, as in `flank_senses`."""
        return self.flank_senses[self.stages.index(stage)]

    @checked
    def static_forces(self, load: Finite, acceleration: Finite = 0.0) -> list[float]:
        """Mesh forces [N] under a load [N m] against the driven shaft's motion, > 0 on the driving flanks.

        acceleration   of the driving shaft [rad/s^2]; all shafts and the rotors behind their couplings follow it at
                       their ratios, and their inertia torques add to the load

        In loops the meshes share the load so that their elastic energy is least, at the largest stiffness of each.
        """
        accelerations = acceleration * self.nominal_ratios
        return self._forces_under(self.rows, self._load(load), accelerations, self.independent).tolist()

    @property
    def nominal_ratios(self) -> np.ndarray:
        """(n_shaft,) `ratios` in the order of the shafts."""
        return np.array([self.ratios[shaft.name] for shaft in self.shafts])

    @cached_property
    def cycles(self) -> np.ndarray:
        """(n_stage, n_shaft) mesh cycles per radian of each shaft; on a carrier those of the speeds in its frame."""
        column = {shaft.name: j for j, shaft in enumerate(self.shafts)}
        cycles = np.zeros((len(self.stages), len(column)))
        for row, stage in zip(cycles, self.stages, strict=True):
            row[column[stage.fast.name]] = stage.pair.pinion.z / (2 * pi)
            if stage.carrier:
                row[column[stage.carrier.name]] = -stage.pair.pinion.z / (2 * pi)
        return cycles

    def _load(self, load: float) -> np.ndarray:
        """(n_shaft,) torques about z [N m] of a load against the motion of the driven shaft."""
        torques = np.zeros(len(self.shafts))
        torques[self.shafts.index(self.driven)] = -self.directions[self.driven.name] * load
        return torques

    @checked
    def forces_under(self, torques: Numbers, acceleration: Finite, *, held: str) -> np.ndarray:
        """(n_stage,) mesh forces [N] under torques (n_shaft,) about z on the shafts [N m], as `static_forces`.

        acceleration   of the driving shaft [rad/s^2]
        held           name of the shaft whose speed is imposed; its drive takes the torque that is left
        """
        shafts = [shaft.name for shaft in self.shafts]
        shape = f"torques must have the shape ({len(shafts)},), a value for each of {shafts}, got {np.shape(torques)}"
        require(np.shape(torques) == (len(shafts),), shape)
        require(held in shafts, f"held must be one of the shafts {shafts}, got {held!r}")
        return forces_of_motion(self, torques, acceleration * self.nominal_ratios, anchors_of(self, [held]))

    def _forces_under(self, rows: np.ndarray, torques, accelerations, held: Sequence[str]) -> np.ndarray:
        """`forces_of_motion` with rows for other senses of the flanks."""
        shafts = [shaft.name for shaft in self.shafts]
        inertia_torques = np.array([self.turning_inertias[name] for name in shafts]) * accelerations
        root = np.sqrt([stage.force.stiffness_max for stage in self.stages])
        free = [name not in held and name not in self.reaction_members for name in shafts]
        balance = (rows * root[:, None]).T[free]
        forces = root * np.linalg.lstsq(balance, np.subtract(torques, inertia_torques)[free])[0]
        return np.where(np.abs(forces) > IDLE * np.abs(forces).max(), forces, 0.0)

    @checked
    def offsets(self, stage: Stage) -> dict[str, float]:
        """a [m], misalignment [rad] and axial [m] of a stage whose shafts are displaced (signs as in `fem.Offsets`)."""
        return stage_offsets(stage, self.shaft_positions, self.direction_of(stage))

    def _stepped_planets(self, members: Sequence[Any]) -> list[SteppedPlanet]:
        """First planets of sets with stepped planets."""
        numbers = {id(stage): number for number, stage in enumerate(self.stages)}
        sets = [member for member in members if isinstance(member, Planetary) and member.stepped]
        stepped = []
        for each in sets:
            sun, ring = (numbers[id(stage)] for stage in each.stages[:2])
            step = {"step_angle": each.step_angle[0], "tooth": each.teeth[0]}
            at_sun, at_ring = (stage.pair for stage in each.stages[:2])
            ring_phase_of = partial(ring_phase, at_sun, at_ring, **step)  # type: ignore[arg-type]
            stepped.append(SteppedPlanet(sun, ring, ring_phase_of))
        return stepped

    def _check_names(self) -> None:
        carriers: dict[str, str] = {}
        for of_set in self.sets:
            for planet in of_set.planet_shafts:
                carrier = carriers.setdefault(planet.name, of_set.carrier.name)
                both = f"planets on the carriers {carrier!r} and {of_set.carrier.name!r} are named {planet.name!r}"
                require(carrier == of_set.carrier.name, f"{both}; give one of the sets a name, Planetary(name=...)")
        for stage in self.stages:
            for shaft in stage.shafts:
                namesake = next(listed for listed in self.shafts if listed.name == shaft.name)
                require(namesake == shaft, f"two different shafts are named {shaft.name!r}; rename one")

    def _choose_ends(self) -> None:
        """Driving, driven and held shafts, by their names or by default; ValueError for shafts that do not exist."""
        names = [shaft.name for shaft in self.shafts]
        listed = isinstance(self.held, str | list | tuple) and all(isinstance(name, str) for name in self.held)
        require(listed, f"held must be the name of a shaft, or a list of names, got {text_of(self.held)}")
        held = (self.held,) if isinstance(self.held, str) else tuple(self.held)
        unknown = [name for name in held if name not in names]
        require(not unknown, f"held: no shafts {unknown}; the shafts are {names}")
        set_fields(self, held=held)
        first, last = self._members(self.stages[0]), self._members(self.stages[-1])
        self._check_speeds(names)
        turning = [self.ends[name] for name, speed in (self.speeds or {}).items() if speed]
        driving = self._end("driving", turning or [first["sun"], first["ring"]])
        set_fields(self, driving=driving)
        candidates = [last["carrier"], last["ring"], last["sun"]] if self.stages[-1].carrier else [last["ring"]]
        imposed = driving.name, *(self.speeds or ())
        candidates = sorted(candidates, key=lambda shaft: shaft.name in imposed)
        set_fields(self, driven=self._end("driven", candidates))

    def _check_elastic_rings(self) -> None:
        """ValueError for rings with modes that are not held, or mesh with other gears than the planets of their set."""
        for of_set in self.sets:
            if of_set.elastic_ring is None:
                continue
            name = of_set.ring.name
            require(name in self.held, f"ring {name!r} has modes, but turns; hold it, Gearbox(..., held={name!r})")
            others = [stage.name for stage in self.stages if of_set.ring in stage.shafts and stage not in of_set.stages]
            require(not others, f"ring {name!r} has modes, which stages {others} do not know; leave ring_modes= out")

    def _check_elastic_carriers(self) -> None:
        """ValueError for carriers with two stiffnesses, and for seats that are none of their bearings."""
        names = [of_set.carrier.name for of_set in self.sets if of_set.carrier_stiffness]
        twice = f"carriers {sorted({name for name in names if names.count(name) > 1})} have a carrier_stiffness twice"
        require(len({*names}) == len(names), f"{twice}; pass a single one over the pins of all sets of the carrier")
        for name, stiffness in self.elastic_carriers.items():
            check_carrier(stiffness, self.ends[name], self.planets_by_carrier.get(name, []))

    def _check_speeds(self, names: Sequence[str]) -> None:
        """ValueError for speeds of shafts that do not exist or are held, that are not finite, or all 0."""
        if self.speeds is None:
            return
        listed = self.speeds.values() if isinstance(self.speeds, Mapping) else [None]
        mapped = bool(listed) and all(isinstance(x, int | float | Fraction) for x in listed)
        kinds = "speeds must map names of shafts to speeds, such as {'sun': 1.0, 'ring': 0.5}"
        require(mapped, f"{kinds}, got {text_of(self.speeds)}")
        unknown = [name for name in self.speeds if name not in names]
        require(not unknown, f"speeds: no shafts {unknown}; the shafts are {names}")
        held = [name for name in self.speeds if name in self.reaction_members]
        require(not held, f"speeds: shafts {held} are held; name other ones")
        turn = all(isfinite(x) for x in self.speeds.values()) and any(self.speeds.values())
        require(
            turn, f"speeds must be finite and not all 0, got {dict(self.speeds)}; of a shaft that stands pass held="
        )

    @property
    def independent(self) -> tuple[str, ...]:
        """Names of the shafts whose speeds determine all others: those of `speeds`, else the driving one."""
        return tuple(self.speeds) if self.speeds else (self.driving.name,)

    def _members(self, stage: Stage) -> dict[str, Shaft]:
        """Sun, ring and carrier of the set of a stage: of its carrier the first fast and the last slow shaft."""
        on_carrier = [x for x in self.stages if x.carrier and stage.carrier and x.carrier.name == stage.carrier.name]
        first, last = (on_carrier or [stage])[0], (on_carrier or [stage])[-1]
        return {"sun": first.fast, "ring": last.slow, "carrier": stage.carrier or last.slow}

    def _end(self, role: str, candidates: Sequence[Shaft]) -> Shaft:
        """The shaft that is given for a role, or the first of the candidates that is not held."""
        given = getattr(self, role)
        if given is None:
            return next((shaft for shaft in candidates if shaft.name not in self.reaction_members), candidates[0])
        require(isinstance(given, Shaft | str), f"{role} must be a Shaft or its name, got {text_of(given)}")
        name = given.name if isinstance(given, Shaft) else given
        shafts = {shaft.name: shaft for shaft in self.shafts}
        require(name in shafts, f"{role}: no shaft {name!r}; the shafts are {[*shafts]}")
        require(name not in self.reaction_members, f"{role}: shaft {name!r} is held; name another one")
        return shafts[name]

    def _check_item_names(self) -> None:
        """Require that the items of Exudyn's system have different names."""
        names = ["drive", *(shaft.name for shaft in self.shafts), *self.labels]
        parts = "rotor", "coupling", "drag"
        for shaft in self.shafts:
            of_rotors = {name for rotor in shaft.rotors for name in (rotor.name, rotor.spring)}
            names += [*({f"{shaft.name} {part}" for part in parts} | of_rotors)]
        shared = sorted({name for name in names if names.count(name) > 1})
        clash = f"shafts, stages and their parts in Exudyn's system would share the names {shared}"
        require(not shared, f"{clash}; rename a shaft")

    def _check_housing(self) -> None:
        if self.housing is None:
            return
        require(isinstance(self.housing, Housing), f"housing must be an exugear.Housing, got {text_of(self.housing)}")
        check_seats(self.housing, self.shafts)
        orbiting = [seat_label(seat) for seat in self.housing.seats if seat[0] in self.planets]
        on_carrier = f"housing has the seats {orbiting} of planets, whose pins orbit with their carrier"
        require(not orbiting, f"{on_carrier}; their stiffness is that of Planetary(carrier_stiffness=)")

    def _check_mates(self) -> None:
        meshes = [frozenset(stage.ends) for stage in self.stages]
        for stage, mesh in zip(self.stages, meshes, strict=True):
            twice = f"gears of shafts {stage.fast.name!r} and {stage.slow.name!r} are coupled twice"
            remedy = "drop a stage, or add gears at another axial position"
            require(meshes.count(mesh) == 1, f"{twice}; {remedy}")
        mated = {end for mesh in meshes for end in mesh}
        for shaft in self.shafts:
            alone = [axial / mm for axial in shaft.gears if (shaft.name, axial) not in mated]
            remedy = "add a stage or remove the gear"
            require(not alone, f"gear without mate on shaft {shaft.name!r} at {alone} mm; {remedy}")

    def _check_loads(self) -> None:
        """Require that no forces or weight act on planets, whose coordinates turn with their carrier.

        Neither drags that need the load of a pin that turns.
        """
        loaded = [shaft.name for shaft in self.shafts if shaft.name in self.planets and shaft.is_loaded]
        turning = f"planets {loaded} have forces, unbalance or gravity, which is not modelled on shafts that orbit"
        require(not loaded, f"{turning}; leave these out")
        for drag in drags_of_planets(self._orbiting, self.ends):
            kind, pin = type(drag.drag).__name__, f"whose pin turns with {drag.carrying!r}"
            unknown = f"load of the {kind} of planet {drag.carried!r}, {pin}, is not known"
            require(not drag.drag.needs_load, f"{unknown}; pass load=... in N")

    def _place_shafts(self) -> None:
        traversal = traverse_shafts(self.stages)
        motions = self._exact_motions(traversal)
        nominal = self.speeds or {self.driving.name: 1.0}
        names = [shaft.name for shaft in self.shafts]
        first = next(iter(motions.values()))
        speeds = {name: sum(Fraction(nominal[x]) * motions[x][name] for x in nominal) for name in first}
        drives = f"speeds let the driving shaft {self.driving.name!r} stand; name another one, driving=..."
        require(speeds[self.driving.name] != 0, drives)
        ratios = {name: speed / speeds[self.driving.name] for name, speed in speeds.items()}
        directions = {name: 1 if ratio >= 0 else -1 for name, ratio in ratios.items()}
        set_fields(self, ratios={name: float(ratio) for name, ratio in ratios.items()})
        rows = [[float(motion[name]) for name in names] for motion in motions.values()]
        set_fields(self, motions=np.array(rows), directions=directions)
        set_fields(self, shaft_positions=shaft_positions(self.stages, traversal))

    def _exact_motions(self, traversal: Traversal) -> dict[str, dict[str, Fraction]]:
        """Speed of every shaft per speed of each independent one."""
        if self.speeds:
            return motions_of_members(meshes_of(self.stages), self.independent, self.reaction_members)
        name = self.driving.name
        if self.reaction_members or any(stage.carrier for stage in self.stages):
            return {name: speeds_of_members(meshes_of(self.stages), name, self.reaction_members)}
        ratios = speed_ratios(self.stages, traversal)
        return {name: {shaft: ratio / ratios[name] for shaft, ratio in ratios.items()}}

    def _senses_of_flanks(self) -> tuple[int, ...]:
        """Sense of the driving flanks of each stage (`flank_senses`).

        Along gears that mesh with one another the senses follow: a gear between two mates is pushed on the one flank
        and pushes with the other one. In a train on a carrier that of all is set by its most loaded mesh.
        """
        senses = [self.directions[stage.fast.name] for stage in self.stages]
        edges, waiting = [stage.ends for stage in self.stages], set(range(len(self.stages)))
        trains = []
        while waiting:
            train = traverse(edges, edges[min(waiting)][0])
            numbers = [*(i for i, _ in train.tree), *train.closing]
            waiting -= set(numbers)
            if any(self.stages[i].carrier for i in numbers):
                trains.append(numbers)
                of_gears = {edges[numbers[0]][0]: 1}
                for i, sense in train.tree:
                    reached, new = edges[i][::sense]
                    inside = self.stages[i].pair.wheel.z < 0
                    of_gears[new] = of_gears[reached] if inside else -of_gears[reached]
                for i in numbers:
                    senses[i] = of_gears[edges[i][0]]
        if trains:
            forces = self._forces_under(self._rows(senses), self._load(1.0), 0.0, self.independent)
            for numbers in trains:
                most = max(numbers, key=lambda i: abs(forces[i]))
                backwards = forces[most] < -ROUNDING * np.abs(forces).max()
                for i in numbers:
                    senses[i] *= -1 if backwards else 1
        return tuple(senses)

    def _check_flanks(self) -> None:
        """Require that all flanks that a load presses touch at the same time, also back flanks in loops."""
        forces = np.array(self.static_forces(1.0))
        backlashes = [stage.force.backlash if isfinite(stage.force.backlash) else 0.0 for stage in self.stages]
        advance = np.where(forces < -ROUNDING * np.abs(forces).max(), -np.array(backlashes), 0.0)
        ends = *self.independent, *self.reaction_members
        rows = self.rows[:, [shaft.name not in ends for shaft in self.shafts]]
        apart = np.abs(advance - rows @ np.linalg.lstsq(rows, advance)[0]).max()
        back = [stage.name for stage, x in zip(self.stages, advance, strict=True) if x]
        cause = f"stages {back} are driven from their slow shafts; name the shaft of the driving gear fast"
        pitches = [2 * pi * stage.pair.pinion.r_b / stage.pair.pinion.z for stage in self.stages]
        together = bool(apart < TOGETHER * min(pitches))
        require(together, f"loaded flanks of a loop do not touch at the same time: {cause}")


def anchors_of(gearbox: Gearbox, imposed: Sequence[str]) -> tuple[str, ...]:
    """Shafts whose speeds are imposed, followed by independent ones that with them determine all speeds."""
    names = [shaft.name for shaft in gearbox.shafts]
    chosen = [name for name in imposed if gearbox.motions[:, names.index(name)].any()]
    for name in gearbox.independent:
        columns = gearbox.motions[:, [names.index(x) for x in (*chosen, name)]]
        if name not in chosen and np.linalg.matrix_rank(columns, tol=DEPENDENT) == len(chosen) + 1:
            chosen.append(name)
    return tuple(chosen)


def motions_of(gearbox: Gearbox, names: Sequence[str]) -> np.ndarray:
    """(n_free, n_shaft) speed of every shaft about z per speed of each of n_free shafts that determine them."""
    shafts = [shaft.name for shaft in gearbox.shafts]
    return np.linalg.solve(gearbox.motions[:, [shafts.index(name) for name in names]], gearbox.motions)


def forces_of_motion(gearbox: Gearbox, torques, accelerations, held: Sequence[str]) -> np.ndarray:
    """(n_stage,) mesh forces [N] under torques about z (n_shaft,) [N m] at accelerations of all shafts (n_shaft,).

    held   names of the shafts whose speeds are imposed; their drives take the torques that are left
    """
    return gearbox._forces_under(gearbox.rows, torques, accelerations, held)


@checked
def exact_ratios(
    stages: Sequence[Stage | Planetary | InnerPlanets], *, driving: str, held: str | Sequence[str] = ()
) -> dict[str, Fraction]:
    """Exact speed of every shaft over that of the driving one in coupled sets and stages, by the names of the shafts.

    stages   as of a `Gearbox`; sets that share shafts are coupled
    driving  name of the driving shaft
    held     names of the shafts that the housing holds: another choice gives another gear

    Raises ValueError where the train jams, and where no member takes the reaction, with members to hold.
    """
    kinds = f"stages must be a list of Stage, Planetary and InnerPlanets, got {text_of(stages)}"
    members = isinstance(stages, list | tuple) and all(isinstance(x, Stage | Planetary | InnerPlanets) for x in stages)
    require(members and bool(stages), kinds)
    listed: list[Any] = [stage for member in stages for stage in getattr(member, "stages", (member,))]
    names, holds = [x.name for stage in listed for x in stage.shafts], (held,) if isinstance(held, str) else tuple(held)
    require(driving in names, f"driving must be one of {[*dict.fromkeys(names)]}, got {driving!r}")
    unknown = [name for name in holds if name not in names]
    require(not unknown, f"held must be among {[*dict.fromkeys(names)]}, got {unknown}")
    return speeds_of_members(meshes_of(listed), driving, holds)
