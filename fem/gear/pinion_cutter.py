"""Generation of an internal gear by a pinion-type cutter: its root is the trochoid of the cutter's rounded tip.

Radii and angles have the signs of `fem.gear.gear`: those of the internal gear, and the distance of the axes, are < 0.
"""

from dataclasses import dataclass
from functools import cached_property
from math import acos, copysign, cos, pi, sin, sqrt, tan

import numpy as np

from fem.gear.involute import inverse_involute, involute
from fem.support.arguments import DERIVED
from fem.support.representation import short
from fem.support.validation import as_floats, number, require, require_within, set_fields
from fem.units import mm

#: Default radius of the tip rounding [modules], and share of the largest one that it keeps.
ROUNDING, ROUNDEST = 0.3, 0.95


@short(rho_a0="mm", d_a0="mm")
@dataclass(frozen=True)
class PinionCutter:
    """Pinion-type cutter that generates an internal gear (symbols of ISO 21771; index 0: the tool).

    z_0         number of teeth
    x_0         profile shift coefficient, which falls as the cutter is sharpened
    rho_a0      radius of the tip rounding in the transverse section [m]; by default 0.3 m_n, or 0.95 of the largest one
    d_a0        tip diameter [m], from which the root diameter of the gear follows; by default from `d_f` of the gear

    Raises ValueError for values out of range.
    """

    z_0: int
    x_0: float = 0.0
    rho_a0: float = DERIVED
    d_a0: float = DERIVED

    def __post_init__(self):
        as_floats(self)
        z_0 = number("z_0", self.z_0)
        require(5 <= z_0 < 1e4 and z_0 % 1 == 0, f"z_0 must be a whole number of teeth, at least 5, got {self.z_0}")
        set_fields(self, z_0=int(z_0))
        require_within("x_0", self.x_0, -2, 2, remedy="(profile shift in modules)")
        for name, largest in (("rho_a0", 100 * mm), ("d_a0", 10.0)):
            if getattr(self, name) is not None:
                require_within(name, getattr(self, name), 0, largest, unit=mm, remedy="mm (pass metres: 6*mm)")


def psi_b0(gear) -> float:
    """Half angle of the tooth of a gear's cutter at its base circle [rad]; gear: a `fem.Gear`."""
    s_t0 = gear.m_n * (pi / 2 + 2 * gear.cutter.x_0 * tan(gear.alpha_n)) / cos(gear.beta)
    return float(s_t0 / (gear.cutter.z_0 * gear.m_t) + involute(gear.alpha_t))


def rounding(gear) -> float:
    """Radius of the tip rounding of a gear's cutter [m]; gear: a `fem.Gear`."""
    if gear.cutter.rho_a0 is not None:
        return gear.cutter.rho_a0
    return min(ROUNDING * gear.m_n, ROUNDEST * gear.generation.largest_rounding(gear.r_f))


@dataclass(frozen=True)
class Generation:
    """An internal gear and its cutter while the last cut is taken, without backlash, in the transverse section.

    z, r, alpha_t   number of teeth, reference radius [m], transverse pressure angle [rad] of the gear
    psi_b           half angle of its tooth at its base circle [rad]
    z_0, psi_b0     number of teeth and that half angle of the cutter
    """

    z: int
    r: float
    alpha_t: float
    psi_b: float
    z_0: int
    psi_b0: float

    @property
    def r_b0(self) -> float:
        """Base radius of the cutter [m]."""
        return self.r * cos(self.alpha_t) * self.z_0 / self.z

    @property
    def involute_w0(self) -> float:
        """inv(alpha_w0) of the pressure angle of generation; < 0: the cutter does not fit into the gear."""
        return (self.z_0 * self.psi_b0 + self.z * self.psi_b - pi) / (self.z_0 + self.z)

    @cached_property
    def alpha_w0(self) -> float:
        """Pressure angle of generation [rad]."""
        return inverse_involute(max(0.0, self.involute_w0))

    @property
    def a_0(self) -> float:
        """Distance of the axes [m]."""
        return self.r * cos(self.alpha_t) * (1 + self.z_0 / self.z) / cos(self.alpha_w0)

    @property
    def length(self) -> float:
        """Length of the line of action between the base circles [m]."""
        return self.a_0 * sin(self.alpha_w0)

    def half_tip(self, r_f: float, rho: float) -> float:
        """Angle [rad] between the middle of the cutter's tooth and the centre of its rounding; < 0: too large a rho."""
        r_c0 = self.a_0 - r_f - rho
        return float(self.psi_b0 - rho / self.r_b0 - involute(acos(min(1.0, self.r_b0 / r_c0))))

    def largest_rounding(self, r_f: float) -> float:
        """Radius of the rounding of a cutter without tip land [m], by bisection; 0 where its tip is pointed."""
        low, high = 0.0, self.a_0 - r_f - self.r_b0 / cos(self.alpha_w0)
        if self.half_tip(r_f, low) <= 0 or high <= 0:
            return 0.0
        for _ in range(60):
            middle = (low + high) / 2
            low, high = (middle, high) if self.half_tip(r_f, middle) > 0 else (low, middle)
        return low


