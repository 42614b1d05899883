"""Phases of the meshes of a planetary set, its assembly, and what follows from them for vibrations.

The reference configuration is that in which all driving flanks touch. The sun drives the planets in the sense d of the
external torque on it, the planets drive the ring in the sense -d. A planet at an angle psi from the first one finds the
sun's teeth z_s psi / 2 pi pitches further, the ring's |z_r| psi / 2 pi: phases p_s = p_1 - d z_s psi / 2 pi and
p_r = p_s + h_s + h_r + z_p / 2, with the half tooth thicknesses h of the planet on its working circles in pitches.
Both agree at all planets where (z_s + |z_r|) psi / 2 pi is whole: the set can be assembled.

Sources: R. G. Parker, A physical explanation for the effectiveness of planet phasing to suppress planetary gear
vibration, J. Sound Vib. 236 (2000); R. G. Parker and J. Lin, Mesh phasing relationships in planetary and epicyclic
gears, J. Mech. Des. 126 (2004).
"""

from collections.abc import Sequence
from math import cos, degrees, gcd, pi
from typing import Annotated, Any, NamedTuple

import numpy as np

from exugear.gearbox.tooth_numbers import mounted, phase_of_law
from exugear.mesh_force.ring_pair import RingPair
from fem.pair.pair import GearPair
from fem.support.arguments import Numbers, checked
from fem.support.validation import numbers, require, require_finite
from fem.units import mm

#: Share of a pitch within which teeth fit, as `mesh_phasing.FITS`.
FITS = 1e-6
#: Decimals of a phase [pitches] that count.
DIGITS = 6
#: Relative difference of centre distances that is rounding.
ROUNDING = 1e-6


class PlanetaryPhases(NamedTuple):
    """Phases of the meshes of every planet with sun and ring [pitches]; angles of the planets [rad]."""

    sun: np.ndarray
    ring: np.ndarray
    angles: np.ndarray


def check_pitches(name: str, value: Any) -> None:
    """ValueError unless a value is a whole number of pitches, or two."""
    values = numbers(name, value)
    whole = values.shape in ((), (2,)) and bool((values == np.floor(values)).all() and (values >= 1).all())
    require(
        whole, f"{name} must be a whole number of at least 1, or two, of the sun's and the ring's laws, got {value}"
    )


@checked
def planetary_phases(
    sun_pair: GearPair,
    ring_pair: GearPair | RingPair,
    *,
    planets: int = 3,
    angles: Numbers | None = None,
    direction: int = 1,
    phase: float = 0.0,
    pitches: Annotated[Any, check_pitches] = 1,
) -> PlanetaryPhases:
    """Phases of all meshes of a planetary set, for `mbs.CreateGearContact(..., phase=, direction=)`.

    sun_pair    sun and planet
    ring_pair   planet and ring
    planets     number of planets, evenly spaced from angle 0 on
    angles      instead, (n_planet,) of the planets about the sun, from x [rad]
    direction   sense of the external torque on the sun about z, +1 or -1: pass it to the contacts of the sun, and its
                opposite to those of the ring (pinion: the planet)
    phase       of the first planet's mesh with the sun
    pitches     numbers of pitches over which the force laws run (`exugear.MeshForce.pitches`), of the sun's meshes and
                of the ring's: (1, 99) where the 99 teeth of the ring differ. Phases lie in [0, pitches), and tell the
                teeth apart: tooth 0 of sun and ring stand at the first planet, tooth 0 of the planets at the sun, or
                the next one behind it at its pitch point

    Raises ValueError for a set that cannot be assembled, with the nearest angles that fit, and for pairs of different
    planets or centre distances.
    """
    check_pairs(sun_pair, ring_pair)
    at = planet_angles(planets, angles)
    require_finite("phase", phase, "pass a share of a pitch")
    require(direction in (1, -1), f"direction must be +1 or -1, got {direction}")
    check_assembly(sun_pair.pinion.z, ring_pair.wheel.z, at)
    of_sun, of_ring = np.broadcast_to(pitches, 2).tolist()
    by_sun = phase - direction * sun_pair.pinion.z * (at - at[0]) / (2 * pi)
    by_planet = np.array([phase, *(mounted(x, sun_pair) for x in by_sun[1:])])
    at_ring = by_planet + advance_of_ring(sun_pair, ring_pair)
    by_ring = mounted(at_ring[0], ring_pair) + direction * abs(ring_pair.wheel.z) * (at - at[0]) / (2 * pi)
    sun = [phase_of_law(sun_pair, of_sun, *both) for both in zip(by_sun, by_planet, strict=True)]
    ring = [phase_of_law(ring_pair, of_ring, *both) for both in zip(at_ring, by_ring, strict=True)]
    return PlanetaryPhases(np.array(sun), np.array(ring), at)


