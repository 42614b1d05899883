"""Macro-geometry of involute cylindrical gears and of the pair they make (ISO 21771), checked when born."""

from dataclasses import dataclass, field
from math import acos, asin, atan, cos, pi, sin, sqrt, tan

from fem.flank import Face, Flank
from fem.units import GPa, deg, mm


def involute(alpha: float) -> float:
    """inv(alpha) = tan(alpha) - alpha."""
    return tan(alpha) - alpha


def require(condition: bool, message: str) -> None:
    """Raise ValueError(message) unless condition holds; NaN never holds."""
    if not condition:
        raise ValueError(message)


def require_within(name: str, value: float, low: float, high: float, *, unit: float = 1.0, remedy: str) -> None:
    """Require low < value < high; bounds and value are shown in multiples of unit."""
    low_, high_, value_ = low / unit, high / unit, value / unit
    require(low < value < high, f"{name} must lie in ({low_:g}, {high_:g}) {remedy}, got {value_:g}")


@dataclass(frozen=True)
class Material:
    """Isotropic linear elasticity: E [Pa], nu [1], density [kg/m^3]."""

    E: float = 210 * GPa
    nu: float = 0.3
    density: float = 7850.0

    def __post_init__(self):
        require_within("E", self.E, 0.01 * GPa, 2000 * GPa, unit=GPa, remedy="GPa (pass pascal)")
        require_within("nu", self.nu, -1.0, 0.5, remedy="(Poisson's ratio)")
        require_within("density", self.density, 1.0, 50e3, remedy="kg/m^3")


STEEL = Material()


