"""Contact with one line load in each slice and Hertz's flattening: the slice mode, and the first guess for strips.

Slices n of length l under forces f are in equilibrium where, for the active ones,

    gap + (C0 + te C1) f + c_n f (k_n - ln(f) / 2) - approach te = 0,   approach . f = mesh force

with the compliance C0 between the slices, its change C1 per transmission error as the flanks touch nearer to both tips,
and Hertz's flattening of a slice under its force. Newton's method linearizes it in f and te on each active set.
Source: Johnson, Contact Mechanics, 4.2 and 5.6 (line contact of bodies that act as half-planes).
"""

from dataclasses import replace
from math import exp, inf, log
from typing import NamedTuple

import numpy as np

from fem.contact.coupling import CompiledCompliance, smooth_compliance
from fem.contact.unilateral import Equilibrium, unilateral_contact
from fem.elasticity.face_symmetry import Face
from fem.gap.contact_slices import ContactSlices
from fem.linalg import small_systems
from fem.support.numba_cache import kept_unchecked, unchecked

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


class LineContact(NamedTuple):
    """Contact of n slices of the whole face, each with one line load.

    compliance          (n, n) between the slices before they deflect [m/N]
    softening           (n, n) its change per transmission error [1/N], or (0, 0): none
    factor, constant    (n,) Hertz's flattening [m] under forces f: factor f (constant - ln(f) / 2)
    approach            (n,) normal approach per transmission error
    """

    compliance: np.ndarray
    softening: np.ndarray
    factor: np.ndarray
    constant: np.ndarray
    approach: np.ndarray


class LineLoads(NamedTuple):
    """Transmission errors (m,) [m], tangent stiffnesses (m,) [N/m] and forces on the slices (m, n) [N]."""

    te: np.ndarray
    stiffness: np.ndarray
    force: np.ndarray


class LoadedLine(NamedTuple):
    """A mesh force [N] on a `LineContact` with normal gaps (n,) [m], and the equilibrium of the last Newton step.

    first_touch transmission error of the first touch [m]
    last        (n,) forces on the slices [N]
    te          (1,) transmission error [m]
    """

    contact: LineContact
    mesh_force: float
    gap: np.ndarray
    first_touch: float
    last: np.ndarray
    te: np.ndarray


def compliance_at(
    slices: ContactSlices, bodies: tuple[CompiledCompliance, CompiledCompliance], face: Face
) -> np.ndarray:
    """(n, n) compliance between slices where they are closest, beside their half-planes [m/N]."""
    depth, numbers = DEPTH * slices.position.pair.pinion.m_n, (slices.number, slices.low, slices.high)
    arcs = slices.closest_arcs[..., None]
    return slices.mesh.call(smooth_compliance, bodies, face.share < 1, numbers, depth, arcs, np.zeros(arcs.shape))


def line_contact(
    slices: ContactSlices, bodies: tuple[CompiledCompliance, CompiledCompliance], face: Face, *, softens: bool
) -> LineContact:
    """Contact of slices of the whole face; softens: whether the compliance changes with the deflection."""
    compliance, softening = compliance_at(slices, bodies, face), np.zeros((0, 0))
    m_n = slices.position.pair.pinion.m_n
    if softens:
        touching = replace(slices, te=OVERLAP * m_n)
        softening = (compliance_at(touching, bodies, face) - compliance) / (OVERLAP * m_n)
    constant = 0.5 + np.log(2 * DEPTH * m_n / slices.half_width(1 / slices.width))
    return LineContact(compliance, softening, slices.flattening, constant, slices.closest.approach)


@unchecked
def _newton_step(load, active):
    """Equilibrium of active slices (n,), linear about the last; without active ones, of the first to touch."""
    contact, chosen = load.contact, 0
    for i in range(active.size):
        chosen += active[i]
    if not chosen:
        active = load.gap / contact.approach <= load.first_touch
    gap, approach, extra = _softer(load, active)
    te, stiffness, force = _linear_equilibrium(load, active, gap, approach, extra)
    change = 0.0
    for i in range(force.size):
        if active[i]:
            change = max(change, abs(force[i] - load.last[i]))
    slack = _slack(load, active, te, force, extra)
    for i in range(force.size):
        force_at = force[i] if force[i] > 0 else RELEASED * load.last[i]
        load.last[i] = max(force_at, CONVERGED * load.mesh_force)
    load.te[0] = te
    converged = change < CONVERGED * load.mesh_force and te > load.first_touch - SHORT
    return Equilibrium(te, stiffness, force, slack, converged)


