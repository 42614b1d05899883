"""Phases of the meshes of a planetary set, its assembly, and what follows from them for vibrations.

The reference configuration is that in which all driving flanks touch. The sun drives the planets in the sense d of the
external torque on it, the planets drive the ring in the sense -d. A planet at an angle psi from the first one finds the
sun's teeth z_s psi / 2 pi pitches further, the ring's |z_r| psi / 2 pi: phases p_s = p_1 - d z_s psi / 2 pi and
p_r = p_s + h_s + h_r + z_p / 2, with the half tooth thicknesses h of the planet on its working circles in pitches.
Both agree at all planets where (z_s + |z_r|) psi / 2 pi is whole: the set can be assembled.

A stepped planet meshes with the sun by a gear of z_1 teeth and with the ring by one of z_2 teeth, a tooth of which
stands an angle delta ahead of one of the first gear; k counts the teeth of the first gear from there to the one that
is put into the sun. Then p_r = h_r - d z_2 (pi + delta - d (h_s + p_s) 2 pi / z_1 - k 2 pi / z_1) / 2 pi for the first
planet, and (|z_r| + z_s z_2 / z_1) psi / 2 pi - (k - k_1) z_2 / z_1 + z_2 (delta - delta_1) / 2 pi must be whole.

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
from fem.support.validation import numbers, require, require_finite, text_of
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
    step_angle: Numbers | float = 0.0,
    tooth: Numbers | None = None,
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
    step_angle  of stepped planets, whose gears at the sun and at the ring differ: angle about z by which a tooth of the
                one at the ring stands ahead of one of that at the sun [rad], or (n_planet,) of each planet
    tooth       of stepped planets, (n_planet,): which tooth of the gear at the sun meshes with the sun, counted
                counter-clockwise from the one at step_angle; by default teeth with which the planets fit
    pitches     numbers of pitches over which the force laws run (`exugear.MeshForce.pitches`), of the sun's meshes and
                of the ring's: (1, 99) where the 99 teeth of the ring differ. Phases lie in [0, pitches), and tell the
                teeth apart: tooth 0 of sun and ring stand at the first planet, tooth 0 of the planets at the sun (of
                the gears of stepped planets each at its mate), or the next one behind it at its pitch point

    Raises ValueError for a set that cannot be assembled, with the nearest angles that fit, and for pairs of different
    centre distances.
    """
    check_pairs(sun_pair, ring_pair)
    at = planet_angles(planets, angles)
    require_finite("phase", phase, "pass a share of a pitch")
    require(direction in (1, -1), f"direction must be +1 or -1, got {direction}")
    steps, z = step_angles(step_angle, at.size), ring_pair.wheel.z
    first = fitting_teeth(sun_pair, ring_pair, at, steps, tooth)[0]
    turned = direction * (at - at[0]) / (2 * pi)
    by_sun = phase - sun_pair.pinion.z * turned
    by_planet = np.array([phase, *(mounted(x, sun_pair) for x in by_sun[1:])])
    of_first = ring_phase(sun_pair, ring_pair, direction, phase, float(steps[0]), first)
    if sun_pair.wheel.z == ring_pair.pinion.z and not steps.any() and tooth is None:
        at_ring = by_planet + of_first - phase % 1.0
        by_ring = mounted(at_ring[0], ring_pair) + abs(z) * turned
    else:
        by_ring = of_first % 1.0 + abs(z) * turned
        at_ring = np.array([mounted(x, ring_pair) for x in by_ring])
    of_sun, of_ring = np.broadcast_to(pitches, 2).tolist()
    sun = [phase_of_law(sun_pair, of_sun, *both) for both in zip(by_sun, by_planet, strict=True)]
    ring = [phase_of_law(ring_pair, of_ring, *both) for both in zip(at_ring, by_ring, strict=True)]
    return PlanetaryPhases(np.array(sun), np.array(ring), at)


def check_pairs(sun_pair: GearPair, ring_pair: GearPair | RingPair) -> None:
    """ValueError unless a planet meshes with sun and ring on the same circle about them."""
    ring_z = ring_pair.wheel.z
    require(
        ring_z < 0, f"ring_pair must hold a ring with z < 0, got {ring_z} teeth; pass RingPair(planet, z=-99, a=-...)"
    )
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


def ring_phase(
    sun_pair: GearPair, ring_pair: GearPair | RingPair, direction: int, phase: float, step_angle: float, tooth: int
) -> float:
    """Phase of the first planet's mesh with the ring, from that with the sun; arguments as of `planetary_phases`."""
    planet, stepped = sun_pair.wheel, ring_pair.pinion
    by_sun = half_thickness(planet, sun_pair.alpha_wt) + phase % 1.0
    turned = pi + step_angle - (direction * by_sun + tooth) * 2 * pi / planet.z
    return half_thickness(stepped, ring_pair.alpha_wt) - direction * stepped.z * turned / (2 * pi)