def check_pairs(sun_pair: GearPair, ring_pair: GearPair | RingPair) -> None:
    """ValueError unless a planet meshes with sun and ring on the same circle about them."""
    ring_z = ring_pair.wheel.z
    require(
        ring_z < 0, f"ring_pair must hold a ring with z < 0, got {ring_z} teeth; pass RingPair(planet, z=-99, a=-...)"
    )
    sizes = [np.array([gear.z, gear.m_n, abs(gear.beta)]) for gear in (sun_pair.wheel, ring_pair.pinion)]
    unlike = "sun_pair and ring_pair must share the planet; z, m_n, beta are"
    stepped = "stepped planets are not built yet: write their stages by hand, Stage(..., carrier=...)"
    alike = bool(np.allclose(sizes[0], sizes[1], rtol=1e-9, atol=0))
    require(alike, f"{unlike} {sizes[0].tolist()} and {sizes[1].tolist()}; {stepped}")
    a = sun_pair.a, -ring_pair.a
    distances = f"a of sun_pair and -a of ring_pair must agree, got {a[0] / mm:.6g} and {a[1] / mm:.6g} mm"
    require(abs(a[0] - a[1]) <= ROUNDING * a[0], f"{distances}; change the profile shifts or the centre distances")


def planet_angles(planets: int, angles: Any) -> np.ndarray:
    """(n_planet,) angles [rad] of planets that are evenly spaced from 0 on, unless they are given."""
    if angles is None:
        require(planets >= 1, f"planets must be at least 1, got {planets}")
        return 2 * pi * np.arange(planets) / planets
    at = np.atleast_1d(numbers("angles", angles))
    require(at.ndim == 1 and at.size >= 1, f"angles must hold the angle of each planet, got shape {at.shape}")
    require_finite("angles", at)
    turned = np.abs(at).max() <= 4 * pi
    require(bool(turned), f"angles must lie within two turns, got {at.tolist()}; pass radians: 120*deg")
    return at


def half_thickness(gear, alpha_wt: float) -> float:
    """Half tooth thickness of a gear on its working circle, in pitches; alpha_wt: working pressure angle [rad]."""
    r_w = gear.r_b / cos(alpha_wt)
    return gear.thickness(r_w) * gear.z / (4 * pi * r_w)


def advance_of_ring(sun_pair: GearPair, ring_pair: GearPair | RingPair) -> float:
    """Phase of a planet's mesh with the ring less that of its mesh with the sun, in pitches."""
    thicknesses = (half_thickness(pair_gear, pair.alpha_wt) for pair_gear, pair in _planet_of(sun_pair, ring_pair))
    return sum(thicknesses) + ring_pair.pinion.z / 2


def _planet_of(sun_pair, ring_pair):
    return (sun_pair.wheel, sun_pair), (ring_pair.pinion, ring_pair)


