"""Limits within which a gear exists: ValueError with the argument, its value and a remedy for a gear beyond them.

The functions take a `fem.Gear`; its initialization calls them while later fields are still missing.
"""

from math import acos, cos, pi, sin, tan

import numpy as np

from fem.gear.involute import involute
from fem.gear.pinion_cutter import PinionCutter, check_generation
from fem.support.plausibility import check_module
from fem.support.validation import require, require_within
from fem.units import deg, mm


def check_rack(gear) -> None:
    """Require a module and angles of a rack."""
    require_within("m_n", gear.m_n, 0, 100 * mm, unit=mm, remedy="mm (pass metres: 2.6*mm)")
    check_module(gear.m_n)
    require_within("alpha_n", gear.alpha_n, 10 * deg, 35 * deg, unit=deg, remedy="deg (pass radians: 20*deg)")
    require_within("beta", gear.beta, -45 * deg, 45 * deg, unit=deg, remedy="deg (pass radians: 15*deg)")


def check_body_and_tools(gear) -> None:
    """Require the diameter where the body is clamped, and tools that can cut the teeth."""
    if gear.cutter is not None:
        require(isinstance(gear.cutter, PinionCutter), f"cutter must be a fem.PinionCutter, got {gear.cutter!r}")
    if not gear.internal:
        bore = f"d_bore must be given, the diameter where the body is clamped, got z = {gear.z} without it"
        require(gear.d_bore is not None, f"{bore}; a gear without a bore has none, clamp it at the shaft's diameter")
        outside = f"d_rim belongs to internal gears, with z < 0, got d_rim = {gear.d_rim} of z = {gear.z}"
        require(gear.d_rim is None, f"{outside}; pass z={-gear.z}, or d_bore")
        cut = f"cutter generates internal gears, with z < 0, got {gear.cutter} of z = {gear.z}"
        require(gear.cutter is None, f"{cut}; the root of an external gear is that of a rack (rho_f) or a fillet")
        held = f"support holds the rim of an internal gear, with z < 0, got {gear.support} of z = {gear.z}"
        require(not gear.support, f"{held}; an external gear is clamped at d_bore")
        return
    rim = f"d_rim must be given, the outer diameter of an internal gear where its rim is clamped, got z = {gear.z}"
    require(gear.d_rim is not None, f"{rim} without it")
    bore = f"d_bore belongs to external gears, got d_bore = {gear.d_bore} of z = {gear.z}"
    require(gear.d_bore is None, f"{bore}; pass d_rim, where the rim of the internal gear is clamped")
    rack = f"rho_f is the tip radius of a rack, which cannot cut the internal gear of z = {gear.z}, got {gear.rho_f}"
    require(gear.rho_f is None, f"{rack}; pass cutter=fem.PinionCutter(...) or a fillet")
    twice = f"give a fillet or a cutter, not both: got {gear.fillet} and {gear.cutter}"
    require(gear.fillet is None or gear.cutter is None, twice)


def check_thickness(gear) -> None:
    """Require a tooth thickness between nothing and a whole pitch."""
    thinnest = 2 * gear.x * gear.m_n * tan(gear.alpha_n)
    thick = f"mm (between nothing and a whole pitch on the circle shifted by x = {gear.x:.4g} modules)"
    require_within("s_n", gear.s_n, thinnest, thinnest + pi * gear.m_n, unit=mm, remedy=thick)


