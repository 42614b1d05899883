"""Gears and flank loads for stress recovery."""

import numpy as np
from paper_gears import paper_gear, paper_pair

import fem
from fem import STEEL, Density
from fem.gear import tooth_profile
from fem.pair import hertz
from fem.stress.flank_loads import FlankLoad
from fem.units import deg, mm

GEAR = paper_gear()
ROUGH = fem.Resolution(Density(flank=6, fillet=1, tooth=2, rim=1, body=2, width=1), 4)
PITCH_POINT = paper_pair().roll_pitch


def helical_gear(hand: int = 1) -> fem.Gear:
    return fem.Gear(z=57, m_n=2.5 * mm, b=23 * mm, beta=hand * 15 * deg, d_bore=60 * mm)


def hertz_load(line_load: float, tooth: int = 0) -> tuple[FlankLoad, float, float]:
    """Elliptical pressure at the pitch point on twelve strips, its half-width [m] and its largest value [Pa]."""
    half = hertz.half_width(line_load, PITCH_POINT / 2, 2 * hertz.flattening(STEEL))
    x = np.linspace(-1, 1, 13)
    share = np.diff(x * np.sqrt(1 - x**2) + np.arcsin(x)) / np.pi
    edges = tooth_profile.arc_length(GEAR, PITCH_POINT) + half * x
    load = FlankLoad(tooth, edges[None], np.zeros(1), np.ones(1), line_load * share[None])
    return load, half, 2 * line_load / (np.pi * half)
