"""Macro-geometry of an involute cylindrical gear, external or internal (ISO 21771); one that cannot exist is refused.

Number of teeth, radii, diameters and roll lengths of an internal gear are < 0: with these signs the formulas of
external gears hold for it too.
"""

from dataclasses import InitVar, dataclass, field
from functools import cached_property
from math import acos, asin, atan, copysign, cos, hypot, inf, pi, sin, sqrt, tan

from fem.gear import limits, pinion_cutter
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
        limits.check_rack(self)
        self._fill_defaults(None if h_fP is None else number("h_fP", h_fP))
        limits.check_sizes(self)
        limits.check_tip(self)
        limits.check_root(self)
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
        limits.check_body_and_tools(self)
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
            self._fill("fillet", min(RING_FILLET * self.m_n, ROUNDEST * limits.largest_fillet(self)))
        if self.fillet is None and not self.internal:
            largest = limits.largest_rack_radius(self)
            self._fill("rho_f", min(0.38 * self.m_n, largest) if largest > 0 else 0.38 * self.m_n)
        if not isinstance(self.flank, Sides):
            set_fields(self, flank=flanks.parts_of(self.flank))

    def _fill_root_by_cutter(self, cutter: PinionCutter, h_fP: float | None) -> None:
        """Root diameter of an internal gear whose cutter has a given tip diameter; it must not have another one."""
        if cutter.d_a0 is None:
            return
        require(h_fP is None, f"give d_a0 of the cutter or h_fP, not both: got {cutter.d_a0} and {h_fP}")
        limits.check_thickness(self)
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
