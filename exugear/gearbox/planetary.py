"""A planetary set as data: sun, ring and carrier with the planets between them, from which its stages follow."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from math import cos, degrees, isfinite, pi, sin
from typing import Annotated, Any, NamedTuple

import numpy as np
import xarray as xr

from exugear.gearbox.bearing import Bearing
from exugear.gearbox.elastic_ring import ElasticRing, check_ring_modes
from exugear.gearbox.housing import Housing
from exugear.gearbox.planetary_kinematics import MeshOfMembers, speeds_of_members
from exugear.gearbox.planetary_phases import (
    check_pairs,
    effect_of_harmonics,
    fitting_teeth,
    hunting,
    meshing_sequence,
    phase_sums,
    planet_angles,
    planetary_phases,
    step_angles,
)
from exugear.gearbox.rolling_bearing import RollingBearing
from exugear.gearbox.shaft import NO_DISPLACEMENT, Placement, Shaft, parts_of
from exugear.gearbox.stage import NEAR, Stage
from exugear.mesh_force.force import MeshForce, damped, widened
from exugear.mesh_force.ring_pair import RingPair
from fem.gear.gear import Gear
from fem.microgeometry.flank import names_teeth
from fem.pair.pair import GearPair
from fem.ste.map_without_ring_modes import without_ring_modes
from fem.ste.ste_map import pair_of
from fem.support.arguments import DERIVED, checked
from fem.support.validation import numbers, require, require_finite, set_fields, text_of
from fem.units import mm

#: Largest displacement of a pin [m] and slope of its axis [rad], as of a `Placement`.
LARGEST_PIN_ERROR, LARGEST_LEAN = 0.01, 0.05
#: Share of a turn within which planets are evenly spaced.
EVEN = 1e-9


def check_planet(name: str, value) -> None:
    """ValueError unless the value is a gear, a shaft with it, or a list of them, one for each planet."""
    listed = value if isinstance(value, list | tuple) else [value]
    kinds = (
        f"{name} must be a fem.Gear, a Shaft that carries it, or a list of one for each planet, got {text_of(value)}"
    )
    require(bool(listed) and all(isinstance(x, Gear | Shaft) for x in listed), kinds)


def check_pin(name: str, value) -> None:
    """ValueError unless the value is a bearing, or a list of them, one for each planet."""
    listed = value if isinstance(value, list | tuple) else [value]
    kinds = f"{name} must be an exugear.Bearing or RollingBearing, or a list of one for each planet"
    require(
        bool(listed) and all(isinstance(x, Bearing | RollingBearing) for x in listed), f"{kinds}, got {text_of(value)}"
    )
    for bearing in listed:
        if isinstance(bearing, RollingBearing):
            free = f"{name}: the {bearing.kind} bearing lets a planet move along its pin; pass guidance= of its washers"
            require(bearing.stiffness[2, 2] > 0, f"{free} [N/m]")
            require(not bearing.cage_rolls, f"{name}: the cages of planets on pins stand; leave rolling() out")


def check_mesh(name: str, value) -> None:
    """ValueError unless the value is an STE map or a force law, or a list of them, one for each planet."""
    listed = value if isinstance(value, list | tuple) else [value]
    maps = [isinstance(x, MeshForce) or (isinstance(x, xr.Dataset) and "te" in x and "a" in x.attrs) for x in listed]
    kinds = f"{name} must be an STE map (fem.static_transmission_error) or an exugear.MeshForce, or a list of one"
    require(bool(maps) and all(maps), f"{kinds} for each planet, got {text_of(value)}")


@checked
@dataclass(frozen=True, eq=False)
class Planetary:
    """A planetary set, a member of an `exugear.Gearbox` beside stages.

    sun, ring, carrier
                  `exugear.Shaft` with the sun, with the ring (`ring_pair.wheel`), and of the carrier, which needs no
                  gear. Other stages and sets may share them: coupled sets, a stage behind the carrier
    planet        `fem.Gear`, or a `Shaft` that carries it at the sun's axial position, for another inertia and mass; or
                  a list of one for each planet, whose teeth may differ in thickness, and by that the backlash from that
                  of a map or of a force law for all planets. By default the gear of the maps.
                  Stepped planets are shafts with two gears: one at the sun's axial position, one at the ring's
    step_angle    of stepped planets: angle about z by which a tooth of the gear at the ring stands ahead of one of the
                  gear at the sun [rad], or a list of one for each planet
    tooth         of stepped planets: which tooth of each, counted counter-clockwise from the one at step_angle, is put
                  into the sun; by default teeth with which the set can be assembled
    planets       number of planets, evenly spaced from angle 0 on; by default 3
    angles        instead, of the planets about the sun from x [rad], in the reference configuration
    sun_mesh      STE map of sun and planet, or a `MeshForce` beside sun_pair; or a list of one for each planet
    ring_mesh     of planet and ring, or a `MeshForce` beside ring_pair; or a list likewise
    sun_pair      `fem.GearPair(sun, planet, a=...)`, by default that of the map
    ring_pair     `RingPair(planet, z=-99, a=-...)`, by default that of the map
    pin           `Bearing` or `RollingBearing` of every planet on the carrier, or a list of one for each; by default
                  ideal ones. A rolling bearing has its outer ring in the planet (`RollingBearing.on_pin`); needle and
                  cylindrical roller bearings need guidance= along the axis
    pin_errors    (n_planet,) tangential displacements of the pins on the carrier from the nominal position, > 0
                  counter-clockwise [m]; or (n_planet, 2): tangential and radial, > 0 outwards; or (n_planet, 4): also
                  the slopes by which the pins lean towards these directions with z, about the planets' mid-planes
                  [rad]. A pin that is displaced against the force of the planet on it gives its planet more load
    eccentricity  (e, angle) of the carrier: displacement of the circle of the pins from the axis about which it turns
                  [m], its direction from x in the reference configuration [rad]. It turns with the carrier as
                  errors of the pins do, so that shares stay. An axis of carrier, sun or ring beside the others in the
                  housing, Shaft(offset=Placement(x=...)), lets shares vary once in a turn of the carrier
    carrier_stiffness
                  `exugear.Housing` of the carrier, mounted where its shaft takes the torque: its seats are those of
                  the planets on their pins, ("planet 1", axial position), and of bearings of the carrier's shaft, its
                  axes those of the gearbox in the reference configuration, with which they turn. By default, and at
                  pins without a seat, pins follow the carrier's shaft rigidly. `load_distribution` takes it whole, runs
                  in series with each pin where that changes the energy of the pins by less than 1 %. Needs pin=
    damping, damping_ratio
                  of every mesh, as of an `exugear.Stage`; the ratio is that of planet and sun or ring on a carrier that
                  stands
    ring_modes    `fem.ring_modes(ring_pair)`: the rim vibrates in these modes, whose flexibility leaves the map of
                  ring_mesh, and planets deflect one another through it; by default the ring is as stiff as its map. The
                  gearbox must hold the ring, whose bolts or bush are its only support
    ring_damping_ratio
                  of each of these modes, as share of the critical damping
    phase         of the first planet's mesh with the sun in the reference configuration, as share of a pitch; by
                  default the phase that other meshes of the sun require, or 0 where they leave it free
    axial_position
                  of the sun's gear on its shaft [m], where that carries several alike
    name          in front of the names "planet 1", "planet 2", ..., to tell the planets of several sets apart

    Derived from them:

    stages        `exugear.Stage` of each planet with the sun and with the ring
    gears         of sun, planet and ring
    phases        `exugear.planetary_phases` while the external torque on the sun is counter-clockwise

    teeth         `tooth` of each planet

    Raises ValueError for pairs of unlike planets or centre distances, for planets that overlap or do not fit between
    the teeth (with the nearest angles that fit), and for lists that are not as long as there are planets.
    """

    sun: Shaft = field(kw_only=True)
    ring: Shaft = field(kw_only=True)
    carrier: Shaft = field(kw_only=True)
    planet: Annotated[Any, check_planet] = field(default=DERIVED, kw_only=True)
    planets: int = field(default=DERIVED, kw_only=True)
    angles: Any = field(default=DERIVED, kw_only=True)
    sun_mesh: Annotated[Any, check_mesh] = field(kw_only=True)
    ring_mesh: Annotated[Any, check_mesh] = field(kw_only=True)
    sun_pair: GearPair = field(default=DERIVED, kw_only=True)
    ring_pair: GearPair | RingPair = field(default=DERIVED, kw_only=True)
    pin: Annotated[Any, check_pin] = field(default=None, kw_only=True)
    pin_errors: Any = field(default=None, kw_only=True)
    eccentricity: Any = field(default=None, kw_only=True)
    carrier_stiffness: Housing | None = field(default=None, kw_only=True)
    damping: float | None = field(default=None, kw_only=True)
    damping_ratio: float | None = field(default=None, kw_only=True)
    step_angle: Any = field(default=0.0, kw_only=True)
    tooth: Any = field(default=None, kw_only=True)
    ring_modes: Annotated[Any, check_ring_modes] = field(default=None, kw_only=True)
    ring_damping_ratio: float = field(default=0.01, kw_only=True)
    phase: float | None = field(default=None, kw_only=True)
    axial_position: float | None = field(default=None, kw_only=True)
    name: str = field(default="", kw_only=True)
    teeth: tuple[int, ...] = field(init=False, repr=False)
    stages: tuple[Stage, ...] = field(init=False, repr=False)

    def __post_init__(self):
        for role in ("sun", "ring", "carrier"):
            shaft = getattr(self, role)
            require(isinstance(shaft, Shaft), f"{role} must be an exugear.Shaft, got {type(shaft).__name__}")
        angles = planet_angles(3 if self.planets is None else self.planets, self.angles)
        both = f"planets is {self.planets}, but angles hold {angles.size}; leave one of them out"
        require(self.planets in (None, angles.size), both)
        set_fields(self, angles=tuple(angles.tolist()), planets=angles.size)
        require_finite("phase", self.phase or 0.0, "pass a share of a pitch")
        sun_meshes, ring_meshes = self._listed("sun_mesh"), self._listed("ring_mesh")
        for mesh, role in ((sun_meshes[0], "sun"), (ring_meshes[0], "ring")):
            if getattr(self, f"{role}_pair") is None:
                set_fields(self, **{f"{role}_pair": pair_of_map(mesh, role)})
        check_pairs(self.sun_pair, self.ring_pair)
        self._check_planets()
        self._check_room()
        self._check_ring(ring_meshes)
        ideal = "carrier_stiffness needs planets on pins that yield; pass pin=Bearing(radial=...)"
        require(self.carrier_stiffness is None or self.pin is not None, ideal)
        if self.ring_modes is not None:
            rigid = {id(mesh): without_ring_modes(mesh, self.ring_modes) for mesh in ring_meshes}
            ring_meshes = [rigid[id(mesh)] for mesh in ring_meshes]
        steps = step_angles(self.step_angle, self.planets)
        set_fields(self, step_angle=tuple(steps.tolist()))
        teeth = fitting_teeth(self.sun_pair, self.ring_pair, angles, steps, self.tooth)
        set_fields(self, teeth=tuple(teeth))
        shafts = self._planet_shafts()
        set_fields(self, stages=tuple(self._stages(shafts, sun_meshes, ring_meshes)))

    def __repr__(self) -> str:
        at = ", ".join(f"{degrees(angle):.6g}" for angle in self.angles)
        sun, planet, ring = (str(gear.z) for gear in self.gears)
        z = "/".join([sun, f"{planet}-{self.ring_pair.pinion.z}" if self.stepped else planet, ring])
        return f"Planetary({z} teeth, {self.planets} planets at {at} deg)"

    def __str__(self) -> str:
        return "\n".join([repr(self), *self.words])

    @property
    def gears(self) -> tuple[Any, Any, Any]:
        """Sun, planet and ring; of stepped planets the gear at the sun."""
        return self.sun_pair.pinion, self.sun_pair.wheel, self.ring_pair.wheel

    @property
    def stepped(self) -> bool:
        """Whether the planets mesh with the ring by another gear than with the sun."""
        return without_flanks(self.sun_pair.wheel) != without_flanks(self.ring_pair.pinion)

    @property
    def words(self) -> list[str]:
        """Meshing sequence, effect of the harmonics and hunting teeth, a line each."""
        (sun, planet, ring), phases = (gear.z for gear in self.gears), self.mesh_phases()
        lines, even = [], np.ptp(np.diff([*sorted(self.angles), min(self.angles) + 2 * pi])) < EVEN
        members = [("sun", sun, "sun_phase"), ("ring", -ring, "ring_phase")]
        for name, z, phase in members if self.stepped else members[:1]:
            where = f"at the {name}: " if self.stepped else ""
            lines.append(where + meshing_sequence(phases[phase].values))
            if even:
                lines.append(f"{where}excited by mesh harmonics: {effect_of_harmonics(z, self.planets)}")
        if self.stepped:
            lines.append(f"teeth at the sun when it is assembled: {', '.join(map(str, self.teeth))}")
        of_ring = self.ring_pair.pinion.z
        return [*lines, hunting(sun, planet, ("sun", "planet")), hunting(of_ring, ring, ("planet", "ring"))]

    @checked
    def mesh_phases(self, harmonics: int = 4, direction: int = 1) -> xr.Dataset:
        """Table of the mesh phases over `planet`, and of what mesh harmonics add up to over `harmonic`.

        harmonics   number of mesh harmonics
        direction   sense of the external torque on the sun about z, +1 or -1

        Returns a Dataset: angle [rad], sun_phase and ring_phase as shares of a pitch over `planet`; torque_sum and
        lateral_sum over `harmonic`: sums over the planets as shares of that of planets in phase, of equal meshes whose
        errors superpose linearly, in the torque and in the lateral force on the sun (the larger one of those that turn
        with and against the carrier); of stepped planets also ring_torque_sum and ring_lateral_sum, on the ring.
        """
        require(harmonics >= 1, f"harmonics must be at least 1, got {harmonics}")
        steps = {"step_angle": self.step_angle, "tooth": self.teeth}
        phases = planetary_phases(
            self.sun_pair, self.ring_pair, angles=self.angles, direction=direction, phase=self.phase or 0.0, **steps
        )
        torque, lateral = phase_sums(phases.sun, phases.angles, harmonics)
        share, of_sum = {"units": "1", "long_name": "share of a pitch"}, {"units": "1"}
        table = xr.Dataset(
            {
                "angle": ("planet", phases.angles, {"units": "rad", "long_name": "angle of the planet about the sun"}),
                "sun_phase": ("planet", phases.sun, share),
                "ring_phase": ("planet", phases.ring, share),
                "torque_sum": ("harmonic", torque, of_sum | {"long_name": "sum in the torque over that in phase"}),
                "lateral_sum": ("harmonic", lateral, of_sum | {"long_name": "sum in the lateral force on the sun"}),
            },
            {"planet": [shaft.name for shaft in self.planet_shafts], "harmonic": np.arange(1, harmonics + 1)},
        )
        if not self.stepped:
            return table
        torque, lateral = phase_sums(phases.ring, phases.angles, harmonics)
        table["ring_torque_sum"] = "harmonic", torque, of_sum | {"long_name": "sum in the torque on the ring"}
        table["ring_lateral_sum"] = "harmonic", lateral, of_sum | {"long_name": "sum in the lateral force on the ring"}
        return table

    @property
    def planet_shafts(self) -> tuple[Shaft, ...]:
        """The planets as shafts, in their order."""
        return tuple(stage.slow for stage in self.stages[::2])

    @checked
    def ratios(self, driving: str, held: str) -> dict[str, Fraction]:
        """Exact speed of every member over that of the driving one while another one is held; names of shafts.

        The six modes of operation are the choices of both among sun, ring and carrier. Raises ValueError for others.
        """
        meshes = [
            MeshOfMembers(x.fast.name, x.slow.name, x.pair.pinion.z, x.pair.wheel.z, self.carrier.name)
            for x in self.stages
        ]
        members = [self.sun.name, self.ring.name, self.carrier.name]
        for name, value in {"driving": driving, "held": held}.items():
            require(value in members, f"{name} must be one of {members}, got {value!r}")
        return speeds_of_members(meshes, driving, [held])

    def _listed(self, name: str) -> list[Any]:
        """The value of an argument for each planet: given alike for all, or as a list."""
        return listed(name, getattr(self, name), self.planets)

    def _check_planets(self) -> None:
        """ValueError for planets of two unlike gears that are no shafts."""
        shafts = self.planet if isinstance(self.planet, list | tuple) else [self.planet]
        gears = f"{self.sun_pair.wheel} and {self.ring_pair.pinion}"
        unlike = f"sun_pair and ring_pair must share the planet, they have {gears}"
        remedy = "stepped planets are shafts: planet=Shaft('planet', {axial: gear at the sun, axial: gear at the ring})"
        require(not self.stepped or all(isinstance(x, Shaft) for x in shafts), f"{unlike}; {remedy}")
        steps = "step_angle and tooth belong to stepped planets, here the same gear meshes with sun and ring"
        given = self.tooth is not None or bool(np.any(self.step_angle))
        require(self.stepped or not given, f"{steps}; leave them out")
        self._check_numbers()

    def _check_numbers(self) -> None:
        """ValueError where a planet has the same tooth by its number in both meshes, which see it from either side."""
        at_sun, at_ring = (getattr(x, "drive_flank", ()) for x in (self.sun_pair.wheel, self.ring_pair.pinion))
        if self.stepped or at_sun != at_ring or not names_teeth(at_sun):
            return
        z = self.sun_pair.wheel.z
        reverse = [part.taken_from(0, -1, z) if hasattr(part, "taken_from") else part for part in at_sun]
        sides = "teeth of the planet count from the other side in ring_mesh: tooth k of sun_mesh is tooth -k there"
        remedy = "map ring_mesh of a planet whose deviations are counted so, OnTooth(-k % z, ...)"
        require(all(part in at_sun for part in reverse), f"{sides}, but both meshes have the same flanks; {remedy}")

    def _check_room(self) -> None:
        """ValueError where tip circles of planets overlap."""
        order = np.argsort(np.mod(self.angles, 2 * pi))
        at = np.mod(self.angles, 2 * pi)[order]
        gaps = np.diff(np.r_[at, at[0] + 2 * pi]) if self.planets > 1 else np.array([pi])
        narrow = int(np.argmin(gaps))
        beside = 2 * self.sun_pair.a * abs(sin(gaps[narrow] / 2)) if gaps[narrow] < pi else np.inf
        first, second = order[narrow] + 1, order[(narrow + 1) % self.planets] + 1
        d_a = max(self.sun_pair.wheel.d_a, self.ring_pair.pinion.d_a)
        close = f"planets {first} and {second} overlap: their centres are {beside / mm:.6g} mm apart"
        remedy = "take fewer planets, move them apart by angles=, or give them smaller tip circles"
        require(beside > d_a, f"{close}, their tip circles have {d_a / mm:.6g} mm; {remedy}")

    def _check_ring(self, meshes: Sequence[Any]) -> None:
        """ValueError unless the ring can have modes beside the maps of its meshes."""
        ratio = f"ring_damping_ratio must lie in [0, 1], got {self.ring_damping_ratio}"
        require(0 <= self.ring_damping_ratio <= 1, ratio)
        if self.ring_modes is None:
            return
        laws = "ring_modes take their flexibility out of the map of ring_mesh, got a MeshForce; pass the STE map"
        require(not any(isinstance(mesh, MeshForce) for mesh in meshes), laws)
        supports = f"ring {self.ring.name!r} must have no bearings beside ring_modes, whose supports hold its rim"
        free = not self.ring.bearings and not self.ring.torque_supports and self.ring.offset == NO_DISPLACEMENT
        require(free, f"{supports}; leave bearings, TorqueSupport and offset= out")
        tight = "ring_modes move both flanks of the ring, but its pair has no backlash"
        require(self.ring_pair.backlash > 0, f"{tight}; give thinner teeth, Gear(s_n=...), or another GearPair(a=...)")
        unlike = f"ring_modes are of {pair_of(self.ring_modes).wheel}, the ring is {self.ring_pair.wheel}"
        require(pair_of(self.ring_modes).wheel == self.ring_pair.wheel, f"{unlike}; pass fem.ring_modes(ring_pair)")

    @property
    def elastic_ring(self) -> ElasticRing | None:
        """The ring by its modes; None where it is as stiff as its map."""
        if self.ring_modes is None:
            return None
        return ElasticRing(self.ring.name, self.ring_modes, self.ring_damping_ratio)

    def _planet_shafts(self) -> list[Shaft]:
        """Shafts of the planets at the sun's axial position, on their pins and displaced by the errors of these."""
        planets = [self.sun_pair.wheel] * self.planets if self.planet is None else self._listed("planet")
        pins = [None] * self.planets if self.pin is None else self._listed("pin")
        keep_names = isinstance(self.planet, list | tuple)
        shafts = shafts_of_planets(f"{self.name} planet".strip(), planets, pins, self._axial, keep_names=keep_names)
        return [_displaced(*each) for each in zip(shafts, self.angles, self._pin_errors(), strict=True)]

    @property
    def _axial(self) -> float:
        """Axial position of the sun's gear [m]."""
        positions = [at for at, gear in self.sun.gears.items() if gear == self.sun_pair.pinion]
        if self.axial_position is None:
            several = f"sun {self.sun.name!r} carries its gear at {[x / mm for x in positions]} mm"
            require(len(positions) <= 1, f"{several}; say which one meshes here, axial_position=...")
            return positions[0] if positions else 0.0
        wanted = self.axial_position
        nearest = min(positions, key=lambda at: abs(at - wanted), default=wanted)
        beside = f"axial_position must be one of {[x / mm for x in positions]} mm, where the sun {self.sun.name!r} has"
        near = bool(positions) and abs(nearest - wanted) < NEAR
        require(near, f"{beside} its gear, got {wanted / mm:g} mm")
        return nearest

    def _thinner(self, mesh: Any, pair: Any, role: str) -> float:
        """By how much the teeth of a planet, in a role of its pair, are thinner than in its map or force law [m].

        Along the line of action. A force law of a list has the backlash of its planet, another one that of `sun_pair`
        or `ring_pair`.
        """
        given, nominal = (self.sun_mesh, self.sun_pair) if role == "wheel" else (self.ring_mesh, self.ring_pair)
        if isinstance(mesh, MeshForce) and isinstance(given, list | tuple):
            return 0.0
        nominal = nominal if isinstance(mesh, MeshForce) else pair_of(mesh)
        gear, mapped = getattr(pair, role), getattr(nominal, role)
        return float((mapped.thickness(mapped.r) - gear.thickness(gear.r)) * mapped.r_b / mapped.r)

    def _axial_at_ring(self, planet: Shaft) -> float:
        """Axial position of the gear of a planet that meshes with the ring [m]: beside that at the sun if stepped."""
        beside = [at for at, gear in planet.gears.items() if at != self._axial and gear.z == self.ring_pair.pinion.z]
        return beside[0] if self.stepped and len(beside) == 1 else self._axial

    def _pin_errors(self) -> np.ndarray:
        """(n_planet, 4) tangential and radial displacements of the pins [m] and slopes of their axes [rad]."""
        n, by_carrier = self.planets, np.column_stack([self._errors_by_carrier(), np.zeros((self.planets, 2))])
        if self.pin_errors is None:
            return by_carrier
        errors = numbers("pin_errors", self.pin_errors)
        shapes = f"pin_errors must be ({n},), ({n}, 2) or ({n}, 4): tangential, radial, and slopes, got {errors.shape}"
        require(errors.shape in ((n,), (n, 2), (n, 4)), f"{shapes}; give a value for each planet")
        errors = errors.reshape(n, -1)
        largest, steepest = (np.abs(part).max(initial=0.0) for part in np.split(errors, [2], axis=1))
        far = f"pin_errors must lie within {LARGEST_PIN_ERROR:g} m, got {largest:g}; pass metres: 20*um"
        require(bool(largest < LARGEST_PIN_ERROR), far)
        steep = f"slopes of pin_errors must lie within {LARGEST_LEAN:g} rad, got {steepest:g}; pass radians: 0.5e-3"
        require(bool(steepest < LARGEST_LEAN), steep)
        return by_carrier + np.column_stack([errors, np.zeros((n, 4 - errors.shape[1]))])

    def _errors_by_carrier(self) -> np.ndarray:
        """(n_planet, 2) tangential and radial displacements of the pins by an eccentric carrier [m]."""
        if self.eccentricity is None:
            return np.zeros((self.planets, 2))
        given = numbers("eccentricity", self.eccentricity)
        pair = f"eccentricity must be a distance [m] and an angle [rad], got {text_of(self.eccentricity)}"
        require(given.shape == (2,) and bool(np.isfinite(given).all()), pair)
        far = f"eccentricity must lie within {LARGEST_PIN_ERROR:g} m, got {given[0]:g}; pass metres: 20*um"
        require(abs(given[0]) < LARGEST_PIN_ERROR, far)
        ahead = given[1] - np.array(self.angles)
        return given[0] * np.column_stack([np.sin(ahead), np.cos(ahead)])

    def _stages(self, planets: list[Shaft], sun_meshes: list[Any], ring_meshes: list[Any]) -> list[Stage]:
        """Stages of each planet with sun and ring."""
        pairs: dict[str, list[Any]] = {
            "sun": [_with_gear_of(planet, self.sun_pair, "wheel", self._axial) for planet in planets],
            "ring": [
                _with_gear_of(planet, self.ring_pair, "pinion", self._axial_at_ring(planet)) for planet in planets
            ],
        }
        thinner = {
            "sun": [self._thinner(*each, "wheel") for each in zip(sun_meshes, pairs["sun"], strict=True)],
            "ring": [self._thinner(*each, "pinion") for each in zip(ring_meshes, pairs["ring"], strict=True)],
        }
        meshes = {"sun": sun_meshes, "ring": ring_meshes}
        maps = MapsOfPlanets(meshes, pairs, self.damping, self.damping_ratio, thinner)
        ends = [
            {"sun": (self.sun, planet, angle), "ring": (planet, self.ring, angle)}
            for planet, angle in zip(planets, self.angles, strict=True)
        ]
        first = {"phase": self.phase}
        of_sun = {"axial_position": self.axial_position}
        return stages_of_planets(maps, ends, self.carrier, first=first, of_sun=of_sun)


