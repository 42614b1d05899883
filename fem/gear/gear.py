"""Macro-geometry of an involute cylindrical gear, external or internal (ISO 21771); one that cannot exist is refused.

Number of teeth, radii, diameters and roll lengths of an internal gear are < 0: with these signs the formulas of
external gears hold for it too.
"""

from dataclasses import InitVar, dataclass, field
from functools import cached_property
from math import acos, asin, atan, copysign, cos, hypot, inf, pi, sin, sqrt, tan

import numpy as np

from fem.gear import pinion_cutter
from fem.gear.data_sheet import GEAR, RING, DataSheet, listed
from fem.gear.inspection import Teeth, measures
from fem.gear.involute import involute
from fem.gear.material import STEEL, Inertia, Material, cylinder
from fem.gear.pinion_cutter import CutterTrochoid, Generation, PinionCutter
from fem.gear.rim_support import Support, check_supports, supports_of
from fem.gear.tooth_root import Arc, Trochoid
from fem.microgeometry import flank as flanks
from fem.microgeometry.flank import Flank, Sides
from fem.microgeometry.modification import FlankExtent
from fem.support.arguments import DERIVED
from fem.support.plausibility import check_module
from fem.support.representation import short
from fem.support.validation import as_floats, number, require, require_within, set_fields
from fem.units import deg, mm

LENGTHS = "m_n", "b", "d_bore", "d_rim", "s_n", "d_a", "d_f", "rho_f", "fillet"
#: Radius of the default fillet of an internal gear [modules], and share of the largest one that it keeps.
RING_FILLET, ROUNDEST = 0.3, 0.95


