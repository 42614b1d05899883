"""Limits within which a gear exists: ValueError with the argument, its value and a remedy for a gear beyond them.

The functions take a `fem.Gear`; its initialization calls them while later fields are still missing.
"""

from math import cos, pi, sin, tan

import numpy as np

from fem.support.plausibility import check_module
from fem.support.validation import require, require_within
from fem.units import deg, mm


def check_rack(gear) -> None:
    """Require a module and angles of a rack."""
    require_within("m_n", gear.m_n, 0, 100 * mm, unit=mm, remedy="mm (pass metres: 2.6*mm)")
    check_module(gear.m_n)
    require_within("alpha_n", gear.alpha_n, 10 * deg, 35 * deg, unit=deg, remedy="deg (pass radians: 20*deg)")
    require_within("beta", gear.beta, -45 * deg, 45 * deg, unit=deg, remedy="deg (pass radians: 15*deg)")


def check_sizes(gear) -> None:
    """Require a face width, a tooth thickness and diameters that fit one another."""
    m_n, shifted = gear.m_n, f"circle shifted by x = {gear.x:.4g} modules"
    thinnest, middle = 2 * gear.x * m_n * tan(gear.alpha_n), 2 * gear.r + 2 * gear.x * m_n
    require_within("b", gear.b, 0.1 * m_n, 200 * m_n, unit=mm, remedy="mm (pass metres: 23*mm)")
    thick = f"mm (between nothing and a whole pitch on the {shifted})"
    require_within("s_n", gear.s_n, thinnest, thinnest + pi * m_n, unit=mm, remedy=thick)
    tip = f"mm (above the base circle, within 4 modules of the {shifted})"
    require_within("d_a", gear.d_a, 2 * gear.r_b, middle + 8 * m_n, unit=mm, remedy=tip)
    root = f"mm (below the tip circle, within 4 modules of the {shifted})"
    require_within("d_f", gear.d_f, middle - 8 * m_n, gear.d_a, unit=mm, remedy=root)
    rim = f"mm (leave a rim of one module below the root circle {gear.d_f / mm:g} mm)"
    require_within("d_bore", gear.d_bore, 0, gear.d_f - 2 * m_n, unit=mm, remedy=rim)


def check_tip(gear) -> None:
    """Require a tooth thickness at the tip."""
    s_a = gear.thickness(gear.r_a)
    tip = f"tip thickness {s_a / mm:.3g} mm at d_a = {gear.d_a / mm:g} mm"
    require(s_a > 0, f"teeth are pointed: {tip}; reduce d_a or x = {gear.x:.4g} modules")


def check_root(gear) -> None:
    """Require a rack, or a fillet, that fits between the teeth and leaves a thick enough root and an involute."""
    if gear.rho_f is not None:
        largest = largest_rack_radius(gear)
        deep = f"d_f = {gear.d_f / mm:g} mm is too deep for s_n = {gear.s_n / mm:.4g} mm (x = {gear.x:.4g})"
        require(largest > 0, f"{deep}: the generating rack's flanks meet above it; raise d_f or reduce x")
        fits = "mm, the roundest tip that fits between the flanks of the generating rack in its normal section"
        require_within("rho_f", gear.rho_f, 0, largest * (1 + 1e-9), unit=mm, remedy=fits)
    if gear.fillet is not None:
        require_within("fillet", gear.fillet, 0, 4 * gear.m_n, unit=mm, remedy="mm (pass metres: 1*mm)")
        fits = f"fillet {gear.fillet / mm:g} mm does not fit between two teeth; reduce it or x, or raise d_f"
        require(gear.root.psi_f <= pi / gear.z * (1 + 1e-9), fits)
    root_thickness = 2 * min(r * psi for r, psi in zip(*gear.root.points(np.linspace(0, 1, 33)), strict=True))
    thin = f"z = {gear.z}, x = {gear.x:.4g} leave teeth {root_thickness / mm:.3g} mm thick at the root"
    require(root_thickness > 0.1 * gear.m_n, f"{thin}; the generating rack undercuts them: raise x, z, rho_f or d_f")
    between = (
        f"no involute between root form circle {2 * gear.r_form / mm:g} mm and tip circle d_a = {gear.d_a / mm:g} mm"
    )
    require(gear.r_a > gear.r_form, f"{between}; raise d_a, or reduce rho_f or the fillet")


def largest_rack_radius(gear) -> float:
    """Tip radius of a rack without a tip land, in the normal section [m]; <= 0 where its flanks meet above d_f."""
    land = gear.m_n * pi - gear.s_n - 2 * gear.h_rack * tan(gear.alpha_n)
    return land / 2 * cos(gear.alpha_n) / (1 - sin(gear.alpha_n))