def without_flanks(gear) -> Any:
    """A gear without modifications and deviations."""
    return replace(gear, flank=()) if isinstance(gear, Gear) else gear


class MapsOfPlanets(NamedTuple):
    """Maps or force laws of the meshes of planets and their pairs by role, lists of one for each, and their damping.

    thinner   by role, by how much the teeth of each planet are thinner than in its mesh [m], along the line of action
    """

    meshes: dict[str, list[Any]]
    pairs: dict[str, list[Any]]
    damping: float | None
    damping_ratio: float | None
    thinner: Mapping[str, list[float]] = {}


def stages_of_planets(
    maps: MapsOfPlanets,
    ends: Sequence[Mapping[str, tuple[Shaft, Shaft, float]]],
    carrier: Shaft,
    *,
    first: Mapping[str, Any] | None = None,
    of_sun: Mapping[str, Any] | None = None,
) -> list[Stage]:
    """Stages on a carrier, planet by planet; meshes with the same map share its force law, but for its backlash.

    ends     of each planet by role: fast shaft, slow shaft, and direction from one to the other [rad]
    first    further arguments of the first stage
    of_sun   further arguments of the stages of role "sun"
    """
    laws: dict[tuple[int, str], MeshForce] = {}
    wider: dict[tuple[int, float], MeshForce] = {}
    stages: list[Stage] = []
    for number, by_role in enumerate(ends):
        for role, (fast, slow, angle) in by_role.items():
            mesh = given = maps.meshes[role][number]
            damping: dict[str, Any] = {"damping": maps.damping, "damping_ratio": maps.damping_ratio}
            if law := laws.get((id(given), role)):
                mesh, damping = law, {}
            elif isinstance(mesh, MeshForce) and maps.damping is not None:
                mesh, damping = damped(mesh, maps.damping), {}
            at = (angle + pi) % (2 * pi) - pi
            options: dict[str, Any] = {"pair": maps.pairs[role][number], "angle": at, "carrier": carrier}
            options |= (first or {}) if not stages else {}
            options |= (of_sun or {}) if role == "sun" else {}
            stage = Stage(fast, slow, mesh, **options, **damping)
            law = laws.setdefault((id(given), role), stage.force)
            if maps.thinner and (thinner := maps.thinner[role][number]) and isfinite(law.backlash):
                mesh = wider.setdefault((id(law), thinner), widened(law, thinner))
                stage = Stage(fast, slow, mesh, **options)
            stages.append(stage)
    return stages