@short(**dict.fromkeys(LENGTHS, "mm"), alpha_n="deg", beta="deg")
@dataclass(frozen=True, kw_only=True)
class Gear:
    """Involute gear; lengths in metres, angles in radians (symbols of ISO 21771).

    z           number of teeth; < 0 of an internal gear, a ring, whose diameters are < 0 too: they are accepted with
                either sign and kept with that of z
    m_n         normal module
    b           face width
    d_bore      diameter where the body of an external gear is clamped: the bore on a stiff shaft, or the inside of the
                rim on a web
    d_rim       outer diameter of the rim of an internal gear, where it is clamped, or held by its support
    support     of the rim: `fem.Bolts`, `fem.Bush`, or several of them; by default it is clamped
    alpha_n     normal pressure angle
    beta        helix angle at the reference circle, > 0 right-hand, also of an internal gear
    x           profile shift coefficient, limited above by pointed teeth, below by undercut; by default from s_n, or 0;
                > 0 makes the teeth of an internal gear thicker, too, and moves them towards its centre
    s_n         normal circular tooth thickness at the reference circle; by default from x
    d_a, d_f    tip and root diameter; by default m_n (1 + x) above and h_fP - x m_n below the reference circle
    h_fP        dedendum of the basic rack, the tool's addendum, instead of d_f; by default 1.25 m_n (ISO 53, profile A)
    rho_f       tip radius of the generating rack in its normal section, rho_fP of ISO 53, which generates the fillet;
                by default 0.38 m_n, or the largest that fits between the flanks of the rack
    fillet      radius of a circular root fillet in the transverse section, instead of the rack's trochoid; the default
                root of an internal gear, 0.3 m_n, or 0.95 of the largest that fits
    cutter      `fem.PinionCutter` that generates an internal gear, instead of a fillet
    material    of the body; by default steel
    flank       modifications of the flanks (`fem.microgeometry`), which add up: the same on both sides, or `fem.Sides`

    Raises ValueError where no such gear exists, for example for a value in millimetres or degrees, pointed teeth, teeth
    weakened too much by undercut, and fillets that do not fit between the teeth.
    """

    z: int
    m_n: float
    b: float
    d_bore: float = DERIVED
    d_rim: float = DERIVED
    alpha_n: float = 20 * deg
    beta: float = 0.0
    x: float = DERIVED
    s_n: float = DERIVED
    d_a: float = DERIVED
    d_f: float = DERIVED
    h_fP: InitVar[float | None] = None
    rho_f: float | None = None
    fillet: float | None = None
    cutter: PinionCutter | None = None
    material: Material = field(default=STEEL)
    flank: Flank | Sides = ()
    support: tuple[Support, ...] = ()

    def __post_init__(self, h_fP: float | None):
        as_floats(self)
        self._check_teeth_and_material()
        _check_rack(self)
        self._fill_defaults(None if h_fP is None else number("h_fP", h_fP))
        _check_sizes(self)
        _check_tip(self)
        _check_root(self)
        if self.support:
            check_supports(self.support, abs(self.r_clamp))
        for side in (self.drive_flank, self.coast_flank):
            flanks.check(side, self.face)

    def _check_teeth_and_material(self) -> None:
        z, steel = number("z", self.z), "material must be a fem.Material, say fem.Material(E=210*GPa)"
        whole = "z must be a whole number of teeth, at least 5, or at most -5 for an internal gear"
        require(5 <= abs(z) < 1e4 and z == int(z), f"{whole}, got {self.z}")
        set_fields(self, z=int(z))
        require(isinstance(self.material, Material), f"{steel}, got {self.material!r}")
        set_fields(self, support=supports_of(self.support))
        _check_body_and_tools(self)
        for name in ("d_rim", "d_a", "d_f") if self.internal else ():
            if getattr(self, name) is not None:
                set_fields(self, **{name: -abs(getattr(self, name))})

    def _fill_defaults(self, h_fP: float | None) -> None:
        """Set the fields that were left out, in the order in which they follow from one another."""
        self._fill("x", self._shift())
        shift = "(profile shift in modules, less than the reference radius; for one in metres divide by m_n)"
        require_within("x", self.x, -abs(self.z) / 2, abs(self.z) / 2, remedy=shift)
        self._fill("s_n", self.m_n * (pi / 2 + 2 * self.x * tan(self.alpha_n)))
        self._fill("d_a", 2 * self.r + 2 * self.m_n * (1 + self.x))
        require(h_fP is None or self.d_f is None, f"give h_fP or d_f, not both: got {h_fP} and {self.d_f}")
        if h_fP is not None:
            require_within("h_fP", h_fP, 0, 4 * self.m_n, unit=mm, remedy="mm (pass metres: 1.25*m_n)")
        if self.cutter is not None:
            self._fill_root_by_cutter(self.cutter, h_fP)
        self._fill("d_f", 2 * self.r - 2 * ((1.25 * self.m_n if h_fP is None else h_fP) - self.x * self.m_n))
        twice = f"give rho_f of the rack or a fillet, not both: got {self.rho_f} and {self.fillet}"
        require(self.rho_f is None or self.fillet is None, twice)
        if self.internal and self.cutter is None:
            self._fill("fillet", min(RING_FILLET * self.m_n, ROUNDEST * _largest_fillet(self)))
        if self.fillet is None and not self.internal:
            largest = _largest_rack_radius(self)
            self._fill("rho_f", min(0.38 * self.m_n, largest) if largest > 0 else 0.38 * self.m_n)
        if not isinstance(self.flank, Sides):
            set_fields(self, flank=flanks.parts_of(self.flank))

    def _fill_root_by_cutter(self, cutter: PinionCutter, h_fP: float | None) -> None:
        """Root diameter of an internal gear whose cutter has a given tip diameter; it must not have another one."""
        if cutter.d_a0 is None:
            return
        require(h_fP is None, f"give d_a0 of the cutter or h_fP, not both: got {cutter.d_a0} and {h_fP}")
        _check_thickness(self)
        d_f = 2 * self.generation.a_0 - cutter.d_a0
        self._fill("d_f", d_f)
        cut = f"the cutter of d_a0 = {cutter.d_a0 / mm:.6g} mm cuts d_f = {d_f / mm:.6g} mm, got {self.d_f / mm:.6g} mm"
        require(abs(self.d_f - d_f) < 1e-4 * self.m_n, f"{cut}; leave out d_f or d_a0")

    def _fill(self, name: str, value) -> None:
        """Set a field that was left out."""
        if getattr(self, name) is None:
            set_fields(self, **{name: value})

    def _shift(self) -> float:
        """Default of x: the profile shift coefficient that gives s_n, or 0."""
        if self.x is not None or self.s_n is None:
            return 0.0
        pitch = pi * self.m_n
        require_within("s_n", self.s_n, 0, 2 * pitch, unit=mm, remedy="mm (two pitches; pass metres: 3.78*mm)")
        return (self.s_n / self.m_n - pi / 2) / (2 * tan(self.alpha_n))

    @property
    def internal(self) -> bool:
        """Whether the gear is a ring with internal teeth."""
        return self.z < 0

    @property
    def sign(self) -> int:
        """Sign of number of teeth, radii and roll lengths: -1 for an internal gear."""
        return -1 if self.internal else 1

    @property
    def drive_flank(self) -> Flank:
        """Modifications of the left flanks, which carry the load while the pinion drives counter-clockwise."""
        return self.flank.left if isinstance(self.flank, Sides) else self.flank

    @property
    def coast_flank(self) -> Flank:
        """Modifications of the right flanks."""
        return self.flank.right if isinstance(self.flank, Sides) else self.flank

    @cached_property
    def m_t(self) -> float:
        """Transverse module [m]."""
        return self.m_n / cos(self.beta)

    @cached_property
    def alpha_t(self) -> float:
        """Transverse pressure angle [rad]."""
        return atan(tan(self.alpha_n) / cos(self.beta))

    @cached_property
    def beta_b(self) -> float:
        """Base helix angle [rad]."""
        return asin(sin(self.beta) * cos(self.alpha_n))

    @property
    def twist(self) -> float:
        """Turn of the transverse section per length along the axis [1/m]."""
        return tan(self.beta) / abs(self.r)

    @cached_property
    def r(self) -> float:
        """Reference radius [m]."""
        return self.z * self.m_t / 2

    @cached_property
    def r_b(self) -> float:
        """Base radius [m]."""
        return self.r * cos(self.alpha_t)

    @property
    def r_a(self) -> float:
        """Tip radius [m]."""
        return self.d_a / 2

    @property
    def r_f(self) -> float:
        """Root radius [m]."""
        return self.d_f / 2

    @property
    def r_clamp(self) -> float:
        """Radius where the body is clamped [m]: of the bore, or of the outside of the rim."""
        return (self.d_rim if self.internal else self.d_bore) / 2

    @cached_property
    def p_bt(self) -> float:
        """Transverse base pitch [m]."""
        return 2 * pi * self.r_b / self.z

    @cached_property
    def s_t(self) -> float:
        """Transverse tooth thickness on the reference circle [m]."""
        return self.s_n / cos(self.beta)

    @property
    def h_rack(self) -> float:
        """Depth of the generating rack's tip below the reference circle [m]."""
        return self.r - self.r_f

    @cached_property
    def psi_b(self) -> float:
        """Half angle of the tooth at the base circle [rad]."""
        return float(self.s_t / (2 * self.r) + involute(self.alpha_t))

    @cached_property
    def generation(self) -> Generation:
        """Generation of an internal gear by its cutter."""
        teeth = self.z, self.r, self.alpha_t, self.psi_b
        return Generation(*teeth, self.cutter.z_0, pinion_cutter.psi_b0(self))  # type: ignore[union-attr]

    @cached_property
    def root(self) -> Trochoid | CutterTrochoid | Arc:
        """Curve between the involute and the root circle."""
        if self.cutter is not None:
            return CutterTrochoid(self.generation, self.r_f, pinion_cutter.rounding(self))
        if self.fillet is not None:
            return Arc(self.r_b, self.r_f, self.psi_b, self.fillet)
        rack = self.alpha_t, self.beta, self.psi_b, self.h_rack, self.rho_f
        return Trochoid(self.z, self.r, *rack)  # type: ignore[arg-type]

    @property
    def undercut(self) -> bool:
        """Whether the generating rack cuts the involute off above the base circle; no internal gear has undercut."""
        return isinstance(self.root, Trochoid) and self.root.undercuts

    @cached_property
    def roll_tip(self) -> float:
        """Roll length (radius of curvature of the involute) at the tip [m]."""
        return copysign(sqrt(self.r_a**2 - self.r_b**2), self.z)

    @property
    def roll_form(self) -> float:
        """Roll length at the root form circle, where the involute begins [m]."""
        return self.root.roll_form

    @property
    def r_form(self) -> float:
        """Root form radius r_Ff [m]."""
        return copysign(hypot(self.r_b, self.roll_form), self.z)

    @cached_property
    def face(self) -> FlankExtent:
        """Extent of a flank, on which modifications are defined."""
        land, slope = self.thickness(self.r_a), tan(self.beta_b)
        return FlankExtent(self.roll_form, self.roll_tip, self.b, self.r_b, self.z, land=land, slope=slope)

    @cached_property
    def _body(self) -> Inertia:
        """Disc of the material up to the mean of tip and root circle, or ring from there to the rim's outside."""
        teeth = abs(self.r_a + self.r_f)
        ends = (abs(self.d_rim), teeth) if self.internal else (teeth,)
        return cylinder(self.material.density, self.b, *ends)

    @property
    def mass(self) -> float:
        """Mass [kg] of a solid disc of the material up to the mean of tip and root circle: the shaft fills the bore.

        Of an internal gear that of the ring from there to `d_rim`.
        """
        return self._body.mass

    @property
    def inertia(self) -> float:
        """Inertia about the axis of the disc of `mass` [kg m^2]."""
        return self._body.inertia

    @property
    def transverse(self) -> float:
        """Inertia about transverse axes through the centre of the disc of `mass` [kg m^2]."""
        return self._body.transverse

    def thickness(self, r: float) -> float:
        """Transverse tooth thickness on the circle of radius r [m]; ValueError for r below the base radius.

        r       of an internal gear with either sign
        """
        size = abs(number("r", r)) if self.internal else number("r", r)
        if not abs(self.r_b) <= size < inf:
            raise ValueError(f"r must be at least the base radius {abs(self.r_b) / mm:.6g} mm, got {r / mm:.6g} mm")
        return 2 * size * self.sign * float(self.psi_b - involute(acos(abs(self.r_b) / size)))

    def data_sheet(self, *, k: int | None = None, D_M: float | None = None) -> DataSheet:
        """Quantities of ISO 21771 by symbol, in SI units; print it for a table in mm and degrees.

        k       number of teeth in the span measurement
        D_M     diameter of balls that lie in opposite spaces [m]

        By default the span and the balls touch near the diameter d + 2 x m_n, on which the chordal thickness is given;
        a measure that is not possible is left out. M_dK of an internal gear is measured between the balls; it has no
        span. Raises ValueError for k and D_M that miss the flanks.
        """
        r, beta_a = self.r, atan(self.twist * self.r_a)
        teeth = Teeth(self.z, self.r_b, self.psi_b, self.beta_b, self.b, self.r_f, (self.roll_form, self.roll_tip))
        r_y = r + self.x * self.m_n
        sizes = {
            "d": 2 * r,
            "d_b": 2 * self.r_b,
            "d_Ff": 2 * self.r_form,
            "h": self.r_a - self.r_f,
            "p_bn": teeth.p_bn,
            "s_an": self.thickness(self.r_a) * cos(beta_a),
            "s_bn": teeth.s_bn,
        }
        meanings = GEAR | RING if self.internal else GEAR
        rows = listed(meanings, self, sizes) + measures(teeth, k, D_M, r_y) + self._chordal_thickness(r_y)
        return DataSheet(repr(self), rows)

    def _chordal_thickness(self, r_y: float) -> list[tuple[str, float, str, str]]:
        """Rows of a data sheet with the chordal thickness on the circle of radius r_y [m], where it cuts the flanks.

        Those of the virtual spur gear in the normal section, of diameter d_y / cos^2 beta_y.
        """
        if not self.r_form < r_y < self.r_a:
            return []
        beta_y = atan(self.twist * r_y)
        r_yn = r_y / cos(beta_y) ** 2
        half = self.thickness(r_y) * cos(beta_y) / (2 * r_yn)
        height = self.r_a - r_y + r_yn * (1 - cos(half))
        meaning = "chordal tooth thickness on the diameter d + 2 x m_n"
        return [
            ("s_cn", 2 * r_yn * sin(half), "m", f"normal {meaning}"),
            ("h_ca", height, "m", "height of the tip above that chord"),
        ]