@unchecked
def _softer(load, active):
    """Gap and approach (n,) of the linearized system, and the factor of the softening of the compliance."""
    contact = load.contact
    if not contact.softening.size:
        return load.gap, contact.approach, 0.0
    te, gap, approach = max(load.te[0], load.first_touch), np.empty(active.size), np.empty(active.size)
    for i in range(active.size):
        softer = 0.0
        for j in range(active.size):
            if active[j]:
                softer += contact.softening[i, j] * load.last[j]
        gap[i], approach[i] = load.gap[i] - te * softer, contact.approach[i] - softer
    return gap, approach, te


@unchecked
def _compliance_at(contact, i, j, te):
    """Compliance between two slices at a transmission error [m/N]."""
    if contact.softening.size:
        return contact.compliance[i, j] + te * contact.softening[i, j]
    return contact.compliance[i, j]


@unchecked
def _slack(load, active, te, force, softened_te):
    """(n,) gaps [m] between the flanks, 0 where they are active."""
    slack = np.zeros(force.size)
    for i in range(force.size):
        if not active[i]:
            slack[i] = load.gap[i] - load.contact.approach[i] * te
            for j in range(force.size):
                if active[j]:
                    slack[i] += _compliance_at(load.contact, i, j, softened_te) * force[j]
    return slack


@unchecked
def _linear_equilibrium(load, active, gap, approach, softened_te):
    """Transmission error, stiffness and forces (n,) of the linear system of active slices."""
    rows, contact = small_systems.true_in(active), load.contact
    matrix, right = np.empty((rows.size, rows.size)), np.empty((2, rows.size))
    for k, i in enumerate(rows):
        for j in range(k + 1):
            matrix[k, j] = _compliance_at(contact, i, rows[j], softened_te)
        flattened, softness = _flattening(contact, i, load.last[i])
        matrix[k, k] += softness
        right[0, k], right[1, k] = gap[i] + flattened, approach[i]
    small_systems.factorize(matrix)
    small_systems.solve(matrix, right)
    closed, stiffness, force = load.mesh_force, 0.0, np.zeros(active.size)
    for k, i in enumerate(rows):
        closed += contact.approach[i] * right[0, k]
        stiffness += contact.approach[i] * right[1, k]
    for k, i in enumerate(rows):
        force[i] = closed / stiffness * right[1, k] - right[0, k]
    return closed / stiffness, stiffness, force


@unchecked
def _flattening(contact, i, force):
    """Flattening of a slice at no force [m] and per force [m/N], of the tangent at a force."""
    factor, constant = contact.factor[i], contact.constant[i]
    below = min(force, exp(2 * (constant - 0.5 - LEAST)))
    softness = factor * (constant - log(below) / 2 - 0.5)
    value = factor * (below * (constant - log(below) / 2) + LEAST * (force - below))
    return value - softness * force, softness


_equilibrium = unilateral_contact(_newton_step, unchecked)


@kept_unchecked
def solve_lines(contact, force, gap):
    """Fields of `LineLoads` under forces on the modelled face (m,) > 0 [N], with normal gaps (m, n) [m]."""
    te, stiffness, loads = np.empty(force.size), np.empty(force.size), np.empty(gap.shape)
    n, compliance = contact.approach.size, 0.0
    for i in range(n):
        for j in range(n):
            compliance += contact.compliance[i, j] / n**2
    for k in range(force.size):
        first_touch, last, least = gap[k] / contact.approach, np.empty(n), inf
        for i in range(n):
            last[i], least = force[k] / n, min(least, first_touch[i])
        load = LoadedLine(contact, force[k], gap[k], least, last, np.zeros(1))
        state = _equilibrium(load, first_touch <= least + compliance * force[k])
        te[k], stiffness[k] = state.te, state.stiffness
        for i in range(n):
            loads[k, i] = state.force[i]
    return te, stiffness, loads
