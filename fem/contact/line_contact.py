"""Contact with one line load in each slice and Hertz's flattening: many loads at once, and the first guess for strips.

Slices n of length l under forces f are in equilibrium where, for the active ones,

    gap + (C0 + te C1) f + c_n f (k_n - ln(f) / 2) - approach te = 0,   approach . f = mesh force

with the compliance C0 between the slices, its change C1 per transmission error as the flanks touch nearer to both tips,
and Hertz's flattening of a slice under its force. Newton's method linearizes it in f and te on each active set.
Source: Johnson, Contact Mechanics, 4.2 and 5.6 (line contact of bodies that act as half-planes).
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from fem.contact.flank_gap import ContactSlices
from fem.contact.strip_contact import Bodies, along_contact, coupling, flattening_of
from fem.contact.unilateral import Equilibrium, unilateral_contact

#: Share of the mesh force by which forces may still change from one Newton step to the next.
CONVERGED = 1e-9
#: Slices that pull are linearized at this share of their last force, as the logarithm is infinite at 0.
RELEASED = 0.2
#: Least flattening per force, over the factor of its logarithm: Hertz's formula becomes negative for slices whose
#: contact is too wide for half-planes.
LEAST = 0.1
#: Rounding by which a transmission error under load may be less than that of the first touch [m].
SHORT = 1e-9
#: Half-planes under whole slices are clamped at this depth, in modules: at least half of the largest contact width.
DEPTH = 1 / 2
#: Overlap of the flanks, in modules, for the difference quotient of their compliance.
OVERLAP = 1 / 250


class Flattening(NamedTuple):
    """Hertz's flattening of slices [m] under forces f: factor f (constant - ln(f) / 2), with factor, constant (n,)."""

    factor: np.ndarray
    constant: np.ndarray

    def linearized(self, force: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Flattening at no force [m] and per force [m/N], each (m, n), of the tangent at forces (m, n)."""
        factor, constant = self
        below = np.minimum(force, np.exp(2 * (constant - 0.5 - LEAST)))
        softness = factor * (constant - np.log(below) / 2 - 0.5)
        value = factor * (below * (constant - np.log(below) / 2) + LEAST * (force - below))
        return value - softness * force, softness


class LineLoads(NamedTuple):
    """Transmission errors (m,) [m], tangent stiffnesses (m,) [N/m] and forces on the slices (m, n) [N]."""

    te: np.ndarray
    stiffness: np.ndarray
    force: np.ndarray


@dataclass(frozen=True)
class LineContact:
    """Contact of slices of the whole face, each with one line load."""

    slices: ContactSlices
    bodies: Bodies

    @property
    def depth(self) -> float:
        """Depth at which half-planes under the slices are clamped [m]."""
        return DEPTH * self.slices.position.pair.pinion.m_n

    def compliance_at(self, te: float) -> np.ndarray:
        """(n, n) compliance between the slices where they are closest at te, beside their half-planes [m/N]."""
        slices = replace(self.slices, te=te) if te else self.slices
        smooth = coupling(self.slices, slices.closest_arcs, self.bodies)[:, 0, :, 0]
        return smooth + along_contact(self.slices, self.depth, self.bodies)

    @cached_property
    def compliance(self) -> np.ndarray:
        """(n, n) compliance between the slices before they deflect [m/N]."""
        return self.compliance_at(0.0)

    @cached_property
    def softening(self) -> np.ndarray:
        """(n, n) change of that compliance per transmission error [1/N]."""
        overlap = OVERLAP * self.slices.position.pair.pinion.m_n
        return (self.compliance_at(overlap) - self.compliance) / overlap

    @cached_property
    def flattening(self) -> Flattening:
        """Hertz's flattening of all slices under their line loads."""
        width = self.slices.half_width(1 / self.slices.width)
        return Flattening(flattening_of(self.slices), 0.5 + np.log(2 * self.depth / width))

    def solve(self, force: np.ndarray, misalignment: np.ndarray) -> LineLoads:
        """Equilibrium under mesh forces (m,) > 0 on the modelled face [N] and misalignments (m,) [rad]."""
        return self._solved(force, misalignment, self.softening)

    def guess(self, force: float, misalignment: float) -> tuple[float, np.ndarray]:
        """Transmission error [m] and forces (n,) [N] where the compliance does not change with the deflection."""
        loads = self._solved(np.array([force]), np.array([misalignment]), None)
        return float(loads.te[0]), loads.force[0]

    def _solved(self, force: np.ndarray, misalignment: np.ndarray, softening: np.ndarray | None) -> LineLoads:
        gap, approach = self.slices.smallest_gap
        gap = gap + self.slices.gap_by(misalignment)
        first_touch = gap / approach
        load = Load(force, gap, approach, first_touch.min(axis=1))
        active = first_touch <= load.first_touch[:, None] + self.compliance.mean() * force[:, None]
        state = unilateral_contact(NewtonSteps(self.compliance, softening, self.flattening, load), active)
        return LineLoads(state.te, state.stiffness, state.force)


class Load(NamedTuple):
    """Mesh forces (m,) [N], normal gaps (m, n) [m], approach (n,) per te, te of the first touch (m,) [m]."""

    force: np.ndarray
    gap: np.ndarray
    approach: np.ndarray
    first_touch: np.ndarray


class NewtonSteps:
    """Equilibrium of m loads on n slices for active sets, each linearized at the last equilibrium.

    Large arrays are reused in every step: allocating them anew takes a third of the time.
    """

    def __init__(self, compliance: np.ndarray, softening: np.ndarray | None, flattening: Flattening, load: Load):
        (m, n), self.flattening, self.load = load.gap.shape, flattening, load
        self.rest_compliance, self.softening = compliance, softening
        self.force, self.te = np.broadcast_to(load.force[:, None] / n, (m, n)), np.zeros(m)
        self.compliance = np.broadcast_to(compliance, (m, n, n)).copy()
        self.system = np.zeros((m, n + 1, n + 1))

    def __call__(self, active: np.ndarray) -> Equilibrium:
        """Equilibrium of active slices (m, n), linear about the last; without active ones, of the first to touch."""
        load, total = self.load, self.load.force[:, None]
        if not active.any(axis=1).all():
            first = load.gap / load.approach <= load.first_touch[:, None]
            active = np.where(active.any(axis=1, keepdims=True), active, first)
        te, stiffness, force = self._step(active, *self._soften(active))
        slack = np.matmul(force[:, None], self.compliance)[:, 0] + load.gap - load.approach * te[:, None]
        change = np.abs(np.where(active, force - self.force, 0.0)).max(axis=1)
        converged = (change < CONVERGED * load.force) & (te > load.first_touch - SHORT)
        self.te, self.force = te, np.maximum(np.where(force > 0, force, RELEASED * self.force), CONVERGED * total)
        return Equilibrium(te, stiffness, force, np.where(active, 0.0, slack), bool(converged.all()))

    def _soften(self, active: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Set the compliance to that at the last te; gap and approach (m, n) of the linearized system."""
        load = self.load
        if self.softening is None:
            return load.gap, load.approach
        te = np.maximum(self.te, load.first_touch)
        np.multiply(te[:, None, None], self.softening, out=self.compliance)
        self.compliance += self.rest_compliance
        softer = np.where(active, self.force, 0.0) @ self.softening.T
        return load.gap - te[:, None] * softer, load.approach - softer

    def _step(self, active, gap, approach) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Transmission errors (m,), stiffnesses (m,) and forces (m, n) of the system for (f, te)."""
        (m, n), each = active.shape, np.arange(active.shape[1])
        flattened, softness = self.flattening.linearized(self.force)
        np.multiply(self.compliance, active[:, :, None], out=self.system[:, :n, :n])
        self.system[:, each, each] += np.where(active, softness, 1.0)
        self.system[:, :n, n] = np.where(active, -approach, 0.0)
        self.system[:, n, :n] = self.load.approach
        right = np.zeros((m, n + 1, 2))
        right[:, :n, 0], right[:, n, 0] = np.where(active, -gap - flattened, 0.0), self.load.force
        right[:, n, 1] = 1.0
        solution = np.linalg.solve(self.system, right)
        return solution[:, n, 0], 1 / solution[:, n, 1], np.where(active, solution[:, :n, 0], 0.0)
