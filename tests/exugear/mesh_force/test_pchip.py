"""Monotone curves against scipy's."""

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from exugear.mesh_force.pchip import monotone_cubics


def test_monotone_cubics_are_scipys():
    random = np.random.default_rng(4)
    for n in (2, 3, 4, 30):
        x, y = np.cumsum(random.uniform(0.1, 1, n)), random.normal(size=n)
        curve, at = PchipInterpolator(x, y), np.linspace(x[0], x[-1], 101)
        before = np.full(2, np.nan)
        rows = (np.array([[*before, *row]]) for row in (x, y))
        values, slopes = monotone_cubics(*rows, np.array([2]), at)
        assert values[0] == pytest.approx(curve(at), rel=1e-12, abs=1e-12)
        assert slopes[0] == pytest.approx(curve(at, 1), rel=1e-11, abs=1e-11)