@dataclass(frozen=True)
class CutterTrochoid:
    """Root of an internal gear that a cutter leaves, in the transverse section; interface as in `fem.gear.tooth_root`.

    r_f         root radius of the gear [m]
    rho         radius of the cutter's tip rounding [m]

    The normal of the root at each point passes through the pitch point of the generation, and through the centre of the
    rounding.
    """

    generation: Generation
    r_f: float
    rho: float

    @property
    def r_c0(self) -> float:
        """Distance of the centre of the rounding from the cutter's centre [m]."""
        return self.generation.a_0 - self.r_f - self.rho

    @property
    def r_w0(self) -> float:
        """Pitch radius of the cutter in the generation [m]."""
        return self.generation.r_b0 / cos(self.generation.alpha_w0)

    @property
    def half_tip(self) -> float:
        """Angle between the middle of the cutter's tooth and the centre of its rounding [rad]."""
        return self.generation.half_tip(self.r_f, self.rho)

    @cached_property
    def roll_form(self) -> float:
        """Roll length of the gear where the cutter's rounding begins [m]."""
        cutter = sqrt(max(0.0, self.r_c0**2 - self.generation.r_b0**2)) + self.rho
        return self.generation.length - cutter

    @property
    def psi_f(self) -> float:
        """Angle where the root circle begins [rad]."""
        return pi / self.generation.z - self.half_tip * self.generation.z_0 / self.generation.z

    def points(self, share) -> tuple[np.ndarray, np.ndarray]:
        """r [m] and psi [rad] at shares (n,) of the turn of the normal."""
        at, (r_w0, r_c0) = self.generation, (self.r_w0, self.r_c0)
        normal = (1 - np.asarray(share, float)) * (pi / 2 - at.alpha_w0)
        from_pitch = np.sqrt(r_c0**2 - (r_w0 * np.sin(normal)) ** 2) - r_w0 * np.cos(normal)
        centre = r_w0 + from_pitch * np.exp(1j * normal)
        turn = (np.angle(centre) - self.half_tip) * at.z_0 / at.z
        point = centre - at.a_0 + self.rho * np.exp(1j * normal)
        return copysign(1, at.z) * np.abs(point), pi / at.z + np.angle(point) + turn


def check_generation(gear) -> None:
    """Require a cutter that fits into the gear, and generates its involute up to the tip; gear: a `fem.Gear`."""
    cutter, at = gear.cutter, gear.generation
    require(cutter.z_0 < -gear.z, f"z_0 of the cutter must be less than {-gear.z} teeth, got {cutter.z_0}")
    fits = f"the cutter of z_0 = {cutter.z_0}, x_0 = {cutter.x_0:g} does not fit into the gear of x = {gear.x:.4g}"
    require(at.involute_w0 > 0, f"{fits}; reduce z_0, x_0 or x")
    r_a0, deeper = at.a_0 - gear.r_f, "raise |d_f|, or reduce x or x_0"
    short_tip = f"d_f = {gear.d_f / mm:.6g} mm leaves the cutter d_a0 = {2 * r_a0 / mm:.6g} mm, below its pitch circle"
    require(r_a0 > at.r_b0 / cos(at.alpha_w0), f"{short_tip}; {deeper}")
    largest, rho = at.largest_rounding(gear.r_f), rounding(gear)
    require(largest > 0, f"the cutter of d_a0 = {2 * r_a0 / mm:.6g} mm has pointed teeth; reduce |d_f| or x_0")
    fits = "mm, the roundest tip that fits on the cutter"
    require_within("rho_a0", rho, 0, largest * (1 + 1e-9), unit=mm, remedy=fits)
    beyond = f"the cutter generates no involute at the tip of the gear, d_a = {gear.d_a / mm:.6g} mm"
    require(at.length - gear.roll_tip >= 0, f"{beyond}; raise |d_a| or z_0, or reduce x")
