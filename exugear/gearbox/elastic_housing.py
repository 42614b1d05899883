"""A housing with a few coordinates of its own: modes in which it vibrates, and static shapes under bearing forces.

Modes are those of the housing and the bearings, at their largest stiffness, while the shafts stand. Static shapes are
what is left of the displacements under forces on the seats once these modes are taken off: with them the static
compliance is exact. Shapes of high frequency count by their compliance alone: their mass is raised until the frequency
is that of the cap, as that of elastic shafts. A housing without mass has static shapes only, all at the cap.

Matrices are those of the housing alone; bearings act on the displacement of the shaft against its seat.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import pi

import numpy as np
import scipy

from exugear.gearbox.elastic_shaft import CAP
from exugear.gearbox.housing import PER_SEAT, Housing, bearing_on
from exugear.gearbox.shaft import Shaft

#: Share of the largest eigenvalue of the scaled Gram matrix below which shapes depend on one another.
DEPENDENT = 1e-11


@dataclass(frozen=True, eq=False, repr=False)
class ElasticHousing:
    """A housing by m coordinates in a run.

    housing    the housing
    modes      number of modes among them; the others are static shapes
    shapes     (n_coordinate, m) coordinates of the matrices of the housing by those here
    mass, stiffness, damping   (m, m) of the housing alone
    highest    frequency of the highest mode [Hz], on the bearings and with the shafts standing; 0 without modes
    """

    housing: Housing
    modes: int
    shapes: np.ndarray
    mass: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    highest: float

    def __repr__(self) -> str:
        return f"ElasticHousing({self.modes} modes, {self.size - self.modes} static shapes)"

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return self.shapes.shape[1]

    @cached_property
    def at_seats(self) -> np.ndarray:
        """(6 n, m) motion of the seats by the coordinates."""
        return self.housing.seat_rows @ self.shapes


def seat_bearings(housing: Housing, shafts: Sequence[Shaft], moving: Sequence[str]) -> np.ndarray:
    """(6 n, 6 n) stiffness of the bearings on the seats, nonlinear ones at their steepest slopes.

    moving   names of the shafts that move on their bearings; the others exert nothing
    """
    by_name: Mapping[str, Shaft] = {shaft.name: shaft for shaft in shafts}
    stiffness = np.zeros((PER_SEAT * len(housing.seats),) * 2)
    for i, seat in enumerate(housing.seats):
        if seat[0] in moving:
            part = slice(PER_SEAT * i, PER_SEAT * (i + 1))
            stiffness[part, part] = bearing_on(by_name, seat).stiffness
    return stiffness


@dataclass(frozen=True, eq=False)
class HousingOnBearings:
    """A housing on the bearings of standing shafts, from which coordinates are chosen.

    housing    the housing
    bearings   (6 n, 6 n) stiffness of the bearings on the seats
    """

    housing: Housing
    bearings: np.ndarray

    @cached_property
    def stiffness(self) -> np.ndarray:
        """Stiffness of housing and bearings over the coordinates of the housing."""
        return self.housing.stiffness + self.housing.seat_rows.T @ self.bearings @ self.housing.seat_rows

    @cached_property
    def mass(self) -> np.ndarray:
        """Mass over the coordinates of the housing; without one that which puts all shapes to the cap."""
        return self.stiffness / CAP**2 if self.housing.mass is None else self.housing.mass

    @cached_property
    def eigen(self) -> tuple[np.ndarray, np.ndarray]:
        """Squared angular frequencies and modes, of modal mass 1."""
        return scipy.linalg.eigh(self.stiffness, self.mass)

    @property
    def most_modes(self) -> int:
        """Number of modes below the cap; 0 without mass."""
        return 0 if self.housing.mass is None else int((self.eigen[0] < CAP**2).sum())

    @property
    def loaded(self) -> np.ndarray:
        """Numbers of the coordinates of the seats, of all 6 n, on which bearings act and that the housing lets move."""
        return np.flatnonzero((np.diagonal(self.bearings) > 0) & self.housing.over_six.ravel())

    def reduced(self, modes: int) -> ElasticHousing:
        """The housing by a number of modes and its static shapes."""
        squares, vectors = (self.eigen[0][:modes], self.eigen[1][:, :modes])
        loads = self.housing.seat_rows[self.loaded].T
        static = np.linalg.solve(self.stiffness, loads) - vectors @ ((vectors.T @ loads) / squares[:, None])
        shapes = np.hstack([vectors, self._orthogonal(static)])
        frequencies = np.einsum("ij,ik,kj->j", shapes, self.stiffness, shapes)
        mass = shapes.T @ self.mass @ shapes + np.diag(np.maximum(frequencies / CAP**2 - 1, 0.0))
        stiffness = shapes.T @ self.housing.stiffness @ shapes
        damping = self.housing.damping_time * stiffness + shapes.T @ self._modal_damping @ shapes
        highest = float(np.sqrt(squares[-1]) / (2 * pi)) if modes else 0.0
        return ElasticHousing(self.housing, modes, shapes, mass, stiffness, damping, highest)

    def _orthogonal(self, vectors: np.ndarray) -> np.ndarray:
        """Shapes, orthogonal in mass and stiffness and of modal mass 1, that span vectors."""
        norms = np.sqrt(np.einsum("ij,ik,kj->j", vectors, self.mass, vectors))
        scaled = vectors[:, norms > 0] / norms[norms > 0]
        weights, combinations = np.linalg.eigh(scaled.T @ self.mass @ scaled)
        kept = weights > DEPENDENT * weights[-1]
        basis = scaled @ (combinations[:, kept] / np.sqrt(weights[kept]))
        _, turned = scipy.linalg.eigh(basis.T @ self.stiffness @ basis)
        return basis @ turned

    @cached_property
    def _root(self) -> np.ndarray:
        """(k, k) matrix R with R R^T the stiffness of the bearings over the loaded coordinates."""
        values, vectors = np.linalg.eigh(self.bearings[np.ix_(self.loaded, self.loaded)])
        return vectors * np.sqrt(np.maximum(values, 0.0))

    @cached_property
    def _modal_damping(self) -> np.ndarray:
        """Damping matrix by the damping ratio of the modes of the housing on its mounts."""
        if not self.housing.damping_ratio:
            return np.zeros_like(self.stiffness)
        squares, modes = scipy.linalg.eigh(self.housing.stiffness, self.housing.mass)
        momenta = self.housing.mass @ modes
        return momenta @ np.diag(2 * self.housing.damping_ratio * np.sqrt(squares)) @ momenta.T

    def support(self, omega: np.ndarray, damping_ratio: float, reduced: ElasticHousing | None = None) -> np.ndarray:
        """(n, k, k) forces that hold the shafts per their motion at loaded coordinates, over the bearings' stiffness.

        omega          (n,) angular frequencies [rad/s]
        damping_ratio  of the housing
        reduced        by whose coordinates; by default by all of the housing
        """
        k, m, rows = self.housing.stiffness, self.housing.mass, self.housing.seat_rows[self.loaded]
        m = np.zeros_like(k) if m is None else m
        if reduced is not None:
            k, m, rows = reduced.stiffness, reduced.mass, reduced.at_seats[self.loaded]
        root = self._root
        dynamic = (1 + 2j * damping_ratio) * k + rows.T @ root @ root.T @ rows - omega[:, None, None] ** 2 * m
        yielding = rows @ np.linalg.solve(dynamic, np.broadcast_to(rows.T, (omega.size, *rows.T.shape)))
        return np.eye(self.loaded.size) - root.T @ yielding @ root

    def static_support(self) -> np.ndarray:
        """(k, k) the same of the housing without its mass and damping."""
        rows, root = self.housing.seat_rows[self.loaded], self._root
        return np.eye(self.loaded.size) - root.T @ rows @ np.linalg.solve(self.stiffness, rows.T) @ root