def check_sizes(gear) -> None:
    """Require a face width, a tooth thickness and diameters that fit one another; those of a ring are < 0."""
    m_n, shifted = gear.m_n, f"circle shifted by x = {gear.x:.4g} modules"
    middle = 2 * gear.r + 2 * gear.x * m_n
    require_within("b", gear.b, 0.1 * m_n, 200 * m_n, unit=mm, remedy="mm (pass metres: 23*mm)")
    check_thickness(gear)
    if gear.internal:
        inside = (
            f"the tip circle of an internal gear must lie outside its base circle, d_b = {2 * gear.r_b / mm:.6g} mm"
        )
        shorter = "shorten its teeth by d_a, reduce x, or raise the number of teeth"
        require(gear.d_a < 2 * gear.r_b * (1 + 1e-9), f"{inside}, got d_a = {gear.d_a / mm:.6g} mm; {shorter}")
        lowest_tip, tip, side = middle - 8 * m_n, "", "outside"
        body, d_body, lowest_body = "d_rim", gear.d_rim, 10 * gear.d_f
    else:
        lowest_tip, tip, side = 2 * gear.r_b, "above the base circle, ", "below"
        body, d_body, lowest_body = "d_bore", gear.d_bore, 0.0
    near = f"within 4 modules of the {shifted}"
    require_within("d_a", gear.d_a, lowest_tip, middle + 8 * m_n, unit=mm, remedy=f"mm ({tip}{near})")
    root = f"mm ({side} the tip circle d_a = {gear.d_a / mm:g} mm, {near})"
    require_within("d_f", gear.d_f, middle - 8 * m_n, gear.d_a, unit=mm, remedy=root)
    rim = f"mm (leave a rim of one module {side} the root circle {gear.d_f / mm:g} mm)"
    require_within(body, d_body, lowest_body, gear.d_f - 2 * m_n, unit=mm, remedy=rim)


def check_tip(gear) -> None:
    """Require a tooth thickness at the tip."""
    s_a = gear.thickness(gear.r_a)
    tip = f"tip thickness {s_a / mm:.3g} mm at d_a = {gear.d_a / mm:g} mm"
    require(s_a > 0, f"teeth are pointed: {tip}; reduce d_a or x = {gear.x:.4g} modules")


def check_root(gear) -> None:
    """Require a rack, a cutter or a fillet that fits between the teeth and leaves a thick root and an involute."""
    if gear.cutter is not None:
        check_generation(gear)
    if gear.rho_f is not None:
        largest = largest_rack_radius(gear)
        deep = f"d_f = {gear.d_f / mm:g} mm is too deep for s_n = {gear.s_n / mm:.4g} mm (x = {gear.x:.4g})"
        require(largest > 0, f"{deep}: the generating rack's flanks meet above it; raise d_f or reduce x")
        fits = "mm, the roundest tip that fits between the flanks of the generating rack in its normal section"
        require_within("rho_f", gear.rho_f, 0, largest * (1 + 1e-9), unit=mm, remedy=fits)
    if gear.fillet is not None:
        require_within("fillet", gear.fillet, 0, 4 * gear.m_n, unit=mm, remedy="mm (pass metres: 1*mm)")
        remedy = "reduce it or |d_f|" if gear.internal else "reduce it or x, or raise d_f"
        fits = f"fillet {gear.fillet / mm:g} mm does not fit between two teeth; {remedy}"
        require(gear.sign * gear.root.psi_f <= gear.sign * pi / gear.z * (1 + gear.sign * 1e-9), fits)
    root_thickness = 2 * min(r * psi for r, psi in zip(*gear.root.points(np.linspace(0, 1, 33)), strict=True))
    thin = f"z = {gear.z}, x = {gear.x:.4g} leave teeth {root_thickness / mm:.3g} mm thick at the root"
    require(root_thickness > 0.1 * gear.m_n, f"{thin}; the generating rack undercuts them: raise x, z, rho_f or d_f")
    between = (
        f"no involute between root form circle {2 * gear.r_form / mm:g} mm and tip circle d_a = {gear.d_a / mm:g} mm"
    )
    remedy = (
        "reduce |d_a|, or the fillet or rho_a0 of the cutter"
        if gear.internal
        else "raise d_a, or reduce rho_f or the fillet"
    )
    require(gear.r_a > gear.r_form, f"{between}; {remedy}")


def largest_fillet(gear) -> float:
    """Radius [m] of the circular fillet that leaves no root land of an internal gear, by bisection."""
    low, high = 0.0, abs(gear.r_f) - abs(gear.r_b)
    for _ in range(60):
        middle = (low + high) / 2
        psi_f = gear.psi_b + middle / gear.r_b - involute(acos(min(1.0, gear.r_b / (gear.r_f + middle))))
        low, high = (middle, high) if psi_f > pi / gear.z else (low, middle)
    return low


def largest_rack_radius(gear) -> float:
    """Tip radius of a rack without a tip land, in the normal section [m]; <= 0 where its flanks meet above d_f."""
    land = gear.m_n * pi - gear.s_n - 2 * gear.h_rack * tan(gear.alpha_n)
    return land / 2 * cos(gear.alpha_n) / (1 - sin(gear.alpha_n))