@dataclass(frozen=True, kw_only=True)
class Gear:
    """One external involute gear; lengths in metres, angles in radians (ISO 21771 symbols).

    z           number of teeth
    m_n         normal module
    b           face width
    d_bore      diameter of the rigid hub: the body is clamped there
    alpha_n     normal pressure angle
    beta        helix angle at the reference circle, > 0 right-hand
    x           profile shift coefficient; by default the one that gives s_n, or 0
    s_n         normal circular tooth thickness at the reference circle; by default the one that x gives
    d_a, d_f    tip and root diameter; by default m_n (1 + x) above and m_n (1.25 - x) below the reference circle
    rho_f       tip radius of the generating rack, which leaves the root fillet; by default 0.38 m_n (ISO 53, profile A)
    flank       modifications of the flanks (`fem.flank`), the same on the left and the right one; they add up

    Raises ValueError where no such gear exists: unit slips, pointed teeth, undercut, a rack tip too round.
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
    rho_f: float = None  # type: ignore[assignment]
    material: Material = field(default=STEEL)
    flank: Flank = ()

    def __post_init__(self):
        require(
            5 <= self.z < 1e4 and self.z == int(self.z), f"z must be a whole number of teeth, at least 5, got {self.z}"
        )
        require_within("m_n", self.m_n, 0, 100 * mm, unit=mm, remedy="mm (pass metres: 2.6*mm)")
        require_within("alpha_n", self.alpha_n, 10 * deg, 35 * deg, unit=deg, remedy="deg (pass radians: 20*deg)")
        require_within("beta", self.beta, -45 * deg, 45 * deg, unit=deg, remedy="deg (pass radians: 15*deg)")
        self._fill_defaults()
        self._check_widths()
        self._check_teeth()

    def _fill_defaults(self) -> None:
        def fill(name: str, value: float) -> None:
            if getattr(self, name) is None:
                object.__setattr__(self, name, value)

        object.__setattr__(self, "z", int(self.z))
        fill("x", 0.0 if self.s_n is None else (self.s_n / self.m_n - pi / 2) / (2 * tan(self.alpha_n)))
        require_within("x", self.x, -2, 2, remedy="(profile shift in modules; s_n is in metres: 3.78*mm)")
        fill("s_n", self.m_n * (pi / 2 + 2 * self.x * tan(self.alpha_n)))
        fill("d_a", 2 * self.r + 2 * self.m_n * (1 + self.x))
        fill("d_f", 2 * self.r - 2 * self.m_n * (1.25 - self.x))
        fill("rho_f", 0.38 * self.m_n)
        object.__setattr__(self, "flank", tuple(self.flank))
        parts = all(hasattr(part, "removed") for part in self.flank)
        require(parts, f"flank must hold modifications such as fem.TipRelief, got {self.flank}")

    def _check_widths(self) -> None:
        m_n, d = self.m_n, 2 * self.r
        require_within("b", self.b, 0.1 * m_n, 200 * m_n, unit=mm, remedy="mm (pass metres: 23*mm)")
        require_within("s_n", self.s_n, 0, pi * m_n, unit=mm, remedy="mm (between nothing and a whole pitch)")
        require_within("d_a", self.d_a, 2 * self.r_b, d + 8 * m_n, unit=mm, remedy="mm (above the base circle)")
        require_within("d_f", self.d_f, d - 8 * m_n, self.d_a, unit=mm, remedy="mm (below the tip circle)")
        rim = f"mm (leave a rim of one module below the root circle {self.d_f / mm:g} mm)"
        require_within("d_bore", self.d_bore, 0, self.d_f - 2 * m_n, unit=mm, remedy=rim)
        largest = (self.m_t * pi - self.s_t - 2 * self.h_rack * tan(self.alpha_t)) / 2 * cos(self.alpha_t)
        largest /= 1 - sin(self.alpha_t)
        fits = "mm, the roundest tip that fits between the flanks of the generating rack"
        require_within("rho_f", self.rho_f, 0, largest * (1 + 1e-9), unit=mm, remedy=fits)

    def _check_teeth(self) -> None:
        s_a = self.thickness(self.r_a)
        tip = f"tip thickness {s_a / mm:.3g} mm at d_a = {self.d_a / mm:g} mm"
        require(s_a > 0, f"teeth are pointed: {tip}; reduce d_a or x")
        form = self.roll_form
        require(
            form > 0,
            f"the generating rack undercuts the flank (x = {self.x:.4g}, z = {self.z}); raise x, z or rho_f, or d_f",
        )
        require(self.r_a > self.r_form, f"no involute between root form and tip circle d_a = {self.d_a / mm:g} mm")

    @property
    def m_t(self) -> float:
        """Transverse module [m]."""
        return self.m_n / cos(self.beta)

    @property
    def alpha_t(self) -> float:
        """Transverse pressure angle [rad]."""
        return atan(tan(self.alpha_n) / cos(self.beta))

    @property
    def beta_b(self) -> float:
        """Base helix angle [rad]."""
        return asin(sin(self.beta) * cos(self.alpha_n))

    @property
    def r(self) -> float:
        """Reference radius [m]."""
        return self.z * self.m_t / 2

    @property
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
    def p_bt(self) -> float:
        """Transverse base pitch [m]."""
        return 2 * pi * self.r_b / self.z

    @property
    def s_t(self) -> float:
        """Transverse tooth thickness on the reference circle [m]."""
        return self.s_n / cos(self.beta)

    @property
    def h_rack(self) -> float:
        """Depth of the generating rack's tip below the reference circle [m]."""
        return self.r - self.r_f

    @property
    def roll_tip(self) -> float:
        """Roll length (radius of curvature) at the tip [m]."""
        return sqrt(self.r_a**2 - self.r_b**2)

    @property
    def roll_form(self) -> float:
        """Roll length where the rack-generated root begins [m]; negative: undercut."""
        straight = self.h_rack - self.rho_f * (1 - sin(self.alpha_t))
        return self.r * sin(self.alpha_t) - straight / sin(self.alpha_t)

    @property
    def r_form(self) -> float:
        """Root form radius r_Ff [m]."""
        return sqrt(self.r_b**2 + self.roll_form**2)

    @property
    def face(self) -> Face:
        """Extent of a flank."""
        return Face(self.roll_form, self.roll_tip, self.b)

    def thickness(self, r: float) -> float:
        """Transverse tooth thickness on the circle of radius r >= r_b [m]."""
        return 2 * r * (self.s_t / (2 * self.r) + involute(self.alpha_t) - involute(acos(self.r_b / r)))


