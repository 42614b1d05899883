"""Vibration modes of a ring on its supports.

Stiffness and mass over the harmonics of the displacement of the rim are those of its finite elements, the stiffness the
one from which maps have their bending rim. So a mode takes the flexibility g^2 / omega^2 out of the compliance of a
mesh, with its displacement g of the flank along the line of action: map and coordinates together hold it once. What the
modes leave out, the flexibility of higher ones, stays in the map.
"""

from math import ceil, log2, pi
from typing import NamedTuple

import numpy as np
import scipy
import xarray as xr

from fem.contact.resolution import Resolution, Slices
from fem.elasticity.flank_compliance import Compliance, flank_compliance
from fem.elasticity.mesh_density import Density
from fem.elasticity.rim_bending import RADIAL, TANGENTIAL, RimBending
from fem.elasticity.rim_mass import rim_mass
from fem.gear.gear import Gear
from fem.pair.offsets import Offsets
from fem.pair.pair import GearPair
from fem.ste.map_solver import elastic_gears, width_variation
from fem.ste.map_without_ring_modes import AT, LEFT, MODE, RIGHT
from fem.ste.ring_deflection import POSITIONS, flank_at_pitch_point, largest_over_positions
from fem.ste.ste_map import pair_attributes
from fem.support.arguments import checked
from fem.support.validation import require

APART = "apart"
#: Relative difference of frequencies of a pair of equal modes.
EQUAL = 1e-6
#: Values of the shapes around the ring in the shortest wave of the rim.
IN_WAVE = 8
#: Largest number of modes for which maps list what these leave out.
LISTED = 40
#: Change of the flexibility around an even ring that is rounding, as share.
ROUNDING = 1e-6


