"""Monotone cubic through points of one row (Fritsch & Butland 1984), as scipy's PchipInterpolator, without its cost.

A map with offsets has some ten thousand rows, for each of which scipy builds an object.
"""

import numpy as np

from exugear.mesh_force.force_kernels import hermite, hermite_slope
from fem.support.numba_cache import compiled, kept


@compiled
def end_slope(h_0, h_1, m_0, m_1):
    """Slope at an end by three points, such that the curve stays monotone."""
    slope = ((2.0 * h_0 + h_1) * m_0 - h_0 * m_1) / (h_0 + h_1)
    if slope * m_0 <= 0.0:
        return 0.0
    return 3.0 * m_0 if m_0 * m_1 <= 0.0 and abs(slope) > 3.0 * abs(m_0) else slope


@compiled
def slopes_of(x, y):
    """Slopes (n,) at the points x, y (n,)."""
    n, d = x.size, np.zeros(x.size)
    h = x[1:] - x[:-1]
    m = (y[1:] - y[:-1]) / h
    if n == 2:
        d[:] = m[0]
        return d
    for k in range(1, n - 1):
        if m[k - 1] * m[k] > 0.0:
            w_1, w_2 = 2.0 * h[k] + h[k - 1], h[k] + 2.0 * h[k - 1]
            d[k] = (w_1 + w_2) / (w_1 / m[k - 1] + w_2 / m[k])
    d[0] = end_slope(h[0], h[1], m[0], m[1])
    d[-1] = end_slope(h[-1], h[-2], m[-1], m[-2])
    return d


@kept
def monotone_cubic(x, y, at):
    """Values and slopes (m,) at increasing places at (m,) within increasing x (n,) of the curve through y (n,)."""
    d, values, slopes, i = slopes_of(x, y), np.empty(at.size), np.empty(at.size), 0
    for j in range(at.size):
        while i < x.size - 2 and x[i + 1] < at[j]:
            i += 1
        h = x[i + 1] - x[i]
        t = (at[j] - x[i]) / h
        values[j] = hermite(t, y[i], h * d[i], y[i + 1], h * d[i + 1])
        slopes[j] = hermite_slope(t, y[i], h * d[i], y[i + 1], h * d[i + 1]) / h
    return values, slopes
