"""Hypothesis strategies: gears and pairs of every kind that exists."""

from dataclasses import replace
from math import cos, hypot, sqrt, tan

import numpy as np
from hypothesis import reject
from hypothesis import strategies as st
from scipy.optimize import brentq

import fem
from fem.units import GPa, deg, mm, um


def floats(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high, allow_subnormal=False)


@st.composite
def modifications(draw, z: int) -> tuple:
    """Some random modifications of a flank of a gear with z teeth, of lengths that suit m_n = 1 mm and b = 5 mm."""
    amount, power = floats(-10 * um, 30 * um), floats(1, 3)
    kinds = [
        st.builds(fem.TipRelief, amount, floats(0.05 * mm, 0.3 * mm), power),
        st.builds(fem.RootRelief, amount, floats(0.05 * mm, 0.3 * mm), power),
        st.builds(fem.EdgeBreak, floats(0.01 * mm, 0.1 * mm)),
        st.builds(fem.ProfileCrowning, amount),
        st.builds(fem.LeadCrowning, amount),
        st.builds(fem.HelixSlope, amount),
        st.builds(fem.EndRelief, amount, floats(0.1 * mm, 2 * mm), power),
        st.builds(fem.PitchDeviation, st.lists(amount, min_size=z, max_size=z)),
        st.builds(
            fem.Grid,
            st.just((0, 5 * mm, 500 * mm)),
            st.just((-10 * mm, 10 * mm)),
            st.lists(st.tuples(amount, amount), min_size=3, max_size=3),
        ),
    ]
    return tuple(draw(st.lists(st.one_of(kinds), max_size=3)))


def rough_data() -> st.SearchStrategy[dict]:
    """Data of gears many of which are impossible."""
    roots = st.just({}) | st.fixed_dictionaries({"rho_f": floats(0.01 * mm, 8 * mm)})
    roots |= st.fixed_dictionaries({"fillet": floats(0.01 * mm, 8 * mm)})
    depths = st.just({}) | st.fixed_dictionaries({"h_fP": floats(0.5 * mm, 30 * mm)})
    tips = st.just({}) | st.fixed_dictionaries({"d_a": floats(1 * mm, 3000 * mm)})
    sizes = st.fixed_dictionaries(
        {
            "z": st.integers(5, 150),
            "m_n": floats(0.5 * mm, 20 * mm),
            "b": floats(0.5 * mm, 500 * mm),
            "d_bore": floats(0.1 * mm, 2000 * mm),
            "alpha_n": floats(10 * deg, 35 * deg),
            "beta": floats(-45 * deg, 45 * deg),
            "x": floats(-2, 2) | floats(-12, 12),
        }
    )
    return st.tuples(sizes, roots, depths, tips).map(lambda parts: parts[0] | parts[1] | parts[2] | parts[3])


@st.composite
def gear_data(draw, shared=None) -> dict:
    """Data of gears, most of which exist; d_bore as share of the largest possible one."""
    z = draw(st.integers(8, 150))
    if shared is None:
        hand = st.just(0.0) | floats(-35 * deg, 35 * deg)
        m_n, alpha_n, beta = draw(floats(0.5, 20)) * mm, draw(floats(14.5 * deg, 25 * deg)), draw(hand)
        shared = {"m_n": m_n, "alpha_n": alpha_n, "beta": beta}
    m_n = shared["m_n"]
    root = draw(st.sampled_from(["rack", "rack", "rho_f", "fillet"]))
    radius = {} if root == "rack" else {root: draw(floats(0.1, 0.38 if shared["alpha_n"] < 21 * deg else 0.25)) * m_n}
    return (
        shared
        | {
            "z": z,
            "x": draw(floats(-0.6, min(1.0, (z - 5) / 14))),
            "b": draw(floats(2, 30)) * m_n,
            "h_fP": draw(floats(1.1, 1.25 if root == "rack" else 1.4)) * m_n,
            "d_bore": draw(floats(0.1, 0.95)),
        }
        | radius
    )


def built(data: dict, **changes) -> fem.Gear:
    """The gear of `gear_data` with changes."""
    gear = fem.Gear(**data | {"d_bore": 1e-6 * mm} | changes)
    return replace(gear, d_bore=data["d_bore"] * (gear.d_f - 2 * gear.m_n))


def modified(draw, gear: fem.Gear) -> fem.Gear:
    parts = draw(modifications(gear.z))
    return replace(gear, flank=draw(st.sampled_from([(), parts, fem.Sides(parts), fem.Sides((), parts)])))


@st.composite
def gears(draw) -> fem.Gear:
    """Gears that exist: spur and helical, undercut or not, rack root or circular fillet, modified or not."""
    try:
        return modified(draw, built(draw(gear_data())))
    except ValueError:
        reject()


@st.composite
def pairs(draw) -> fem.GearPair:
    """Pairs that run: unequal gears with some backlash, whose tips are cut back where they would touch the roots."""
    data = draw(gear_data())
    mate_data = draw(gear_data({"m_n": data["m_n"], "alpha_n": data["alpha_n"], "beta": -data["beta"]}))
    try:
        gears = built(data), built(mate_data)
        a = without_backlash(*gears) + draw(st.just(0.0) | floats(0, 0.1)) * data["m_n"]
        tips = (tip_diameter(gear, mate, a) for gear, mate in (gears, gears[::-1]))
        cut = [replace(gear, d_a=d_a) for gear, d_a in zip(gears, tips, strict=True)]
        material = draw(st.sampled_from([fem.STEEL, fem.Material(E=3 * GPa, nu=0.4, density=1400)]))
        return fem.GearPair(modified(draw, cut[0]), replace(modified(draw, cut[1]), material=material), a=a)
    except ValueError:
        reject()


def involute(alpha):
    """Involute function of an angle [rad]."""
    return np.tan(alpha) - alpha


def without_backlash(pinion: fem.Gear, wheel: fem.Gear) -> float:
    """Centre distance [m] that the profile shifts give (ISO 21771)."""
    shift = 2 * tan(pinion.alpha_n) * (pinion.x + wheel.x) / (pinion.z + wheel.z)
    alpha_wt = brentq(lambda alpha: involute(alpha) - involute(pinion.alpha_t) - shift, 0.0, 1.5, xtol=1e-15)
    return (pinion.r_b + wheel.r_b) / cos(alpha_wt)


def tip_diameter(gear: fem.Gear, mate: fem.Gear, a: float) -> float:
    """Largest d_a [m] up to the gear's own that leaves the mate's root and, unless undercut, its involute free."""
    line = sqrt(max(0.0, a**2 - (gear.r_b + mate.r_b) ** 2))
    free = np.inf if mate.undercut else hypot(gear.r_b, max(0.0, line - mate.roll_form) * (1 - 1e-3))
    return 2 * min(gear.r_a, a - mate.r_f - 0.1 * gear.m_n, free)
