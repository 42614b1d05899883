"""Macro-geometry of one external involute cylindrical gear (ISO 21771), checked when born."""

from dataclasses import InitVar, dataclass, field
from functools import cached_property
from math import acos, asin, atan, cos, hypot, inf, pi, sin, sqrt, tan

import numpy as np

from fem.gear.data_sheet import GEAR, DataSheet, listed
from fem.gear.inspection import Teeth, measures
from fem.gear.involute import involute
from fem.gear.material import STEEL, Material
from fem.gear.tooth_root import Arc, Trochoid
from fem.microgeometry import flank as flanks
from fem.microgeometry.flank import Flank, Sides
from fem.microgeometry.modification import FlankExtent
from fem.support.representation import short
from fem.support.validation import as_floats, number, require, require_within
from fem.units import deg, mm


@short(**dict.fromkeys(("m_n", "b", "d_bore", "s_n", "d_a", "d_f", "rho_f", "fillet"), "mm"), alpha_n="deg", beta="deg")
@dataclass(frozen=True, kw_only=True)
class Gear:
    """One external involute gear; lengths in metres, angles in radians (ISO 21771 symbols).

    z           number of teeth
    m_n         normal module
    b           face width
    d_bore      diameter where the body is clamped: the bore on a stiff shaft, or the inside of the rim on a web
    alpha_n     normal pressure angle
    beta        helix angle at the reference circle, > 0 right-hand
    x           profile shift coefficient, as far as pointed teeth and undercut let it; by default the one that gives
                s_n, or 0
    s_n         normal circular tooth thickness at the reference circle; by default the one that x gives
    d_a, d_f    tip and root diameter; by default m_n (1 + x) above and h_fP - x m_n below the reference circle
    h_fP        addendum of the generating rack as input instead of d_f; by default 1.25 m_n (ISO 53, profile A)
    rho_f       tip radius rho_fP of the generating rack in its normal section (ISO 53), which leaves the fillet; by
                default 0.38 m_n or what fits
    fillet      radius of a circular root fillet in the transverse section, instead of the rack's trochoid
    flank       modifications of the flanks (`fem.microgeometry`), which add up: the same on both sides, or `fem.Sides`

    Raises ValueError where no such gear exists: unit slips, pointed teeth, nothing left by undercut, fillets too round.
    """

    z: int
    m_n: float
    b: float
    d_bore: float
    alpha_n: float = 20 * deg
    beta: float = 0.0
    x: float = None  # type: ignore[assignment]
    s_n: float = None  # type: ignore[assignment]
    d_a: float = None  # type: ignore[assignment]
    d_f: float = None  # type: ignore[assignment]
    h_fP: InitVar[float | None] = None
    rho_f: float | None = None
    fillet: float | None = None
    material: Material = field(default=STEEL)
    flank: Flank | Sides = ()

    def __post_init__(self, h_fP: float | None):
        as_floats(self)
        self._check_teeth_and_material()
        require_within("m_n", self.m_n, 0, 100 * mm, unit=mm, remedy="mm (pass metres: 2.6*mm)")
        require_within("alpha_n", self.alpha_n, 10 * deg, 35 * deg, unit=deg, remedy="deg (pass radians: 20*deg)")
        require_within("beta", self.beta, -45 * deg, 45 * deg, unit=deg, remedy="deg (pass radians: 15*deg)")
        self._fill_defaults(None if h_fP is None else number("h_fP", h_fP))
        self._check_widths()
        self._check_tip()
        self._check_root()
        require(self.r_a > self.r_form, f"no involute between root form and tip circle d_a = {self.d_a / mm:g} mm")
        for side in (self.drive_flank, self.coast_flank):
            flanks.check(side, self.face)

    def _check_teeth_and_material(self) -> None:
        z, steel = number("z", self.z), "material must be a fem.Material, say fem.Material(E=210*GPa)"
        require(5 <= z < 1e4 and z == int(z), f"z must be a whole number of teeth, at least 5, got {self.z}")
        object.__setattr__(self, "z", int(z))
        require(isinstance(self.material, Material), f"{steel}, got {self.material!r}")

    def _fill(self, name: str, value) -> None:
        if getattr(self, name) is None:
            object.__setattr__(self, name, value)

    def _fill_defaults(self, h_fP: float | None) -> None:
        if self.x is None:
            object.__setattr__(self, "x", self._shift())
        shift = "(profile shift in modules, less than the reference radius; for one in metres divide by m_n)"
        require_within("x", self.x, -self.z / 2, self.z / 2, remedy=shift)
        self._fill("s_n", self.m_n * (pi / 2 + 2 * self.x * tan(self.alpha_n)))
        self._fill("d_a", 2 * self.r + 2 * self.m_n * (1 + self.x))
        require(h_fP is None or self.d_f is None, f"give h_fP or d_f, not both: got {h_fP} and {self.d_f}")
        if h_fP is not None:
            require_within("h_fP", h_fP, 0, 4 * self.m_n, unit=mm, remedy="mm (pass metres: 1.25*m_n)")
        self._fill("d_f", 2 * self.r - 2 * ((1.25 * self.m_n if h_fP is None else h_fP) - self.x * self.m_n))
        require(self.rho_f is None or self.fillet is None, "give rho_f of the rack or a fillet, not both")
        if self.fillet is None:
            roundest = self._roundest_rack_tip
            self._fill("rho_f", min(0.38 * self.m_n, roundest) if roundest > 0 else 0.38 * self.m_n)
        if not isinstance(self.flank, Sides):
            object.__setattr__(self, "flank", flanks.parts_of(self.flank))

    def _shift(self) -> float:
        """Profile shift coefficient that gives s_n."""
        if self.s_n is None:
            return 0.0
        pitch = pi * self.m_n
        require_within("s_n", self.s_n, 0, 2 * pitch, unit=mm, remedy="mm (two pitches; pass metres: 3.78*mm)")
        return (self.s_n / self.m_n - pi / 2) / (2 * tan(self.alpha_n))

    def _check_widths(self) -> None:
        m_n, shifted = self.m_n, f"circle shifted by x = {self.x:.4g} modules"
        none, middle = 2 * self.x * m_n * tan(self.alpha_n), 2 * self.r + 2 * self.x * m_n
        require_within("b", self.b, 0.1 * m_n, 200 * m_n, unit=mm, remedy="mm (pass metres: 23*mm)")
        thick = f"mm (between nothing and a whole pitch on the {shifted})"
        require_within("s_n", self.s_n, none, none + pi * m_n, unit=mm, remedy=thick)
        tip = f"mm (above the base circle, within 4 modules of the {shifted})"
        require_within("d_a", self.d_a, 2 * self.r_b, middle + 8 * m_n, unit=mm, remedy=tip)
        root = f"mm (below the tip circle, within 4 modules of the {shifted})"
        require_within("d_f", self.d_f, middle - 8 * m_n, self.d_a, unit=mm, remedy=root)
        rim = f"mm (leave a rim of one module below the root circle {self.d_f / mm:g} mm)"
        require_within("d_bore", self.d_bore, 0, self.d_f - 2 * m_n, unit=mm, remedy=rim)

    def _check_tip(self) -> None:
        s_a = self.thickness(self.r_a)
        tip = f"tip thickness {s_a / mm:.3g} mm at d_a = {self.d_a / mm:g} mm"
        require(s_a > 0, f"teeth are pointed: {tip}; reduce d_a or x = {self.x:.4g} modules")

    @property
    def _roundest_rack_tip(self) -> float:
        """Tip radius of a rack without a land, in the normal section [m]; <= 0 where its flanks meet above that."""
        floor = self.m_n * pi - self.s_n - 2 * self.h_rack * tan(self.alpha_n)
        return floor / 2 * cos(self.alpha_n) / (1 - sin(self.alpha_n))

    def _check_root(self) -> None:
        if self.rho_f is not None:
            largest = self._roundest_rack_tip
            deep = f"d_f = {self.d_f / mm:g} mm is too deep for s_n = {self.s_n / mm:.4g} mm (x = {self.x:.4g})"
            require(largest > 0, f"{deep}: the generating rack's flanks meet above it; raise d_f or reduce x")
            fits = "mm, the roundest tip that fits between the flanks of the generating rack in its normal section"
            require_within("rho_f", self.rho_f, 0, largest * (1 + 1e-9), unit=mm, remedy=fits)
        if self.fillet is not None:
            require_within("fillet", self.fillet, 0, 4 * self.m_n, unit=mm, remedy="mm (pass metres: 1*mm)")
            fits = f"fillet {self.fillet / mm:g} mm does not fit between two teeth; reduce it or x, or raise d_f"
            require(self.root.psi_f <= pi / self.z * (1 + 1e-9), fits)
        waist = 2 * min(r * psi for r, psi in zip(*self.root.points(np.linspace(0, 1, 33)), strict=True))
        thin = f"z = {self.z}, x = {self.x:.4g} leave teeth {waist / mm:.3g} mm thick at the root"
        require(waist > 0.1 * self.m_n, f"{thin}; the generating rack undercuts them: raise x, z, rho_f or d_f")

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
        return tan(self.beta) / self.r

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
    def root(self) -> Trochoid | Arc:
        """Outline between involute and root circle."""
        if self.fillet is not None:
            return Arc(self.r_b, self.r_f, self.psi_b, self.fillet)
        rack = self.alpha_t, self.beta, self.psi_b, self.h_rack, self.rho_f
        return Trochoid(self.z, self.r, *rack)  # type: ignore[arg-type]

    @property
    def undercut(self) -> bool:
        """Whether the generating rack cuts the involute off above the base circle."""
        return isinstance(self.root, Trochoid) and self.root.undercuts

    @cached_property
    def roll_tip(self) -> float:
        """Roll length (radius of curvature) at the tip [m]."""
        return sqrt(self.r_a**2 - self.r_b**2)

    @property
    def roll_form(self) -> float:
        """Roll length where the root begins [m]."""
        return self.root.roll_form

    @property
    def r_form(self) -> float:
        """Root form radius r_Ff [m]."""
        return hypot(self.r_b, self.roll_form)

    @cached_property
    def face(self) -> FlankExtent:
        """Extent of a flank."""
        return FlankExtent(self.roll_form, self.roll_tip, self.b, self.r_b, self.z, land=self.thickness(self.r_a))

    def thickness(self, r: float) -> float:
        """Transverse tooth thickness on the circle of radius r >= r_b [m]; ValueError for others."""
        if not self.r_b <= number("r", r) < inf:
            raise ValueError(f"r must be at least the base radius {self.r_b / mm:.6g} mm, got {r / mm:.6g} mm")
        return 2 * r * float(self.psi_b - involute(acos(self.r_b / r)))

    def data_sheet(self, *, k: int | None = None, D_M: float | None = None) -> DataSheet:
        """Quantities of ISO 21771 by symbol, in SI units; print it for a table in mm and degrees.

        k       number of teeth in the span measurement
        D_M     diameter of balls that lie in opposite spaces [m]

        By default span and balls touch near the diameter d + 2 x m_n, and are left out where none measure.
        Raises ValueError for k and D_M that miss the flanks.
        """
        r, beta_a = self.r, atan(self.twist * self.r_a)
        teeth = Teeth(self.z, self.r_b, self.psi_b, self.beta_b, self.b, self.r_f, (self.roll_form, self.roll_tip))
        sizes = {
            "d": 2 * r,
            "d_b": 2 * self.r_b,
            "d_Ff": 2 * self.r_form,
            "h": self.r_a - self.r_f,
            "p_bn": teeth.p_bn,
            "s_an": self.thickness(self.r_a) * cos(beta_a),
            "s_bn": teeth.s_bn,
        }
        return DataSheet(repr(self), listed(GEAR, self, sizes) + measures(teeth, k, D_M, r + self.x * self.m_n))
