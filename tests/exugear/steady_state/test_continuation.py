"""Continuation at its limits: steps without orbits, orbits at the end of a branch."""

from dataclasses import replace

import numpy as np

from exugear.steady_state import branch as branches
from exugear.steady_state.continuation import located
from exugear.steady_state.periodic_orbit import OrbitPoint


def point(frequency: float, rise: float) -> OrbitPoint:
    """An orbit of one degree of freedom, on a branch whose frequency rises or falls."""
    tangent = np.array([0.8, 0.0, 0.6 * rise])
    return OrbitPoint(np.array([frequency, 0.0, frequency]), np.zeros((2, 3)), 1, tangent)


class Orbits:
    """Orbits that Newton's iteration does not reach, or reaches at the guess."""

    def __init__(self, system, period=1):
        self.system = system

    def states_of(self, unknowns):
        return unknowns[:-1]

    def frequency_of(self, unknowns):
        return unknowns[-1]

    def solved(self, guess, direction, jacobian=None):
        return None

    def at_frequency(self, states, frequency):
        return replace(point(frequency, 1.0), unknowns=np.append(states, frequency))


def test_no_fold_is_marked_between_orbits_where_the_iteration_fails():
    assert located(Orbits(None), point(1.0, 1.0), point(1.1, -1.0)) == []


def test_an_orbit_at_the_end_of_a_branch_lies_on_it_but_for_rounding(monkeypatch):
    """Else a sweep that starts there follows the branch a second time."""
    monkeypatch.setattr(branches, "PeriodicOrbits", Orbits)
    branch = branches.Branch([point(x, 1.0) for x in (1.4, 1.5, 1.6)], 1, True)
    assert branches.chord_of(branch, point(np.nextafter(1.6, 2.0), 1.0), None) == 1
    assert branches.chord_of(branch, point(1.61, 1.0), None) is None
