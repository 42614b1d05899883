"""Tolerances of flanks by accuracy class (ISO 1328-1:1995 and 2013), and deviations that are drawn within them.

All lengths in formulas are in mm, tolerances in um, times sqrt(2)^(class - 5). The edition of 1995 takes geometric
means of the ranges in which diameter, module and face width lie, and F_r is that of ISO 1328-2:1997; its tables confirm
them (tests/fem/gear/test_iso1328.py). The edition of 2013 takes the sizes as they are, by its formulas (5) to (12),
clause 5.3; F_r = 0.9 F_p stands in its annex on runout (informative). Totals are root sums of squares before these are
rounded. Values are rounded as clause 5.2.3 says: above 10 um to 1, from 5 um on to 0.5, below to 0.1 um.

Source of the edition of 2013: its scope as the publishers' pages print it (classes 1 to 11, 5 <= z <= 1000, 5 to
15,000 mm, modules of 0.5 to 70 mm, 4 to 1,200 mm, beta <= 45 deg), and three independent public programs that state
the formulas with their numbers, alike; the standard itself, and a worked table of it, are not public.
"""

from dataclasses import dataclass, fields, replace
from math import floor, hypot, pi, sqrt

import numpy as np

from fem.gear.gear import Gear
from fem.microgeometry.deviation import OnTooth, PitchDeviation
from fem.microgeometry.flank import Sides
from fem.microgeometry.modification import HelixSlope, Modification, ProfileCrowning, TipRelief, check_within
from fem.support.arguments import checked
from fem.support.representation import short
from fem.support.validation import number, require
from fem.units import mm, um

#: Limits of the ranges of reference diameter, module and face width in the edition of 1995 [mm].
DIAMETERS = 5, 20, 50, 125, 280, 560, 1000, 1600, 2500, 4000, 6000, 8000, 10000
MODULES = 0.5, 2, 3.5, 6, 10, 16, 25, 40, 70
WIDTHS = 4, 10, 20, 40, 80, 160, 250, 400, 650, 1000
NAMES = "f_pt", "F_p", "F_alpha", "f_f_alpha", "f_H_alpha", "F_beta", "f_f_beta", "f_H_beta", "F_r"
#: Limits of the edition of 2013 [mm], and the classes of each edition.
LIMITS = {"d": (5, 15000), "m_n": (0.5, 70), "b": (4, 1200)}
CLASSES = {1995: (0, 12), 2013: (1, 11)}
#: Numbers of teeth of the edition of 2013.
TEETH = 5, 1000
#: Share of F_p of the index deviation that returns once per turn, before both are scaled.
ONCE_PER_TURN = 0.7


@checked
@short(**dict.fromkeys(NAMES, "um"))
@dataclass(frozen=True)
class FlankTolerances:
    """Tolerances of the flanks of a gear [m] (ISO 1328-1).

    f_pt        single pitch deviation, of either sign
    F_p         total cumulative pitch deviation
    F_alpha     total profile deviation; f_f_alpha: its form, f_H_alpha: its slope, of either sign
    F_beta      total helix deviation; f_f_beta: its form, f_H_beta: its slope, of either sign
    F_r         runout

    Raises ValueError for values below 0 or of other units.
    """

    f_pt: float
    F_p: float
    F_alpha: float
    f_f_alpha: float
    f_H_alpha: float
    F_beta: float
    f_f_beta: float
    f_H_beta: float
    F_r: float

    def __post_init__(self):
        for name in NAMES:
            check_within(name, getattr(self, name), 0.0, 1e-2, "m (pass metres: 8*um)")


@checked
def iso1328(gear: Gear, accuracy_class: int, *, edition: int = 2013) -> FlankTolerances:
    """Tolerances of a gear by its accuracy class.

    accuracy_class   0 to 12 in the edition of 1995, 1 to 11 in that of 2013
    edition          1995 (F_r: ISO 1328-2:1997) or 2013

    Raises ValueError for a class, an edition or a size that the standard does not know.
    """
    teeth = f"z must have {TEETH[0]} to {TEETH[1]} teeth of ISO 1328-1:2013, got {gear.z}; take edition=1995"
    require(edition != 2013 or TEETH[0] <= abs(gear.z) <= TEETH[1], teeth)
    return tolerances(abs(2 * gear.r) / mm, gear.m_n / mm, gear.b / mm, accuracy_class, edition=edition)