def _check_rack(gear: Gear) -> None:
    """Require a module and angles of a rack."""
    require_within("m_n", gear.m_n, 0, 100 * mm, unit=mm, remedy="mm (pass metres: 2.6*mm)")
    check_module(gear.m_n)
    require_within("alpha_n", gear.alpha_n, 10 * deg, 35 * deg, unit=deg, remedy="deg (pass radians: 20*deg)")
    require_within("beta", gear.beta, -45 * deg, 45 * deg, unit=deg, remedy="deg (pass radians: 15*deg)")


def _check_body_and_tools(gear: Gear) -> None:
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


def _check_thickness(gear: Gear) -> None:
    """Require a tooth thickness between nothing and a whole pitch."""
    thinnest = 2 * gear.x * gear.m_n * tan(gear.alpha_n)
    thick = f"mm (between nothing and a whole pitch on the circle shifted by x = {gear.x:.4g} modules)"
    require_within("s_n", gear.s_n, thinnest, thinnest + pi * gear.m_n, unit=mm, remedy=thick)


def _check_sizes(gear: Gear) -> None:
    """Require a face width, a tooth thickness and diameters that fit one another; those of a ring are < 0."""
    m_n, shifted = gear.m_n, f"circle shifted by x = {gear.x:.4g} modules"
    middle = 2 * gear.r + 2 * gear.x * m_n
    require_within("b", gear.b, 0.1 * m_n, 200 * m_n, unit=mm, remedy="mm (pass metres: 23*mm)")
    _check_thickness(gear)
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


