"""Measures by which a workshop inspects tooth thickness: span over k teeth, dimension over two balls (ISO 21771)."""

from contextlib import nullcontext, suppress
from math import copysign, cos, hypot, pi, sin, sqrt, tan
from typing import NamedTuple

from fem.gear.involute import inverse_involute
from fem.support.validation import number, require
from fem.units import mm


class Teeth(NamedTuple):
    """Gear data that these measures depend on, signed as in `fem.Gear`; rolls: roll lengths of the flank's ends [m]."""

    z: int
    r_b: float
    psi_b: float
    beta_b: float
    b: float
    r_f: float
    rolls: tuple[float, float]

    @property
    def p_bn(self) -> float:
        """Normal base pitch [m]."""
        return 2 * pi * self.r_b / self.z * cos(self.beta_b)

    @property
    def s_bn(self) -> float:
        """Normal base thickness [m]."""
        return 2 * self.r_b * self.psi_b * cos(self.beta_b)

    @property
    def r_tip(self) -> float:
        """Tip radius [m]."""
        return copysign(hypot(self.r_b, self.rolls[1]), self.z)

    def touches(self, roll: float) -> bool:
        """Whether the flank reaches a roll length [m]."""
        return self.rolls[0] <= roll <= self.rolls[1]


def span(teeth: Teeth, k: int) -> float:
    """Span measurement W_k over k teeth [m]; ValueError where it misses the flanks or is wider than the gear."""
    inside = f"an internal gear has no span over teeth, got k = {k}; leave it out, and measure between balls, D_M"
    require(teeth.z > 0, inside)
    whole = f"k must be a whole number of teeth from 1 to {teeth.z}, got {k}"
    require(number("k", k) % 1 == 0 and 1 <= k <= teeth.z, whole)
    w = (k - 1) * teeth.p_bn + teeth.s_bn
    roll, low, high = w * cos(teeth.beta_b) / 2, *teeth.rolls
    miss = f"touches at roll length {roll / mm:.4g} mm, the flanks reach from {low / mm:.4g} to {high / mm:.4g} mm"
    require(teeth.touches(roll), f"the span over k = {k} teeth {miss}; choose another k")
    tilted = w * abs(sin(teeth.beta_b))
    wide = f"the span over k = {k} teeth takes {tilted / mm:.4g} mm of face width, the gear has {teeth.b / mm:.4g} mm"
    require(tilted < teeth.b, f"{wide}; choose fewer teeth, or measure over balls")
    return w


def default_k(teeth: Teeth, r: float) -> int:
    """Number of teeth k whose span touches nearest to the circle of radius r [m], at least 2."""
    w = 2 * _roll(teeth, r) / cos(teeth.beta_b)
    return min(max(2, round(1 + (w - teeth.s_bn) / teeth.p_bn)), teeth.z)


def _roll(teeth: Teeth, r: float) -> float:
    """Roll length on the circle of radius r [m]; where the circle misses the flank, that in the middle of the flank."""
    roll = copysign(sqrt(max(r**2 - teeth.r_b**2, 0.0)), teeth.z)
    return roll if teeth.touches(roll) else sum(teeth.rolls) / 2


def over_balls(teeth: Teeth, d_m: float) -> float:
    """Dimension M_dK over two balls of diameter D_M = d_m in opposite spaces [m]; minus that between, of a ring.

    A ball touches two flanks: inv(alpha_K) = D_M / (d_b cos beta_b) less half the space on the base circle, its centre
    lies on d_K = d_b / cos(alpha_K). Raises ValueError for balls that miss the flanks, or stay below the tips.
    """
    require(number("D_M", d_m) > 0, f"D_M must be > 0 m, got {d_m}")
    half_space = pi / teeth.z - teeth.psi_b
    involute_k = d_m / (2 * teeth.r_b * cos(teeth.beta_b)) - half_space
    miss = f"balls of D_M = {d_m / mm:.4g} mm do not rest on the flanks; choose other ones"
    require(involute_k > 0, miss)
    alpha_k = inverse_involute(involute_k)
    d_k = 2 * teeth.r_b / cos(alpha_k)
    require(teeth.touches(teeth.r_b * tan(alpha_k) - d_m / 2 * cos(teeth.beta_b)), miss)
    require(d_k + d_m > 2 * teeth.r_tip, f"balls of D_M = {d_m / mm:.4g} mm stay below the tips; choose larger ones")
    require(d_k - d_m > 2 * teeth.r_f, f"balls of D_M = {d_m / mm:.4g} mm rest on the root circle; choose larger ones")
    return d_k * (cos(pi / (2 * teeth.z)) if teeth.z % 2 else 1.0) + d_m


def ball_diameter(teeth: Teeth, r: float) -> float:
    """Diameter [m], to two digits, of a ball that touches the flanks near the circle of radius r [m]."""
    contact = _roll(teeth, r) / teeth.r_b
    d_m = 2 * teeth.r_b * cos(teeth.beta_b) * (tan(pi / teeth.z - teeth.psi_b + contact) - contact)
    return float(f"{d_m:.2g}")


def default_ball_diameter(teeth: Teeth, r: float) -> float | None:
    """Diameter [m] of a ball that touches the flanks near radius r [m], or nearer to the tip; None if no ball fits."""
    for share in (0.0, 0.25, 0.5, 0.75, 0.9):
        d_m = ball_diameter(teeth, r + share * (teeth.r_tip - r))
        with suppress(ValueError):
            over_balls(teeth, d_m)
            return d_m
    return None


def measures(teeth: Teeth, k: int | None, d_m: float | None, r: float) -> list[tuple[str, float, str, str]]:
    """Rows of a data sheet with span and dimension over balls; a default that cannot be measured is left out.

    r       radius of the circle near which the span and the balls touch by default [m]
    """
    rows: list[tuple[str, float, str, str]] = []
    if k is not None or teeth.z > 0:
        with suppress(ValueError) if k is None else nullcontext():
            spanned = default_k(teeth, r) if k is None else k
            w = span(teeth, spanned)
            rows += [("k", spanned, "1", "teeth in the span"), ("W_k", w, "m", "span measurement over k teeth")]
    size = default_ball_diameter(teeth, r) if d_m is None else d_m
    if size is not None:
        where = "over two balls" if teeth.z > 0 else "between two balls, as measured: > 0"
        measured = abs(over_balls(teeth, size))
        rows += [("D_M", size, "m", "diameter of balls"), ("M_dK", measured, "m", f"dimension {where}")]
    return rows