def tolerances(d: float, m_n: float, b: float, accuracy_class: int, *, edition: int = 2013) -> FlankTolerances:
    """The same by reference diameter, normal module and face width [mm], as the tables of the standard give them."""
    require(edition in CLASSES, f"edition must be 1995 or 2013, got {edition}")
    low, high = CLASSES[edition]
    within = f"accuracy_class of ISO 1328-1:{edition} must be a whole number from {low} to {high}, got {accuracy_class}"
    require(number("accuracy_class", accuracy_class) % 1 == 0 and low <= accuracy_class <= high, within)
    step = 2 ** ((accuracy_class - 5) / 2)
    if edition == 1995:
        d, m, b = (_mean(*x) for x in (("d", d, DIAMETERS), ("m_n", m_n, MODULES), ("b", b, WIDTHS)))
        values = {
            "f_pt": 0.3 * (m + 0.4 * sqrt(d)) + 4,
            "F_p": 0.3 * m + 1.25 * sqrt(d) + 7,
            "F_alpha": 3.2 * sqrt(m) + 0.22 * sqrt(d) + 0.7,
            "f_f_alpha": 2.5 * sqrt(m) + 0.17 * sqrt(d) + 0.5,
            "f_H_alpha": 2 * sqrt(m) + 0.14 * sqrt(d) + 0.5,
            "F_beta": 0.1 * sqrt(d) + 0.63 * sqrt(b) + 4.2,
            "f_f_beta": 0.07 * sqrt(d) + 0.45 * sqrt(b) + 3,
            "f_H_beta": 0.07 * sqrt(d) + 0.45 * sqrt(b) + 3,
            "F_r": 0.24 * m + sqrt(d) + 5.6,
        }
    else:
        for name, value in {"d": d, "m_n": m_n, "b": b}.items():
            least, most = LIMITS[name]
            require(least <= value <= most, f"{name} must lie in [{least}, {most}] mm of ISO 1328-1, got {value:g} mm")
        cumulative = 0.002 * d + 0.55 * sqrt(d) + 0.7 * m_n + 12
        values = {
            "f_pt": 0.001 * d + 0.4 * m_n + 5,
            "F_p": cumulative,
            "f_f_alpha": 0.55 * m_n + 5,
            "f_H_alpha": 0.4 * m_n + 0.001 * d + 4,
            "f_f_beta": 0.07 * sqrt(d) + 0.45 * sqrt(b) + 4,
            "f_H_beta": 0.05 * sqrt(d) + 0.35 * sqrt(b) + 4,
            "F_r": 0.9 * cumulative,
        }
        values["F_alpha"] = hypot(values["f_H_alpha"], values["f_f_alpha"])
        values["F_beta"] = hypot(values["f_H_beta"], values["f_f_beta"])
    return FlankTolerances(**{part.name: _rounded(values[part.name] * step) * um for part in fields(FlankTolerances)})


def _mean(name: str, value: float, limits: tuple[float, ...]) -> float:
    """Geometric mean of the limits between which a value lies: above the lower and up to the upper one."""
    within = f"{name} must lie in [{limits[0]:g}, {limits[-1]:g}] mm of ISO 1328-1:1995, got {value:g} mm"
    require(limits[0] <= value <= limits[-1], within)
    upper = next(i for i, limit in enumerate(limits) if i and value <= limit + 1e-9)
    return sqrt(limits[upper - 1] * limits[upper])


def _rounded(value: float) -> float:
    """A tolerance [um] rounded as in the standard, halves up."""
    digit = 1.0 if value > 10 else 0.5 if value >= 5 else 0.1
    return floor(value / digit + 0.5 + 1e-9) * digit


@checked
def drawn_deviations(
    gear: Gear, tolerances: FlankTolerances, seed: int, *, profiles: bool = True, leads: bool = False
) -> Gear:
    """The gear with deviations of its left flanks that are drawn within tolerances; a seed gives the same ones again.

    Right flanks that are given by `fem.Sides` stay; without it they are the same as the left ones.

    Index deviations are the sum of one that returns once per turn, of random phase, as runout makes it, and of random
    ones of single teeth; they are scaled so that f_pt and F_p are kept, and the nearer of both is reached by a share
    that is drawn from [1/2, 1].

    profiles    whether the profiles of single teeth differ: by a slope within f_H_alpha and a crowning within
                f_f_alpha, both reduced where they add up to more than F_alpha
    leads       whether their helices differ: by a slope within f_H_beta

    Raises ValueError for bad input.
    """
    require(seed >= 0, f"seed must be a whole number >= 0, got {seed}")
    rng, z = np.random.default_rng(seed), abs(gear.z)
    angle, once = rng.uniform(0, 2 * pi), 2 * pi * np.arange(z) / z
    index = ONCE_PER_TURN * np.cos(once - angle) * tolerances.F_p / 2 + rng.normal(0, tolerances.f_pt / 4, z)
    index -= index.mean()
    pitch = np.abs(index - np.roll(index, 1)).max() / tolerances.f_pt
    index *= rng.uniform(0.5, 1) / max(pitch, np.ptp(index) / tolerances.F_p)
    flank: list[Modification] = [*gear.drive_flank, PitchDeviation(tuple(index.tolist()))]
    for tooth in range(z):
        parts: list[Modification] = []
        if profiles:
            drawn = rng.uniform(-1, 1, 2) * (tolerances.f_H_alpha, tolerances.f_f_alpha)
            total = _total(*drawn)
            slope, form = drawn * min(1.0, tolerances.F_alpha / total) if total > 0 else drawn
            length = gear.roll_tip - gear.roll_form
            parts += [TipRelief(float(slope), length), ProfileCrowning(float(form))]
        if leads:
            parts.append(HelixSlope(float(rng.uniform(-1, 1) * tolerances.f_H_beta)))
        if parts:
            flank.append(OnTooth(tooth, tuple(parts)))
    return replace(gear, flank=Sides(tuple(flank), gear.coast_flank) if isinstance(gear.flank, Sides) else tuple(flank))


def _total(slope: float, form: float) -> float:
    """Total deviation of a straight slope and a parabola on the same length: highest less lowest point."""
    slope, form = abs(slope), abs(form)
    return slope if slope >= 4 * form else (form + slope / 4) ** 2 / form