def _check_tip(gear: Gear) -> None:
    """Require a tooth thickness at the tip."""
    s_a = gear.thickness(gear.r_a)
    tip = f"tip thickness {s_a / mm:.3g} mm at d_a = {gear.d_a / mm:g} mm"
    require(s_a > 0, f"teeth are pointed: {tip}; reduce d_a or x = {gear.x:.4g} modules")


def _check_root(gear: Gear) -> None:
    """Require a rack, a cutter or a fillet that fits between the teeth and leaves a thick root and an involute."""
    if gear.cutter is not None:
        pinion_cutter.check_generation(gear)
    if gear.rho_f is not None:
        largest = _largest_rack_radius(gear)
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


def _largest_fillet(gear: Gear) -> float:
    """Radius [m] of the circular fillet that leaves no root land of an internal gear, by bisection."""
    low, high = 0.0, abs(gear.r_f) - abs(gear.r_b)
    for _ in range(60):
        middle = (low + high) / 2
        psi_f = gear.psi_b + middle / gear.r_b - involute(acos(min(1.0, gear.r_b / (gear.r_f + middle))))
        low, high = (middle, high) if psi_f > pi / gear.z else (low, middle)
    return low


def _largest_rack_radius(gear: Gear) -> float:
    """Tip radius of a rack without a tip land, in the normal section [m]; <= 0 where its flanks meet above d_f."""
    land = gear.m_n * pi - gear.s_n - 2 * gear.h_rack * tan(gear.alpha_n)
    return land / 2 * cos(gear.alpha_n) / (1 - sin(gear.alpha_n))
