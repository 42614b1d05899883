"""Inner planets between a further sun and the planets of a set, which make it a Ravigneaux set."""

from dataclasses import dataclass, field
from math import acos, atan2, cos, degrees, gcd, pi, sin
from typing import Annotated, Any

import numpy as np
import xarray as xr

from exugear.gearbox.planetary import (
    MapsOfPlanets,
    Planetary,
    check_mesh,
    check_pin,
    check_planet,
    listed,
    pair_of_map,
    shafts_of_planets,
    stages_of_planets,
)
from exugear.gearbox.planetary_phases import FITS, fitting_angles, half_thickness
from exugear.gearbox.shaft import Shaft
from exugear.gearbox.stage import Stage
from fem.pair.pair import GearPair
from fem.support.arguments import DERIVED, checked
from fem.support.validation import require, set_fields
from fem.units import mm


@checked
@dataclass(frozen=True, eq=False)
class InnerPlanets:
    """Planets that mesh with a sun and with the planets of a `Planetary`, on its carrier; a member of an
    `exugear.Gearbox` behind that set.

    With the sun of the set they make a Ravigneaux set: two suns, short and long planets, a ring and a carrier.

    outer        `Planetary` with whose planets they mesh, one with each
    sun          `exugear.Shaft` with the sun of the inner planets
    planet       `fem.Gear`, or a `Shaft` that carries it; or a list of one for each. By default the gear of the maps
    sun_mesh     STE map of sun and inner planet, or a `MeshForce` beside sun_pair; or a list of one for each
    planet_mesh  of inner and outer planet, or a `MeshForce` beside planet_pair; or a list likewise
    sun_pair     `fem.GearPair(sun, inner planet, a=...)`, by default that of the map
    planet_pair  `fem.GearPair(inner planet, outer planet, a=...)`, by default that of the map
    side         +1: each inner planet lies counter-clockwise of its outer one, -1: clockwise
    pin          `Bearing` of every inner planet on the carrier, or a list of one for each; by default ideal ones
    damping, damping_ratio
                 of every mesh, as of an `exugear.Stage`
    name         of the planets, in front of their numbers

    Derived from them:

    stages       `exugear.Stage` of each inner planet with the sun and with its outer planet
    angles       of the inner planets about the sun [rad]

    Raises ValueError for centre distances that form no triangle, for planets that overlap or do not fit between the
    teeth (with the nearest angles that fit), and for lists that are not as long as there are planets.
    """

    outer: Planetary = field(kw_only=True)
    sun: Shaft = field(kw_only=True)
    planet: Annotated[Any, check_planet] = field(default=DERIVED, kw_only=True)
    sun_mesh: Annotated[Any, check_mesh] = field(kw_only=True)
    planet_mesh: Annotated[Any, check_mesh] = field(kw_only=True)
    sun_pair: GearPair = field(default=DERIVED, kw_only=True)
    planet_pair: GearPair = field(default=DERIVED, kw_only=True)
    side: int = field(default=1, kw_only=True)
    pin: Annotated[Any, check_pin] = field(default=None, kw_only=True)
    damping: float | None = field(default=None, kw_only=True)
    damping_ratio: float | None = field(default=None, kw_only=True)
    name: str = field(default="inner planet", kw_only=True)
    angles: tuple[float, ...] = field(init=False, repr=False)
    stages: tuple[Stage, ...] = field(init=False, repr=False)

    def __post_init__(self):
        require(isinstance(self.outer, Planetary), f"outer must be a Planetary, got {type(self.outer).__name__}")
        require(isinstance(self.sun, Shaft), f"sun must be an exugear.Shaft, got {type(self.sun).__name__}")
        require(self.side in (1, -1), f"side must be +1 or -1, got {self.side}")
        meshes = {role: self._listed(f"{role}_mesh") for role in ("sun", "planet")}
        for role, maps in meshes.items():
            if getattr(self, f"{role}_pair") is None:
                set_fields(self, **{f"{role}_pair": pair_of_map(maps[0], role)})
        beside = self._angle_beside()
        set_fields(self, angles=tuple(angle + self.side * beside for angle in self.outer.angles))
        self._check_room()
        self._check_assembly()
        planets = [self.sun_pair.wheel] * len(self.angles) if self.planet is None else self._listed("planet")
        pins = [None] * len(self.angles) if self.pin is None else self._listed("pin")
        axial = next((at for at, gear in self.sun.gears.items() if gear == self.sun_pair.pinion), 0.0)
        keep_names = isinstance(self.planet, list | tuple)
        shafts = shafts_of_planets(self.name, planets, pins, axial, keep_names=keep_names)
        set_fields(self, stages=tuple(self._stages(shafts, meshes)))

    def __repr__(self) -> str:
        at = ", ".join(f"{degrees(angle):.6g}" for angle in self.angles)
        z = f"{self.sun_pair.pinion.z}/{self.sun_pair.wheel.z}/{self.planet_pair.wheel.z}"
        return f"InnerPlanets({z} teeth, {len(self.angles)} planets at {at} deg)"

    @property
    def planet_shafts(self) -> tuple[Shaft, ...]:
        """The inner planets as shafts, in their order."""
        return tuple(stage.slow for stage in self.stages[::2])

    @checked
    def mesh_phases(self, direction: int = 1) -> xr.Dataset:
        """Table of the mesh phases over `planet`, of the first mesh of the set's sun with its phase.

        direction   sense of the external torque on the sun of the inner planets about z, +1 or -1

        Returns a Dataset: angle [rad], sun_phase and planet_phase as shares of a pitch over `planet`.
        """
        require(direction in (1, -1), f"direction must be +1 or -1, got {direction}")
        of_outer = self.outer.mesh_phases(direction=-direction)["sun_phase"].values
        sun_phases, planet_phases = [], []
        for number, (inner, outer) in enumerate(zip(self.angles, self.outer.angles, strict=True)):
            to_outer = self._direction_to_outer(inner, outer)
            # Angles of teeth about z: of the outer planet in its mesh with the set's sun, then of the inner one.
            pair, planet = self.outer.sun_pair, self.outer.sun_pair.wheel
            advance = half_thickness(planet, pair.alpha_wt) + of_outer[number]
            tooth = outer + pi + direction * advance * 2 * pi / planet.z
            pair = self.planet_pair
            phase = direction * planet.z * (tooth - to_outer - pi) / (2 * pi) - half_thickness(planet, pair.alpha_wt)
            planet_phases.append(phase % 1.0 % 1.0)
            tooth = to_outer - direction * (phase - half_thickness(pair.pinion, pair.alpha_wt)) * 2 * pi / pair.pinion.z
            pair = self.sun_pair
            phase = -direction * pair.wheel.z * (tooth - inner - pi) / (2 * pi)
            sun_phases.append((phase - half_thickness(pair.wheel, pair.alpha_wt)) % 1.0 % 1.0)
        share = {"units": "1", "long_name": "share of a pitch"}
        return xr.Dataset(
            {
                "angle": ("planet", np.array(self.angles), {"units": "rad", "long_name": "angle about the sun"}),
                "sun_phase": ("planet", sun_phases, share),
                "planet_phase": ("planet", planet_phases, share),
            },
            {"planet": [shaft.name for shaft in self.planet_shafts]},
        )

    def _listed(self, name: str) -> list[Any]:
        return listed(name, getattr(self, name), self.outer.planets)

    def _angle_beside(self) -> float:
        """Angle at the sun between an inner planet and its outer one [rad], by the three centre distances."""
        of_sun, outer, between = self.sun_pair.a, self.outer.sun_pair.a, self.planet_pair.a
        cosine = (of_sun**2 + outer**2 - between**2) / (2 * of_sun * outer)
        sides = f"{of_sun / mm:.6g}, {outer / mm:.6g} and {between / mm:.6g} mm"
        triangle = f"a of sun_pair, of the outer set and of planet_pair must form a triangle, got {sides}"
        require(abs(cosine) < 1, f"{triangle}; take an inner planet with more teeth")
        return acos(cosine)

    def _direction_to_outer(self, inner: float, outer: float) -> float:
        """Direction from an inner planet to its outer one [rad], by their angles about the sun."""
        x = self.outer.sun_pair.a * cos(outer) - self.sun_pair.a * cos(inner)
        y = self.outer.sun_pair.a * sin(outer) - self.sun_pair.a * sin(inner)
        return atan2(y, x)

    def _check_room(self) -> None:
        """ValueError where tip circles of inner planets overlap, or one overlaps an outer planet beside its own."""
        inner, outer = self.sun_pair.wheel, self.outer.sun_pair.wheel
        for i, angle in enumerate(self.angles):
            for j, further in enumerate(self.angles[:i]):
                apart = 2 * self.sun_pair.a * abs(sin((angle - further) / 2))
                self._require_apart(f"inner planets {j + 1} and {i + 1}", apart, inner.d_a)
            for j, further in enumerate(self.outer.angles):
                between = self.sun_pair.a**2 + self.outer.sun_pair.a**2
                between -= 2 * self.sun_pair.a * self.outer.sun_pair.a * cos(angle - further)
                if i != j:
                    names = f"inner planet {i + 1} and outer planet {j + 1}"
                    self._require_apart(names, between**0.5, (inner.d_a + outer.d_a) / 2)

    def _require_apart(self, names: str, distance: float, needed: float) -> None:
        close = f"{names} overlap: their centres are {distance / mm:.6g} mm apart, their tip circles need"
        remedy = "take fewer planets, or inner planets with other numbers of teeth"
        require(distance > needed, f"{close} {needed / mm:.6g} mm; {remedy}")

    def _check_assembly(self) -> None:
        """ValueError unless the inner planets fit at the angles of the outer ones, with angles that fit."""
        z_sun, z_ring = self.sun_pair.pinion.z, abs(self.outer.ring_pair.wheel.z)
        stepped = "outer planets must mesh with sun and ring by the same gear; stepped ones are not built here"
        require(not self.outer.stepped, stepped)
        angles, difference = np.array(self.outer.angles), z_ring - z_sun
        turned = (angles - angles[0]) * difference / (2 * pi)
        miss = float(np.abs(turned - np.round(turned)).max())
        fitting = fitting_angles(gcd(difference, z_ring + self.outer.sun_pair.pinion.z), angles)
        near = ", ".join(f"{degrees(angle):.6g}" for angle in fitting)
        cannot = f"inner planets cannot be assembled, the teeth miss by {miss:.3g} pitch"
        rule = f"(|z_ring| - z_sun) psi / 360 deg must be whole, z = {-z_ring} and {z_sun}"
        write = f"angles of the outer set that fit are {near} deg: angles=({', '.join(f'{x:.11g}' for x in fitting)})"
        require(miss <= FITS, f"{cannot}: {rule}; {write}, or take other numbers of teeth")

    def _stages(self, planets: list[Shaft], meshes: dict[str, list[Any]]) -> list[Stage]:
        """Stages of each inner planet with the sun and with its outer planet."""
        pairs = {"sun": [self.sun_pair] * len(planets), "planet": [self.planet_pair] * len(planets)}
        maps = MapsOfPlanets(meshes, pairs, self.damping, self.damping_ratio)
        ends = []
        for planet, outer, *at in zip(planets, self.outer.planet_shafts, self.angles, self.outer.angles, strict=True):
            ends.append({"sun": (self.sun, planet, at[0]), "planet": (planet, outer, self._direction_to_outer(*at))})
        return stages_of_planets(maps, ends, self.outer.carrier)
