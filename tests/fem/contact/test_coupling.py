"""Compliance between slices against products of all hat functions, and states against dense algebra in numpy."""

import numpy as np
import pytest
from compliance_products import coupling, elastic_body
from contacts import contact_of, strips_in_contact
from helical_gears import helical
from scipy.optimize import nnls

import fem
from fem import Density
from fem.contact.coupling import smooth_compliance
from fem.units import mm, um

TINY = Density(flank=6, fillet=1, tooth=2, rim=1, body=1, width=2)


@pytest.fixture(scope="module")
def contact():
    """Helical gears with reliefs, displaced along the axis."""
    relief = (fem.TipRelief(15 * um, 2.5 * mm), fem.LeadCrowning(5 * um))
    pair = fem.GearPair(helical(1, flank=relief), helical(-1), a=150 * mm)
    bodies = (elastic_body(gear, TINY.with_teeth(3, behind=1)) for gear in (pair.pinion, pair.wheel))
    return contact_of(pair, bodies, 0.3, 8, axial=1 * mm)


@pytest.mark.parametrize("tilted", [0.0, 0.02])
def test_compliance_between_slices_is_that_of_all_hat_functions(contact, tilted):
    """Slices across the ends of the tables, loads beyond the outer tops, tooth pairs ahead and behind."""
    number, m = np.repeat([-1, 0, 1], 4), 3
    low = np.tile([-11.5, -4, 0.3, 9], 3) * mm
    high, rng = low + np.tile([7.5, 4.3, 2, 2.5], 3) * mm, np.random.default_rng(0)
    arcs, tilts = rng.uniform(-0.5, 9, (2, 12, m)) * mm, tilted * rng.standard_normal((2, 12, m))
    slices, mesh = (number, low, high), contact.slicing.mesh
    given = contact.bodies, False, slices, 1 * mm, arcs, tilts
    flat = mesh.call(smooth_compliance, *given[:4], 0 * arcs + arcs[:, :1, :1], 0 * tilts)
    half_planes = flat - points(contact, slices, 0 * arcs + arcs[:, :1, :1], 0 * tilts)
    smooth = mesh.call(smooth_compliance, *given) - half_planes
    assert smooth == pytest.approx(points(contact, slices, arcs, tilts), rel=1e-9, abs=1e-22)


def points(contact, slices, arcs: np.ndarray, tilts: np.ndarray) -> np.ndarray:
    """`coupling` of m points in each slice."""
    m = arcs.shape[2]
    repeated = (np.repeat(values, m) for values in slices)
    flat = arcs.reshape(2, -1), tilts.reshape(2, -1)
    return coupling((contact.pinion, contact.wheel), contact.position.axial, *repeated, *flat)


@pytest.mark.parametrize("force", [20.0, 5000.0])
def test_states_are_those_of_non_negative_least_squares(contact, force):
    """One dense compliance of all strips; forces at the same transmission error by Lawson and Hanson's algorithm."""
    state = contact.state(force, 5e-5)
    strips = strips_in_contact(contact, state.slices, state.strips, 5e-5)
    n = state.strip_force.size
    compliance = np.array([strips.displacement(unit.reshape(state.strip_force.shape)).ravel() for unit in np.eye(n)])
    lower = np.linalg.cholesky((compliance + compliance.T) / 2)
    closing = (strips.approach * state.te - strips.gap).ravel()
    exact, _ = nnls(lower.T, np.linalg.solve(lower, closing), maxiter=20 * n)
    assert state.strip_force.ravel() == pytest.approx(exact, abs=1e-6 * force)
    assert strips.approach.ravel() @ exact == pytest.approx(force, rel=1e-8)