def pair_of_map(mesh, role: str):
    """The pair of a map; ValueError for a `MeshForce`, which has none."""
    require(not isinstance(mesh, MeshForce), f"{role}_mesh is a MeshForce, which knows no gears; pass {role}_pair too")
    return pair_of(mesh)


def listed(name: str, value: Any, planets: int) -> list[Any]:
    """The value of an argument for each planet: given alike for all, or as a list."""
    if not isinstance(value, list | tuple):
        return [value] * planets
    lengths = f"{name} must have an entry for each of {planets} planets, got {len(value)}"
    require(len(value) == planets, f"{lengths}; pass a single one for all")
    return list(value)


def shafts_of_planets(name: str, planets: list[Any], pins: list[Any], axial: float, *, keep_names: bool) -> list[Shaft]:
    """Shafts of planets on their pins, named by numbers behind a name.

    planets      gears, which stand at an axial position [m], or shafts
    keep_names   whether shafts keep their own names
    """
    shafts = []
    for number, (planet, pin) in enumerate(zip(planets, pins, strict=True), start=1):
        numbered = f"{name} {number}"
        shaft = planet if isinstance(planet, Shaft) else Shaft(numbered, {axial: planet})
        bearings = f"planet {shaft.name!r} must have no bearings, got {len(shaft.bearings)}; pass them as pin="
        require(not shaft.bearings, bearings)
        pin = pin.on_pin() if isinstance(pin, RollingBearing) else pin
        parts: dict[float, list] = {at: [] for at in shaft.parts}
        for at, part in [*parts_of(shaft), *([(axial, pin)] if pin and axial in parts else [])]:
            parts[at].append(part)
        keeps_name = keep_names and isinstance(planet, Shaft)
        shafts.append(replace(shaft, name=shaft.name if keeps_name else numbered, parts=parts))
    return shafts


def _with_gear_of(planet: Shaft, pair: Any, role: str, axial: float) -> Any:
    """A pair with the gear of a planet at an axial position [m], whose teeth may be thinner, in a role."""
    mapped = getattr(pair, role)
    gear = planet.gears.get(axial, mapped)
    return pair if gear == mapped or gear.z != mapped.z else replace(pair, **{role: gear})


def _displaced(shaft: Shaft, angle: float, error: np.ndarray) -> Shaft:
    """A planet's shaft displaced by the error (4) of its pin at an angle: tangential, radial [m], and slopes [rad]."""
    if not error.any():
        return shaft
    twice = f"planet {shaft.name!r} has an offset of its own beside pin_errors; give the displacement by one of them"
    require(shaft.offset == NO_DISPLACEMENT, twice)
    turn = np.array([[-sin(angle), cos(angle)], [cos(angle), sin(angle)]])
    (x, y), (lean_x, lean_y) = (error[:2] @ turn).tolist(), (error[2:] @ turn).tolist()
    tilts = {"tilt_x": -lean_y, "tilt_y": lean_x, "pivot": min(shaft.gears)} if error[2:].any() else {}
    return replace(shaft, offset=Placement(x=x, y=y, **tilts))
