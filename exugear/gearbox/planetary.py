"""A planetary set as data: sun, ring and carrier with the planets between them, from which its stages follow."""

from dataclasses import dataclass, field, replace
from fractions import Fraction
from math import cos, degrees, pi, sin
from typing import Annotated, Any

import numpy as np
import xarray as xr

from exugear.gearbox.bearing import Bearing
from exugear.gearbox.planetary_kinematics import MeshOfMembers, speeds_of_members
from exugear.gearbox.planetary_phases import (
    check_assembly,
    check_pairs,
    effect_of_harmonics,
    hunting,
    meshing_sequence,
    phase_sums,
    planet_angles,
    planetary_phases,
)
from exugear.gearbox.shaft import NO_DISPLACEMENT, Placement, Shaft
from exugear.gearbox.stage import Stage
from exugear.mesh_force.force import MeshForce
from exugear.mesh_force.ring_pair import RingPair
from fem.gear.gear import Gear
from fem.pair.pair import GearPair
from fem.ste.ste_map import pair_of
from fem.support.arguments import DERIVED, checked
from fem.support.validation import numbers, require, require_finite, text_of
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
    kinds = f"{name} must be an exugear.Bearing, or a list of one for each planet, got {text_of(value)}"
    require(bool(listed) and all(isinstance(x, Bearing) for x in listed), kinds)


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
                  a list of one for each planet. By default the gear of the maps
    planets       number of planets, evenly spaced from angle 0 on; by default 3
    angles        instead, of the planets about the sun from x [rad], in the reference configuration
    sun_mesh      STE map of sun and planet, or a `MeshForce` beside sun_pair; or a list of one for each planet
    ring_mesh     of planet and ring, or a `MeshForce` beside ring_pair; or a list likewise
    sun_pair      `fem.GearPair(sun, planet, a=...)`, by default that of the map
    ring_pair     `RingPair(planet, z=-99, a=-...)`, by default that of the map
    pin           `Bearing` of every planet on the carrier, or a list of one for each; by default ideal ones
    pin_errors    (n_planet,) tangential displacements of the pins on the carrier from the nominal position, > 0
                  counter-clockwise [m]; or (n_planet, 2): tangential and radial, > 0 outwards; or (n_planet, 4): also
                  the slopes by which the pins lean towards these directions with z, about the planets' mid-planes
                  [rad]. A pin that is displaced against the force of the planet on it gives its planet more load
    damping, damping_ratio
                  of every mesh, as of an `exugear.Stage`; the ratio is that of planet and sun or ring on a carrier that
                  stands
    phase         of the first planet's mesh with the sun in the reference configuration, as share of a pitch
    name          in front of the names "planet 1", "planet 2", ..., to tell the planets of several sets apart

    Derived from them:

    stages        `exugear.Stage` of each planet with the sun and with the ring
    gears         of sun, planet and ring
    phases        `exugear.planetary_phases` while the external torque on the sun is counter-clockwise

    Raises ValueError for pairs of unlike planets, modules or centre distances, for planets that overlap or do not fit
    between the teeth (with the nearest angles that fit), and for lists that are not as long as there are planets.
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
    damping: float | None = field(default=None, kw_only=True)
    damping_ratio: float | None = field(default=None, kw_only=True)
    phase: float = field(default=0.0, kw_only=True)
    name: str = field(default="", kw_only=True)
    stages: tuple[Stage, ...] = field(init=False, repr=False)

    def __post_init__(self):
        for role in ("sun", "ring", "carrier"):
            shaft = getattr(self, role)
            require(isinstance(shaft, Shaft), f"{role} must be an exugear.Shaft, got {type(shaft).__name__}")
        angles = planet_angles(3 if self.planets is None else self.planets, self.angles)
        both = f"planets is {self.planets}, but angles hold {angles.size}; leave one of them out"
        require(self.planets in (None, angles.size), both)
        object.__setattr__(self, "angles", tuple(angles.tolist()))
        object.__setattr__(self, "planets", angles.size)
        require_finite("phase", self.phase, "pass a share of a pitch")
        sun_meshes, ring_meshes = self._listed("sun_mesh"), self._listed("ring_mesh")
        for mesh, role in ((sun_meshes[0], "sun"), (ring_meshes[0], "ring")):
            if getattr(self, f"{role}_pair") is None:
                object.__setattr__(self, f"{role}_pair", _pair_of(mesh, role))
        check_pairs(self.sun_pair, self.ring_pair)
        self._check_room()
        check_assembly(self.sun_pair.pinion.z, self.ring_pair.wheel.z, angles)
        shafts = self._planet_shafts()
        object.__setattr__(self, "stages", tuple(self._stages(shafts, sun_meshes, ring_meshes)))

    def __repr__(self) -> str:
        at = ", ".join(f"{degrees(angle):.6g}" for angle in self.angles)
        z = "/".join(str(gear.z) for gear in self.gears)
        return f"Planetary({z} teeth, {self.planets} planets at {at} deg)"

    def __str__(self) -> str:
        return "\n".join([repr(self), *self.words])

    @property
    def gears(self) -> tuple[Any, Any, Any]:
        """Sun, planet and ring."""
        return self.sun_pair.pinion, self.sun_pair.wheel, self.ring_pair.wheel

    @property
    def words(self) -> list[str]:
        """Meshing sequence, effect of the harmonics and hunting teeth, a line each."""
        sun, planet, ring = (gear.z for gear in self.gears)
        lines = [meshing_sequence(self.mesh_phases().sun_phase.values)]
        if np.ptp(np.diff([*sorted(self.angles), min(self.angles) + 2 * pi])) < EVEN:
            lines.append(f"excited by mesh harmonics: {effect_of_harmonics(sun, self.planets)}")
        return [*lines, hunting(sun, planet, ("sun", "planet")), hunting(planet, ring, ("planet", "ring"))]

    @checked
    def mesh_phases(self, harmonics: int = 4, direction: int = 1) -> xr.Dataset:
        """Table of the mesh phases over `planet`, and of what mesh harmonics add up to over `harmonic`.

        harmonics   number of mesh harmonics
        direction   sense of the external torque on the sun about z, +1 or -1

        Returns a Dataset: angle [rad], sun_phase and ring_phase as shares of a pitch over `planet`; torque_sum and
        lateral_sum over `harmonic`: sums over the planets as shares of that of planets in phase, of equal meshes whose
        errors superpose linearly, in the torque and in the lateral force on the sun (the larger one of those that turn
        with and against the carrier).
        """
        require(harmonics >= 1, f"harmonics must be at least 1, got {harmonics}")
        phases = planetary_phases(
            self.sun_pair, self.ring_pair, angles=self.angles, direction=direction, phase=self.phase
        )
        torque, lateral = phase_sums(phases.sun, phases.angles, harmonics)
        share, of_sum = {"units": "1", "long_name": "share of a pitch"}, {"units": "1"}
        return xr.Dataset(
            {
                "angle": ("planet", phases.angles, {"units": "rad", "long_name": "angle of the planet about the sun"}),
                "sun_phase": ("planet", phases.sun, share),
                "ring_phase": ("planet", phases.ring, share),
                "torque_sum": ("harmonic", torque, of_sum | {"long_name": "sum in the torque over that in phase"}),
                "lateral_sum": ("harmonic", lateral, of_sum | {"long_name": "sum in the lateral force on the sun"}),
            },
            {"planet": [shaft.name for shaft in self.planet_shafts], "harmonic": np.arange(1, harmonics + 1)},
        )

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
        value = getattr(self, name)
        if not isinstance(value, list | tuple):
            return [value] * self.planets
        lengths = f"{name} must have an entry for each of {self.planets} planets, got {len(value)}"
        require(len(value) == self.planets, f"{lengths}; pass a single one for all")
        return list(value)

    def _check_room(self) -> None:
        """ValueError where tip circles of planets overlap."""
        order = np.argsort(np.mod(self.angles, 2 * pi))
        at = np.mod(self.angles, 2 * pi)[order]
        gaps = np.diff(np.r_[at, at[0] + 2 * pi]) if self.planets > 1 else np.array([pi])
        narrow = int(np.argmin(gaps))
        beside = 2 * self.sun_pair.a * abs(sin(gaps[narrow] / 2)) if gaps[narrow] < pi else np.inf
        first, second = order[narrow] + 1, order[(narrow + 1) % self.planets] + 1
        d_a = self.sun_pair.wheel.d_a
        close = f"planets {first} and {second} overlap: their centres are {beside / mm:.6g} mm apart"
        remedy = "take fewer planets, move them apart by angles=, or give them smaller tip circles"
        require(beside > d_a, f"{close}, their tip circles have {d_a / mm:.6g} mm; {remedy}")

    def _planet_shafts(self) -> list[Shaft]:
        """Shafts of the planets at the sun's axial position, on their pins and displaced by the errors of these."""
        planets = [self.sun_pair.wheel] * self.planets if self.planet is None else self._listed("planet")
        pins = [None] * self.planets if self.pin is None else self._listed("pin")
        axial = next((at for at, gear in self.sun.gears.items() if gear == self.sun_pair.pinion), 0.0)
        shafts = []
        for number, (planet, pin) in enumerate(zip(planets, pins, strict=True), start=1):
            name = f"{self.name} planet {number}".strip()
            named = isinstance(self.planet, list | tuple) and isinstance(planet, Shaft)
            shaft = planet if isinstance(planet, Shaft) else Shaft(name, {axial: planet})
            bearings = f"planet {shaft.name!r} must have no bearings, got {len(shaft.bearings)}; pass them as pin="
            require(not shaft.bearings, bearings)
            parts = {at: [*_group(part), *([pin] if pin and at == axial else [])] for at, part in shaft.parts.items()}
            shafts.append(replace(shaft, name=shaft.name if named else name, parts=parts))
        return [_displaced(*each) for each in zip(shafts, self.angles, self._pin_errors(), strict=True)]

    def _pin_errors(self) -> np.ndarray:
        """(n_planet, 4) tangential and radial displacements of the pins [m] and slopes of their axes [rad]."""
        n = self.planets
        if self.pin_errors is None:
            return np.zeros((n, 4))
        errors = numbers("pin_errors", self.pin_errors)
        shapes = f"pin_errors must be ({n},), ({n}, 2) or ({n}, 4): tangential, radial, and slopes, got {errors.shape}"
        require(errors.shape in ((n,), (n, 2), (n, 4)), f"{shapes}; give a value for each planet")
        errors = errors.reshape(n, -1)
        largest, steepest = (np.abs(part).max(initial=0.0) for part in np.split(errors, [2], axis=1))
        far = f"pin_errors must lie within {LARGEST_PIN_ERROR:g} m, got {largest:g}; pass metres: 20*um"
        require(bool(largest < LARGEST_PIN_ERROR), far)
        steep = f"slopes of pin_errors must lie within {LARGEST_LEAN:g} rad, got {steepest:g}; pass radians: 0.5e-3"
        require(bool(steepest < LARGEST_LEAN), steep)
        return np.column_stack([errors, np.zeros((n, 4 - errors.shape[1]))])

    def _stages(self, planets: list[Shaft], sun_meshes: list[Any], ring_meshes: list[Any]):
        """Stages of each planet with sun and ring; planets with the same map share its force law."""
        laws: dict[tuple[int, str], MeshForce] = {}
        for number, (planet, angle) in enumerate(zip(planets, self.angles, strict=True)):
            for role, mesh in (("sun", sun_meshes[number]), ("ring", ring_meshes[number])):
                fast, slow = (self.sun, planet) if role == "sun" else (planet, self.ring)
                options: dict[str, Any] = {"damping": self.damping, "damping_ratio": self.damping_ratio}
                if law := laws.get((id(mesh), role)):
                    mesh, options = law, {}
                elif isinstance(mesh, MeshForce) and self.damping is not None:
                    mesh, options = replace(mesh, damping=self.damping), {}
                pair = self.sun_pair if role == "sun" else self.ring_pair
                options["phase"] = self.phase if (number, role) == (0, "sun") else None
                at = (angle + pi) % (2 * pi) - pi
                stage = Stage(fast, slow, mesh, pair=pair, angle=at, carrier=self.carrier, **options)
                laws.setdefault((id((sun_meshes if role == "sun" else ring_meshes)[number]), role), stage.force)
                yield stage


def _pair_of(mesh, role: str):
    """The pair of a map; ValueError for a `MeshForce`, which has none."""
    require(not isinstance(mesh, MeshForce), f"{role}_mesh is a MeshForce, which knows no gears; pass {role}_pair too")
    return pair_of(mesh)


def _group(part) -> tuple:
    return part if isinstance(part, tuple) else (part,)


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
