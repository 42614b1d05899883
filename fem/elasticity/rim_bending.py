"""Flanks of a ring that follow the bending of its supported rim.

The compliance of a ring whose rim is held by bolts or a bush is that of the clamped ring plus T A^-1 T^T: the
displacement T of the flanks per amplitude of the rim's displacement, and the stiffness A over these amplitudes, of ring
and supports (`fem.elasticity.rim_harmonics`). As a static condensation it counts nothing twice. All teeth act on each
other.
"""

from dataclasses import dataclass
from math import pi
from typing import NamedTuple

import numpy as np
from scipy.linalg import cholesky, solve_triangular

from fem.gear.rim_support import Bolts, Support
from fem.support.cache import Arrays

#: Components of the displacement of the rim, in the order of `rim_harmonics`.
TANGENTIAL, RADIAL = range(2)
#: Shapes in which the flank follows the rim are left out below this share of the largest; modes below that share. Both
#: change te by 4e-5 of it; a state on bolts takes 1.4 times as long as one of a clamped ring, by slices 1.9 times.
LEAST_SHAPE, LEAST_MODE = 1e-4, 1e-7


class RimModes(NamedTuple):
    """Compliance of teeth by the bending of the rim, as a sum of products of m modes.

    first       number of the first of the teeth
    normal      (m, n_tooth, n_axial, n_hat) displacement into the flanks, at the tops of the hats [(m/N)^0.5]
    along       the same along the profiles towards the tips
    """

    first: int
    normal: np.ndarray
    along: np.ndarray


@dataclass(frozen=True)
class RimBending:
    """A ring on its supports; angles of teeth, of supports and on the rim count in the direction of the teeth.

    pitch       angle between two teeth [rad]
    lower       (n, n) lower Cholesky factor of the stiffness over component and 1, cos n angle, sin n angle
    flank       (N + 1, 2, n_shape) complex: shapes of the flank per harmonic exp(i n angle) and component
    shapes      (2, n_shape, n_axial, n_hat) of the flank, into it and along its profile
    share       share of the load that acts on the modelled part of the face
    """

    pitch: float
    lower: np.ndarray
    flank: np.ndarray
    shapes: np.ndarray
    share: float

    def modes(self, angle: float, teeth: range) -> RimModes:
        """Modes of teeth, of which number 0 has its middle at an angle from the supports' angle 0 [rad]."""
        at_teeth = np.concatenate([self.displacement(angle + tooth * self.pitch) for tooth in teeth], axis=1)
        at_teeth = solve_triangular(self.lower, at_teeth, lower=True, check_finite=False)
        value, vector = np.linalg.eigh(at_teeth.T @ at_teeth)
        kept = value > LEAST_MODE * value[-1]
        factor = (vector[:, kept] * np.sqrt(value[kept] / self.share)).T.reshape(-1, len(teeth), self.shapes.shape[1])
        of_flank = (np.einsum("mts,syh->mtyh", factor, shapes) for shapes in self.shapes)
        normal, along = map(np.ascontiguousarray, of_flank)
        return RimModes(teeth[0], normal, along)

    def displacement(self, angle: float) -> np.ndarray:
        """(n, n_shape) T^T: shapes of the flank of the tooth at an angle [rad], per amplitude of the rim."""
        turned = self.flank * np.exp(1j * angle * np.arange(len(self.flank)))[:, None, None]
        return np.concatenate([turned.real, turned.imag[1:]]).swapaxes(0, 1).reshape(len(self.lower), -1)

    def amplitudes(self, forces: np.ndarray) -> np.ndarray:
        """(n, k) amplitudes of the rim [m] under generalized forces (n, k) [N]."""
        half = solve_triangular(self.lower, forces, lower=True, check_finite=False)
        return solve_triangular(self.lower, half, lower=True, trans="T", check_finite=False)


def waves(angles: np.ndarray, highest: int) -> np.ndarray:
    """(n_angle, 2 N + 1) values of 1, cos n angle and sin n angle up to n = N."""
    phase = np.multiply.outer(angles, np.arange(1, highest + 1))
    return np.concatenate([np.ones((len(angles), 1)), np.cos(phase), np.sin(phase)], axis=1)


def support_stiffness(supports: tuple[Support, ...], radius: float, highest: int) -> np.ndarray:
    """(2, 2 N + 1, 2, 2 N + 1) stiffness of supports at a radius [m], as `rim_harmonics` orders that of the ring.

    A bolt holds the mean displacement over its width, a bush that of each point.
    """
    n = np.concatenate([[0], *[np.arange(1, highest + 1)] * 2])
    total = np.zeros((2, n.size, 2, n.size))
    for support in supports:
        if isinstance(support, Bolts):
            means = waves(np.array(support.angles), highest) * np.sinc(n * support.width / (2 * pi * radius))
            matrix = means.T @ means
        else:
            matrix = np.diag(np.where(n == 0, 2 * pi, pi)) * radius
        for component, stiffness in enumerate((support.tangential, support.radial)):
            total[component, :, component] += stiffness * matrix
    return total


def rim_bending(
    harmonics: Arrays, flank: np.ndarray, supports: tuple[Support, ...], radius: float, share: float, teeth: int
) -> RimBending:
    """The ring on its supports, of its `rim_harmonics`.

    flank   (N + 1, 2, 2, n_axial, n_hat) displacement of the flank at the tops of the hats per harmonic and component
    teeth   number of teeth > 0
    """
    stiffness = harmonics["stiffness"] + support_stiffness(supports, radius, len(flank) - 1)
    n = stiffness.shape[0] * stiffness.shape[1]
    rows = flank.reshape(flank.shape[0] * flank.shape[1], -1)
    u, s, shapes = np.linalg.svd(np.concatenate([rows.real, rows.imag]), full_matrices=False)
    kept = s > LEAST_SHAPE * s[0]
    real, imaginary = (u[:, kept] * s[kept]).reshape(2, *flank.shape[:2], -1)
    of_shapes = shapes[kept].reshape(-1, *flank.shape[2:]).swapaxes(0, 1)
    lower = cholesky(stiffness.reshape(n, n), lower=True)
    return RimBending(2 * pi / teeth, lower, real + 1j * imaginary, of_shapes, share)
