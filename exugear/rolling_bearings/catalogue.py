"""Inner geometry of a rolling bearing, estimated from the sizes and capacities in catalogues.

Number, diameter and length of the elements are those that fit the capacities of ISO 281 and ISO 76 and what bearings of
a type have in common: how full the row is, and the diameter of the elements over the height of the section. Of deep
groove bearings the balls fill an arc of about 188 degrees before they are spread (Conrad). The geometries that fit
nearly as well tell the error.
"""

from collections.abc import Callable
from math import asin, pi
from typing import NamedTuple

import numpy as np
import scipy

from exugear.rolling_bearings.life import dynamic_capacity
from exugear.rolling_bearings.rows import BallRow, RollerRow, Row, static_capacity
from fem.units import deg, mm

#: Relative scatter of the capacities in catalogues about those of the standards: quality and rounding.
CAPACITY_SCATTER = 0.06
#: Increase of the sum of squares up to which a geometry fits nearly as well.
NEARLY = 4.0


class Habit(NamedTuple):
    """What bearings of a type have in common, each with its scatter.

    fill     elements times their diameter over the circumference of the pitch circle
    height   diameter of the elements over the height of the section (D - d)
    length   effective length of rollers over the width B
    """

    fill: tuple[float, float]
    height: tuple[float, float]
    length: tuple[float, float] = (0.0, 1.0)


#: Habits by type; of deep groove bearings fill is the arc of the balls over 188 degrees.
HABITS = {
    "deep groove": Habit((1.0, 0.02), (0.31, 0.012)),
    "angular contact": Habit((0.82, 0.06), (0.30, 0.02)),
    "cylindrical roller": Habit((0.80, 0.06), (0.27, 0.02), (0.58, 0.07)),
    "tapered roller": Habit((0.88, 0.05), (0.24, 0.02), (0.68, 0.07)),
}
#: Arc that the balls of a deep groove bearing fill [rad].
CONRAD = 188 * deg


class Sizes(NamedTuple):
    """Boundary dimensions d, D, B [m], capacities C, C_0 [N] and contact angle [rad] in a catalogue."""

    d: float
    D: float
    B: float
    C: float
    C_0: float
    alpha: float


class Fit(NamedTuple):
    """An estimated row, and the sum of squares of its misfit."""

    row: Row
    misfit: float


def estimated_row(kind: str, sizes: Sizes, row_of: Callable[[int, float, float], Row]) -> tuple[Row, list[Row]]:
    """The row of a type that fits the sizes best, and others that fit nearly as well.

    row_of   (number, diameter, length of rollers) -> row
    """
    largest = int(pi / asin(min(HABITS[kind].height[0] * (sizes.D - sizes.d) * 0.7 / pitch_diameter(sizes), 0.5)))
    fits = [_fit(kind, sizes, row_of, Z) for Z in range(4, largest + 1)]
    best = min(fits, key=lambda fit: fit.misfit)
    return best.row, [fit.row for fit in fits if fit is not best and fit.misfit < best.misfit + NEARLY]


def pitch_diameter(sizes: Sizes) -> float:
    """Diameter of the pitch circle [m], in the middle of the section."""
    return (sizes.d + sizes.D) / 2


def _fit(kind: str, sizes: Sizes, row_of: Callable[[int, float, float], Row], Z: int) -> Fit:
    """The diameter and length of Z elements that fit the sizes best."""
    habit, section = HABITS[kind], sizes.D - sizes.d

    def misfits(x: np.ndarray) -> np.ndarray:
        D_w, length = x[0] * section, x[1] * sizes.B
        row = row_of(Z, D_w, length)
        filled = 2 * (Z - 1) * asin(D_w / row.D_pw) / CONRAD if kind == "deep groove" else Z * D_w / (pi * row.D_pw)
        wanted = zip((filled, x[0], x[1]), habit, strict=True)
        capacities = np.log([dynamic_capacity(row) / sizes.C, static_capacity(row) / sizes.C_0]) / CAPACITY_SCATTER
        return np.array([*capacities, *((value - mean) / scatter for value, (mean, scatter) in wanted)])

    most = min(0.45, 0.98 * pitch_diameter(sizes) * float(np.sin(pi / Z)) / section)
    start = [min(habit.height[0], 0.9 * most), habit.length[0] or 0.5]
    fit = scipy.optimize.least_squares(misfits, start, bounds=([0.02, 0.0], [most, 1.0]))
    return Fit(row_of(Z, fit.x[0] * section, fit.x[1] * sizes.B), 2 * fit.cost)


def described(row: Row, alternatives: list[Row], sizes: Sizes) -> str:
    """The estimate in words, with its error; alternatives: rows that fit nearly as well."""
    length = f", L_we {row.L_we / mm:.3g} mm" if isinstance(row, RollerRow) else ""
    off = capacity_errors(row, sizes)
    geometry = f"inner geometry estimated: Z {row.Z}, D_w {row.D_w / mm:.3g} mm{length}"
    spread = max((abs(stiffness_measure(x) / stiffness_measure(row) - 1) for x in alternatives), default=0.0)
    fit = f"its C and C_0 are {off[0]:+.1%} and {off[1]:+.1%} off the given ones"
    numbers = sorted({x.Z for x in alternatives})
    doubt = f"{numbers} elements fit nearly as well, which changes the stiffness by up to {spread:.1%}"
    return f"{geometry}; {fit}; {doubt if alternatives else 'no other number of elements fits'}"


def capacity_errors(row: Row, sizes: Sizes) -> tuple[float, float]:
    """Relative errors of C and C_0 of an estimated row."""
    return dynamic_capacity(row) / sizes.C - 1, static_capacity(row) / sizes.C_0 - 1


def stiffness_measure(row: Row) -> float:
    """What the stiffness of a row under a given load is proportional to: (Z K)^(1/n) with forces K approach^n."""
    if isinstance(row, BallRow):
        return (row.Z * row.stiffness) ** (2 / 3)
    assert isinstance(row, RollerRow)
    return (row.Z * row.stiffness * row.laminae) ** 0.9