def check_assembly(z_sun: int, z_ring: int, angles: np.ndarray) -> None:
    """ValueError unless planets at these angles [rad] fit between the teeth of sun and ring, with angles that fit."""
    fitting = fitting_angles(z_sun, z_ring, angles)
    miss = np.abs(angles - fitting).max() * (z_sun + abs(z_ring)) / (2 * pi)
    if miss > FITS:
        got, near = (", ".join(f"{degrees(x):.6g}" for x in values) for values in (angles, fitting))
        rule = f"(z_sun + |z_ring|) psi / 360 deg must be whole, z = {z_sun} and {z_ring}"
        write = f"the nearest angles that fit are {near} deg: angles=({', '.join(f'{x:.11g}' for x in fitting)})"
        raise ValueError(
            f"planets at {got} deg cannot be assembled, the teeth miss by {miss:.3g} pitch: {rule}; {write}"
        )


def fitting_angles(z_sun: int, z_ring: int, angles: np.ndarray) -> np.ndarray:
    """(n_planet,) angles [rad] nearest to the given ones at which planets can be assembled, the first one kept."""
    least = 2 * pi / (z_sun + abs(z_ring))
    return angles[0] + least * np.round((angles - angles[0]) / least)


def phase_sums(sun_phases: np.ndarray, angles: np.ndarray, harmonics: int) -> tuple[np.ndarray, np.ndarray]:
    """(harmonics,) sums of a mesh harmonic over the planets, in the torque and in the lateral force on the sun.

    Shares of the sum of N planets in phase, of equal meshes whose errors superpose linearly. The lateral sum is the
    larger one of those that turn with and against the carrier.
    """
    waves = np.exp(2j * pi * np.outer(np.arange(1, harmonics + 1), sun_phases))
    around = np.exp(1j * np.asarray(angles))
    torque = np.abs(waves.mean(axis=1))
    lateral = np.maximum(np.abs((waves * around).mean(axis=1)), np.abs((waves * around.conj()).mean(axis=1)))
    return torque, lateral


def meshing_sequence(sun_phases: np.ndarray) -> str:
    """How planets follow each other in the mesh with the sun, in words."""
    waits = np.round((np.asarray(sun_phases)[0] - sun_phases) % 1.0, DIGITS) % 1.0
    times = np.unique(waits)
    together = [" with ".join(str(i + 1) for i in np.flatnonzero(waits == time)) for time in times]
    if times.size == 1:
        return "all planets mesh in phase"
    gaps = np.diff(np.r_[times, 1.0])
    if np.ptp(gaps) < 2 * 10.0**-DIGITS:
        return f"planets mesh in sequence {', '.join(together)}, 1/{times.size} of a pitch apart"
    return f"planets mesh in the order {', '.join(together)}, at {', '.join(f'{x:.3g}' for x in times)} of a pitch"


def effect_of_harmonics(z_sun: int, planets: int) -> str:
    """What mesh harmonics do to a set of evenly spaced planets, in words: k = l z_sun mod planets (Parker 2000)."""
    kinds: dict[str, list[int]] = {"torque": [], "lateral force": [], "planets alone": []}
    for harmonic in range(1, planets + 1):
        k = harmonic * z_sun % planets
        lateral = k in (1, planets - 1)
        kinds["torque" if k == 0 else "lateral force" if lateral else "planets alone"].append(harmonic)
    texts = [f"{name} by harmonics {', '.join(map(str, listed))}" for name, listed in kinds.items() if listed]
    return f"{'; '.join(texts)}, and so on with period {planets}"


def hunting(z_1: int, z_2: int, names: Sequence[str]) -> str:
    """Which teeth of two gears meet, and after how many turns of the first gear in the carrier's frame, in words."""
    (first, second), common = names, gcd(z_1, z_2)
    turns = abs(z_2) // common
    if common == 1:
        return f"{first}-{second}: hunting, each tooth meets all {abs(z_2)} teeth within {turns} turns of the {first}"
    met = f"a tooth of the {first} meets every {common}. tooth of the {second}"
    return f"{first}-{second}: {met} ({turns} of {abs(z_2)}), the same again after {turns} turns of the {first}"