def step_angles(step_angle: Any, planets: int) -> np.ndarray:
    """(n_planet,) step angles [rad], given alike for all planets or for each."""
    steps = np.atleast_1d(numbers("step_angle", step_angle))
    shapes = f"step_angle must be a number or have a value for each of {planets} planets, got shape {steps.shape}"
    require(steps.shape in ((1,), (planets,)), shapes)
    turned = f"step_angle must lie within a turn, got {steps.tolist()}; pass radians: 3*deg"
    require(bool((np.abs(steps) <= 2 * pi).all()), turned)
    return np.broadcast_to(steps, planets)


def fitting_teeth(
    sun_pair: GearPair, ring_pair: GearPair | RingPair, angles: np.ndarray, steps: np.ndarray, tooth: Any = None
) -> list[int]:
    """Teeth of the planets to put into the sun, as the argument of `planetary_phases`, at angles and step angles [rad].

    ValueError unless the planets fit between the teeth of sun and ring, with angles, step angles and teeth that fit.
    """
    z_s, z_1, z_2, z_r = sun_pair.pinion.z, sun_pair.wheel.z, ring_pair.pinion.z, abs(ring_pair.wheel.z)
    psi, delta = angles - angles[0], steps - steps[0]
    # Teeth are counted at the sun, where those of planets at other angles have moved on by whole pitches.
    moved = np.floor(-z_s * psi / (2 * pi) + FITS).astype(int)
    turned = ((z_r + z_s * z_2 / z_1) * psi + z_2 * delta) / (2 * pi)

    def misses(n: int, k: Any, first: int) -> np.ndarray:
        """Miss of planet n [pitches] with its tooth k at the sun and the given one of the first planet."""
        shares = turned[n] - (k - moved[n] - first + moved[0]) * z_2 / z_1
        return np.abs(shares - np.round(shares))

    if tooth is not None:
        teeth = numbers("tooth", tooth)
        whole = teeth.shape == angles.shape and bool((teeth % 1 == 0).all())
        require(whole, f"tooth must hold a whole number for each of {angles.size} planets, got {text_of(tooth)}")
        given = [int(k) for k in teeth]
    first = given[0] if tooth is not None else 0
    by_planet = [misses(n, np.arange(z_1), first) for n in range(angles.size)]
    fitting = [first, *(int(np.argmax(miss <= FITS)) for miss in by_planet[1:])]
    least = max(float(miss.min()) for miss in by_planet)
    if least > FITS:
        raise ValueError(_no_assembly(z_s, z_1, z_2, z_r, angles, steps, least))
    if tooth is None:
        return fitting
    miss = max(float(misses(n, k, first)) for n, k in enumerate(given))
    missing = f"planets with the teeth {given} at the sun cannot be assembled, they miss by {miss:.3g} pitch"
    require(miss <= FITS, f"{missing}; these fit: tooth={tuple(fitting)}, or leave tooth out")
    return given


def _no_assembly(z_s: int, z_1: int, z_2: int, z_r: int, angles: np.ndarray, steps: np.ndarray, miss: float) -> str:
    """Why planets cannot be assembled whichever teeth are put in, with the nearest angles and step angles that fit."""
    common, total = gcd(z_1, z_2), z_r * z_1 + z_s * z_2
    by_steps = z_1 * z_2 * (steps - steps[0]) / total
    fitting = fitting_angles(total // common if total % common == 0 else total / common, angles, by_steps)
    got, near = (", ".join(f"{degrees(x):.6g}" for x in values) for values in (angles, fitting))
    fit = f"the nearest angles that fit are {near} deg: angles=({', '.join(f'{x:.11g}' for x in fitting)})"
    cannot = f"planets at {got} deg cannot be assembled, the teeth miss by {miss:.3g} pitch"
    if z_1 == z_2 and not np.ptp(steps):
        return f"{cannot}: (z_sun + |z_ring|) psi / 360 deg must be whole, z = {z_s} and {-z_r}; {fit}"
    least, needed = 2 * pi * common / (z_1 * z_2), -total * (angles - angles[0]) / (z_1 * z_2)
    turned = steps[0] + needed + least * np.round((steps - steps[0] - needed) / least)
    rule = f"z_1 |z_ring| + z_2 z_sun = {total} times psi / 360 deg must be a multiple of {common}"
    teeth = f"z_1 = {z_1} teeth at the sun, z_2 = {z_2} at the ring, of all planets alike"
    steps_that_fit = f"or turn their gears: step_angle=({', '.join(f'{x:.9g}' for x in turned)})"
    return f"{cannot}, whichever teeth are put in: {rule} ({teeth}); {fit}; {steps_that_fit}"


def fitting_angles(divisions: float, angles: np.ndarray, shifts: np.ndarray | float = 0.0) -> np.ndarray:
    """(n_planet,) angles [rad] nearest to the given ones at multiples of a turn over divisions less shifts [rad].

    The first one is kept.
    """
    least = 2 * pi / divisions
    return angles[0] + least * np.round((angles - angles[0] + shifts) / least) - shifts


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
    cycle = abs(z_2) // common
    turns = f"{cycle} turn{'s' * (cycle > 1)} of the {first}"
    if common == 1:
        return f"{first}-{second}: hunting, each tooth meets all {abs(z_2)} teeth within {turns}"
    met = f"a tooth of the {first} meets every {common}. tooth of the {second}"
    return f"{first}-{second}: {met} ({cycle} of {abs(z_2)}), the same again after {turns}"