@checked
def ring_modes(pair: GearPair, number: int = 20, *, resolution: Resolution | Slices | None = None) -> xr.Dataset:
    """Vibration modes of the ring of a pair on its supports in the plane, by finite elements, over `ring_mode`.

    pair        pinion and ring; the rim on `fem.Bolts` or a `fem.Bush`
    number      of modes, the lowest; one more where the last of them is one of a pair of equal frequency
    resolution  mesh of the finite elements, as for a map

    "frequency"     of the undamped ring without planets [Hz], rising
    "lobes"         number n of waves around the ring that has the largest share of the mode: 0 turns and breathes, 1
                    translates on the supports, from 2 on the rim bends
    "radial"        displacement of the outside of the rim at the angles `at` around the ring, > 0 outwards, per modal
                    amplitude; amplitudes q have the modal mass 1 kg, so that it is in 1/kg^0.5 [m / (m kg^0.5)]
    "tangential"    the same along the circumference, > 0 towards larger angles
    "left_flank"    displacement of the left flank along the line of action, at the pitch point, where the ring angle of
                    the mesh is `at`; > 0 away from a planet that presses it. The modal force is the mesh force times it
    "right_flank"   the same of the right flank where the ring angle of the mesh (of its left flanks) is `at`
    "turning"       inertia moment by which a mode turns the ring about its axis [kg^0.5 m], > 0 as teeth count: the
                    support bears the torque of the meshes less its sum with the modal accelerations
    "flexibility"   sum of left_flank^2 / omega^2 over the modes: what they take out of the compliance of a mesh at the
                    ring angle `at` [m/N]
    "bending"       the same of all modes: compliance of the left flank by the bending of the rim [m/N]
    "cross"         te that a unit mesh force causes in a mesh `apart` further on the ring, by all modes [m/N]: largest
                    over the positions; "cross_left_out" the same by the modes beyond those here

    Angles count as in `fem.ring_deflection`. Modes are in the plane, the same over the face width. Raises ValueError
    for a pair whose rim is clamped or that is external, and for more modes than the rim has.
    """
    held = "pair must have a ring whose rim is on fem.Bolts or a fem.Bush"
    require(bool(pair.wheel.support), f"{held}, got {pair.wheel}; give the ring a support=")
    gear, density, compliance = _ring(pair, resolution or Resolution())
    modes = _rim_modes(pair, gear, density, compliance)
    size, highest = modes.omega.size, len(modes.waves[0]) - 1
    most = f"number must be a number of modes in [1, {size}], got {number}"
    require(1 <= number <= size, most)
    number, omega, waves = modes.with_equal(number), modes.omega, modes.waves
    at = 2 * pi * np.arange(2 ** ceil(log2(IN_WAVE * highest))) / 2 ** ceil(log2(IN_WAVE * highest))
    mirrored = np.conj(modes.flank) * np.where(np.arange(2) == TANGENTIAL, -1.0, 1.0)
    tooth = 2 * pi / abs(pair.wheel.z) * (1 - pair.back_phase)
    left, right = modes.on_flank(modes.flank, at), modes.on_flank(mirrored, at + tooth)
    every = np.sum((left / omega[:, None]) ** 2, axis=0)
    radius, kept, spaced = abs(gear.r_clamp), slice(number), slice(None, None, at.size // POSITIONS)
    soft = (left / omega[:, None])[:, spaced]
    cross = [largest_over_positions(of_modes.T @ of_modes) for of_modes in (soft, soft[number:])]
    turn = np.zeros(size)
    turn[TANGENTIAL * (2 * highest + 1)] = radius
    per_amplitude = {"units": "kg^-0.5"}
    variables = {
        "frequency": (MODE, omega[kept] / (2 * pi), {"units": "Hz", "long_name": "natural frequency of the ring"}),
        "lobes": (MODE, _lobes(waves[:, :, kept]), {"units": "1", "long_name": "waves around the ring"}),
        "radial": ((MODE, AT), _around(waves[RADIAL], at)[kept], per_amplitude | {"long_name": "radial displacement"}),
        "tangential": ((MODE, AT), _around(waves[TANGENTIAL], at)[kept], per_amplitude | {"long_name": "tangential"}),
        LEFT: ((MODE, AT), left[kept], per_amplitude | {"long_name": "displacement of the left flank"}),
        RIGHT: ((MODE, AT), right[kept], per_amplitude | {"long_name": "displacement of the right flank"}),
        "turning": (MODE, (turn @ modes.mass @ modes.shapes)[kept], {"units": "kg^0.5 m", "long_name": "turning"}),
        "flexibility": (AT, np.sum((left / omega[:, None])[kept] ** 2, axis=0), {"units": "m/N"}),
        "bending": (AT, every, {"units": "m/N", "long_name": "compliance of a flank by all modes of the rim"}),
        "cross": (APART, cross[0], {"units": "m/N", "long_name": "te per force of another mesh of the ring"}),
        "cross_left_out": (APART, cross[1], {"units": "m/N", "long_name": "the same by modes that are left out"}),
    }
    coords = {
        MODE: (MODE, np.arange(1, number + 1), {"long_name": "mode of the ring"}),
        AT: (AT, at, {"units": "rad", "long_name": "angle on the ring"}),
        APART: (APART, at[spaced], {"units": "rad", "long_name": "angle from mesh to mesh on the ring"}),
    }
    return xr.Dataset(variables, coords, {"title": "modes of a ring on its supports"} | pair_attributes(pair))


class RimModes(NamedTuple):
    """All modes of a rim on its supports, of modal mass 1 kg.

    omega    (m,) angular frequencies, rising [rad/s]
    shapes   (n, m) over the components and harmonics of the rim's displacement; mass (n, n) over these [kg]
    waves    (2, N + 1, m) the same as complex waves
    flank    (N + 1, 2) displacement of the left flank at the pitch point by the waves of both components
    """

    omega: np.ndarray
    shapes: np.ndarray
    mass: np.ndarray
    waves: np.ndarray
    flank: np.ndarray

    def on_flank(self, flank: np.ndarray, angles: np.ndarray) -> np.ndarray:
        """(m, n_angle) displacement of a flank at ring angles of the mesh, per modal amplitude."""
        return _around(np.einsum("nc,cnm->nm", flank, self.waves), angles)

    def with_equal(self, number: int) -> int:
        """A number of modes, one more where the last of them is one of a pair of equal frequency."""
        more = number < self.omega.size and self.omega[number] < (1 + EQUAL) * self.omega[number - 1]
        return number + int(more)


def _rim_modes(pair: GearPair, gear: Gear, density: Density, compliance: Compliance) -> RimModes:
    """The modes of the ring of a pair; density: of the section of its finite elements."""
    rim: RimBending = compliance.rim  # type: ignore[assignment]
    size, highest = len(rim.lower), len(rim.flank) - 1
    mass = rim_mass(gear, density).reshape(size, size)
    omega, shapes = _eigenmodes(rim.lower, mass)
    waves = shapes.reshape(2, -1, size)
    waves = np.concatenate([waves[:, :1] + 0j, waves[:, 1 : highest + 1] - 1j * waves[:, highest + 1 :]], axis=1)
    return RimModes(omega, shapes, mass, waves, rim.flank @ flank_at_pitch_point(pair, compliance))


def cross_left_out(pair: GearPair, gear: Gear, density: Density, compliance: Compliance) -> np.ndarray:
    """(LISTED, POSITIONS) "cross_left_out" of `ring_modes` by its number of modes, 1 and more, and by `apart` [m/N]."""
    modes = _rim_modes(pair, gear, density, compliance)
    soft = modes.on_flank(modes.flank, 2 * pi * np.arange(POSITIONS) / POSITIONS) / modes.omega[:, None]
    numbers = [modes.with_equal(min(number, modes.omega.size)) for number in range(1, LISTED + 1)]
    return np.array([largest_over_positions(soft[number:].T @ soft[number:]) for number in numbers])


def _ring(pair: GearPair, resolution: Resolution | Slices):
    """The ring, the density of its finite elements, and its compliance as in a map without offsets."""
    offsets = Offsets().values(pair)
    gear, density, loaded = elastic_gears(pair, offsets, resolution)[1]
    compliance = flank_compliance(gear, density, loaded, whole=width_variation(pair, offsets)[1])
    return gear, density.paired(), compliance


def _eigenmodes(lower: np.ndarray, mass: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Angular frequencies (n,), rising, and shapes (n, n) of modal mass 1; lower: Cholesky factor of the stiffness."""
    half = scipy.linalg.solve_triangular(lower, mass, lower=True)
    squares, vectors = np.linalg.eigh(scipy.linalg.solve_triangular(lower, half.T, lower=True))
    shapes = scipy.linalg.solve_triangular(lower, vectors[:, ::-1], lower=True, trans="T")
    return 1 / np.sqrt(squares[::-1]), shapes / np.sqrt(squares[::-1])


def _around(coefficients: np.ndarray, angles: np.ndarray) -> np.ndarray:
    """(m, n_angle) values at angles of the real parts of waves exp(i n angle) with coefficients (N + 1, m)."""
    waves = np.exp(1j * np.multiply.outer(angles, np.arange(len(coefficients))))
    return (waves @ coefficients).real.T


def _lobes(waves: np.ndarray) -> np.ndarray:
    """(m,) the harmonic with the largest share of the rim's displacement, of waves (2, N + 1, m)."""
    shares = np.sum(np.abs(waves) ** 2, axis=0)
    shares[0] *= 2
    return np.argmax(shares, axis=0)
