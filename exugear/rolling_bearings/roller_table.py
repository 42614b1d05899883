"""The energy of a roller as a table: a uniform bicubic spline over approach and tilt, even in the tilt.

The laminae of a roller cost a power each. A spline of their energy gives force and moment as its slopes, so that the
force remains one of an energy; a bearing of 14 rollers takes a thirtieth of the time. Runs use it; statics have the
laminae, whose energy is convex without rounding.
"""

from typing import NamedTuple

import numpy as np
import scipy

from exugear.rolling_bearings.rows import RollerRow

#: Points of the table over the approach and over tilts >= 0, and further ones beyond its ends, where the spline bends.
APPROACHES, TILTS, BEYOND = 240, 90, 14
#: Ends of the table: approach over that at the static capacity; lift of a roller's end by its tilt over the same.
LARGEST_APPROACH, LARGEST_LIFT = 1.2, 0.5
#: Share of the largest energy below which coefficients are 0: denormal numbers, which slow the processor down.
NEGLIGIBLE = 1e-18


class RollerTable(NamedTuple):
    """Coefficients (n_approach, n_tilt) of a uniform cubic spline of the energy [J], its first points and steps.

    first, last   approaches [m] between which it holds
    origin        approach of the first row [m]; tilts begin one step below 0
    steep         largest tilt [rad]
    """

    coefficients: np.ndarray
    first: float
    last: float
    origin: float
    approach_step: float
    tilt_step: float
    steep: float


def roller_table(row: RollerRow) -> RollerTable:
    """The table of a row of rollers."""
    largest, lift = LARGEST_APPROACH * row.static_approach, LARGEST_LIFT * row.static_approach
    first, steep = -lift, 2 * lift / row.L_we
    d_step, t_step = (largest - first) / APPROACHES, steep / TILTS
    approach = first + d_step * np.arange(-BEYOND, APPROACHES + BEYOND + 1)
    tilt = t_step * np.arange(TILTS + BEYOND + 1)
    each = approach[:, None, None] - tilt[:, None] * row.slices - 2 * row.profile
    energy = 9 / 19 * row.stiffness * (np.maximum(each, 0.0) ** (19 / 9)).sum(axis=-1)
    coefficients = scipy.ndimage.spline_filter(energy, order=3, mode="mirror")
    coefficients[np.abs(coefficients) < NEGLIGIBLE * energy.max()] = 0.0
    even = np.ascontiguousarray(np.concatenate([coefficients[:, 1:2], coefficients], axis=1))
    return RollerTable(even, first, largest, float(approach[0]), d_step, t_step, steep)