@dataclass(frozen=True)
class GearPair:
    """Two external gears in mesh at working centre distance a [m]; by default the one without backlash.

    Raises ValueError where the two cannot run together: unlike base pitch, no contact, contact ratio below 1,
    interference at the root, tip touching the mate's root, negative backlash.
    """

    pinion: Gear
    wheel: Gear
    a: float = None  # type: ignore[assignment]

    def __post_init__(self):
        pinion, wheel = self.pinion, self.wheel
        for name in ("m_n", "alpha_n"):
            one, other = getattr(pinion, name), getattr(wheel, name)
            require(abs(one - other) < 1e-9, f"{name} of pinion and wheel must be equal, got {one:g} and {other:g}")
        opposite = abs(pinion.beta + wheel.beta) < 1e-9
        hands = f"{pinion.beta / deg:g} and {wheel.beta / deg:g} deg"
        require(opposite, f"beta of pinion and wheel must be equal and opposite, got {hands}; change the hand of one")
        if self.a is None:
            object.__setattr__(self, "a", self.a_without_backlash)
        self._check_contact()
        self._check_clearances()

    def _check_contact(self) -> None:
        base, tips = self.pinion.r_b + self.wheel.r_b, self.pinion.r_a + self.wheel.r_a
        span = "mm (base circles touch below, tip circles part above; pass metres: 150*mm)"
        require_within("a", self.a, base, tips, unit=mm, remedy=span)
        eps = self.eps_alpha + self.eps_beta
        require(eps > 1, f"contact ratio must exceed 1, got {eps:.4g}; reduce a = {self.a / mm:g} mm or raise d_a")

    def _check_clearances(self) -> None:
        for gear, mate, name in ((self.pinion, self.wheel, "pinion"), (self.wheel, self.pinion, "wheel")):
            lowest = self.a * sin(self.alpha_wt) - mate.roll_tip
            require(
                lowest > gear.roll_form,
                f"interference: the mate's tip reaches roll length {lowest / mm:.4g} mm of the {name}, whose involute "
                f"begins at {gear.roll_form / mm:.4g} mm; reduce the mate's d_a = {mate.d_a / mm:g} mm or raise a",
            )
            clearance = self.a - gear.r_f - mate.r_a
            deeper = f"raise a = {self.a / mm:g} mm or reduce d_f of the {name}"
            got = f"got {clearance / mm:g} mm; {deeper}"
            require(clearance > 0, f"tip clearance at the {name}'s root must be > 0, {got}")
        j, rounding = self._backlash_at(self.a), 1e-4 * self.pinion.m_n
        looser = f"raise a = {self.a / mm:.6g} mm or reduce s_n"
        require(j > -rounding, f"backlash must be >= 0, got {j / mm:.4g} mm on the line of action; {looser}")

    @property
    def a_without_backlash(self) -> float:
        """Centre distance at which the teeth fill each other's spaces [m] (bisection of the backlash)."""
        low = (self.pinion.r_b + self.wheel.r_b) * (1 + 1e-12)
        high = self.pinion.r_a + self.wheel.r_a
        for _ in range(200):
            middle = (low + high) / 2
            low, high = (middle, high) if self._backlash_at(middle) < 0 else (low, middle)
        return high

    def _alpha_at(self, a: float) -> float:
        return acos((self.pinion.r_b + self.wheel.r_b) / a)

    def _backlash_at(self, a: float) -> float:
        alpha = self._alpha_at(a)
        r_w1, r_w2 = self.pinion.r_b / cos(alpha), self.wheel.r_b / cos(alpha)
        gap = 2 * pi * r_w1 / self.pinion.z - self.pinion.thickness(r_w1) - self.wheel.thickness(r_w2)
        return gap * cos(alpha)

    @property
    def alpha_wt(self) -> float:
        """Working transverse pressure angle [rad]."""
        return self._alpha_at(self.a)

    @property
    def beta_b(self) -> float:
        """Base helix angle of the pinion [rad]."""
        return self.pinion.beta_b

    @property
    def p_bt(self) -> float:
        """Transverse base pitch [m]."""
        return self.pinion.p_bt

    @property
    def b(self) -> float:
        """Common face width [m]."""
        return min(self.pinion.b, self.wheel.b)

    @property
    def backlash(self) -> float:
        """Play along the line of action j_bt [m]; less than 1e-4 m_n below zero counts as rounded data, so as zero."""
        return max(0.0, self._backlash_at(self.a))

    @property
    def roll_pitch(self) -> float:
        """Roll length of the pinion at the pitch point [m]."""
        return self.pinion.r_b * tan(self.alpha_wt)

    @property
    def roll_start(self) -> float:
        """Roll length of the pinion where the wheel's tip enters contact [m]."""
        return self.a * sin(self.alpha_wt) - self.wheel.roll_tip

    @property
    def eps_alpha(self) -> float:
        """Transverse contact ratio."""
        return (self.pinion.roll_tip - self.roll_start) / self.p_bt

    @property
    def eps_beta(self) -> float:
        """Overlap ratio."""
        return self.b * abs(tan(self.beta_b)) / self.p_bt

    @property
    def back_phase(self) -> float:
        """Sum of the phases of driving and back flank: the back flank's phase is this minus the driving flank's."""
        r_w1 = self.pinion.r_b / cos(self.alpha_wt)
        return (self.pinion.thickness(r_w1) * self.pinion.z / (2 * pi * r_w1)) % 1.0
