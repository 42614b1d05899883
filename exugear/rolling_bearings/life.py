"""Capacity of a row of rolling elements (ISO 281) and its basic reference rating life (ISO/TS 16281:2008).

A raceway lives (Q_c / Q_e)^p million revolutions, p = 3 of balls and 4 of rollers, each lamina of these for itself. The
lives of raceways and laminae join with the exponent e = 10/9 of balls and 9/8 of rollers. The equivalent force Q_e of a
ring that turns is the mean of Q^p over all elements. On a ring that stands each position wears on its own: means of Q^p
over the loads, then of their powers e over the positions. For one load these are the equations of ISO/TS 16281; for
several they are Palmgren and Miner's sum of damage, position by position.

The text of the standards was not at hand. Equations and constants agree with public programs that cite them by their
equations (in 2026): capacities of elements, equivalent loads, exponents, and the factor at edges, with 2 n - 2.
"""

from collections.abc import Sequence
from math import cos

import numpy as np

from exugear.rolling_bearings.rows import BallRow, RollerRow, Row
from fem.units import mm

#: Exponents of load and of dispersion of balls and rollers.
LOAD_OF_BALLS, DISPERSION_OF_BALLS = 3.0, 10 / 9
LOAD_OF_ROLLERS, DISPERSION_OF_ROLLERS = 4.0, 9 / 8
#: Ball diameter beyond which the capacity grows by 3.647 D_w^1.4 instead of D_w^1.8 [m].
LARGE_BALL = 25.4 * mm
#: Today's quality (ISO 281): b_m of ball and roller bearings, and the reduction factor of rollers.
B_M_OF_BALLS, B_M_OF_ROLLERS, ROLLER_REDUCTION = 1.3, 1.1, 0.83
MILLION = 1e6
#: Number of displacements whose forces are computed at once.
BLOCK = 1024


def dynamic_capacity(row: Row) -> float:
    """Basic dynamic radial capacity of a single row [N] after ISO 281 and ISO/TR 1281-1, today's quality."""
    g = row.gamma
    if isinstance(row, BallRow):
        f_c = 39.9 * (1 + (1.04 * _ratio_of_balls(row)) ** (10 / 3)) ** -0.3
        f_c *= g**0.3 * (1 - g) ** 1.39 / (1 + g) ** (1 / 3) * (2 * row.r_i / (2 * row.r_i - row.D_w)) ** 0.41
        small, large = (row.D_w / mm) ** 1.8, 3.647 * (row.D_w / mm) ** 1.4
        size = small if row.D_w <= LARGE_BALL else large
        return B_M_OF_BALLS * f_c * cos(row.alpha) ** 0.7 * row.Z ** (2 / 3) * size
    assert isinstance(row, RollerRow)
    f_c = 207.9 * ROLLER_REDUCTION * (1 + (1.04 * _ratio_of_rollers(g)) ** 4.5) ** (-2 / 9)
    f_c *= g ** (2 / 9) * (1 - g) ** (29 / 27) / (1 + g) ** 0.25
    length = (row.L_we / mm * cos(row.alpha)) ** (7 / 9)
    return B_M_OF_ROLLERS * f_c * length * row.Z**0.75 * (row.D_w / mm) ** (29 / 27)


def _ratio_of_balls(row: BallRow) -> float:
    g, grooves = row.gamma, row.r_i / row.r_e * (2 * row.r_e - row.D_w) / (2 * row.r_i - row.D_w)
    return ((1 - g) / (1 + g)) ** 1.72 * grooves**0.41


def _ratio_of_rollers(g: float) -> float:
    return ((1 - g) / (1 + g)) ** (143 / 108)


def element_capacities(row: Row, capacity: float) -> tuple[float, float]:
    """Forces of an element [N] at which inner and outer raceway live a million revolutions, by that of the row [N]."""
    across = row.Z * cos(row.alpha)
    if isinstance(row, BallRow):
        ratio, per_ball = 1.044 * _ratio_of_balls(row), capacity / (row.Z * cos(row.alpha) ** 0.7)
        inner, outer = (1 + ratio ** (10 / 3)) ** 0.3, (1 + ratio ** (-10 / 3)) ** 0.3
        return per_ball / 0.407 * inner, per_ball / 0.389 * outer
    ratio, per_roller = 1.038 * _ratio_of_rollers(row.gamma), capacity / (ROLLER_REDUCTION * across)
    inner, outer = (1 + ratio**4.5) ** (2 / 9), (1 + ratio**-4.5) ** (2 / 9)
    return per_roller / 0.378 * inner, per_roller / 0.364 * outer


def edge_factors(laminae: int) -> np.ndarray:
    """(laminae,) factors by which edges raise the stress of a lamina (ISO/TS 16281)."""
    k = np.arange(1, laminae + 1)
    with np.errstate(divide="ignore"):
        return 1 - 0.01 / np.log(1.985 * np.abs(2 * k - laminae - 1) / (2 * laminae - 2))


def reference_life(rows: Sequence[Row], capacity: float, q: np.ndarray, weights: np.ndarray) -> float:
    """L_10r [revolutions of the ring that turns]; inf where nothing is loaded.

    capacity   dynamic radial capacity of one row [N]
    q          (n, 5) displacements of the bearing [m, rad]; the outer ring stands, of bearings on pins the inner one
    weights    (n,) share of the revolutions in each, sum 1
    """
    damage, dispersion = 0.0, 1.0
    for row in rows:
        inner, outer = element_capacities(row, capacity)
        p, dispersion = LOAD_OF_BALLS, DISPERSION_OF_BALLS
        if isinstance(row, RollerRow):
            p, dispersion, share = LOAD_OF_ROLLERS, DISPERSION_OF_ROLLERS, row.laminae ** (-7 / 9)
            inner, outer = inner * share, outer * share
        at_positions = sum(
            np.einsum("n,njk->jk", weights[first : first + BLOCK], _stressing(row, q[first : first + BLOCK]) ** p)
            for first in range(0, len(q), BLOCK)
        )
        rotating, still = (outer, inner) if row.on_pin else (inner, outer)
        turning, standing = at_positions.mean(axis=0) / rotating**p, at_positions / still**p
        damage += float((turning**dispersion).sum() + (standing**dispersion).mean(axis=0).sum())
    return MILLION * damage ** (-1 / dispersion) if damage > 0 else np.inf


def _stressing(row: Row, q: np.ndarray) -> np.ndarray:
    """(n, Z, laminae) forces [N] that stress the raceways, edge factors included; (n, Z, 1) of balls."""
    if isinstance(row, RollerRow):
        return row.lamina_loads(q) * edge_factors(row.laminae)
    return row.loads(q)[..., None]
