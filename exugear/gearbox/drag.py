"""Torques that brake a shaft, as data: constant and viscous ones, drag of rolling bearings after Palmgren and SKF."""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from exugear.mesh_force.friction_coefficient import check_fading_speed
from fem.support.arguments import Numbers, checked
from fem.support.numba_cache import compiled_or_not
from fem.support.representation import short
from fem.support.validation import require, require_finite
from fem.units import mm, rpm

#: Largest torque [N m] and largest viscous factor.
LARGEST_TORQUE, LARGEST_VISCOUS = 1e6, 1e5
#: Ranges in which a kinematic viscosity [m^2/s], a mean diameter [m] and the factors are taken as given in their units.
VISCOSITIES, DIAMETERS, LARGEST_F_0, LARGEST_F_1 = (1e-7, 1e-2), (1e-3, 3.0), 50.0, 0.05
#: Product of kinematic viscosity [mm^2/s] and speed [1/min] below which the hydrodynamic part is constant.
LEAST_VISCOUS_SPEED = 2000.0
EXPONENT = 2 / 3
#: Difference of speeds for the slope of SKF's torque [rad/s].
SPEED_DIFFERENCE = 1e-3
#: Constants R_1 and S_1, S_2 of SKF's model for series of deep groove ball bearings; R_2 is 1.7 for all.
DEEP_GROOVE_SERIES = {
    ("2", "3"): (4.4e-7, 2.00e-3, 100.0),
    ("60", "630"): (4.1e-7, 3.73e-3, 14.6),
    ("62", "622"): (3.9e-7, 3.23e-3, 36.5),
    ("63", "623"): (3.7e-7, 2.84e-3, 92.8),
    ("64",): (3.6e-7, 2.43e-3, 198.0),
    ("160", "161"): (4.3e-7, 4.63e-3, 4.25),
    ("617", "618", "628", "637", "638"): (4.7e-7, 6.50e-3, 0.78),
    ("619", "639"): (4.3e-7, 4.75e-3, 3.6),
}
DEEP_GROOVE_R_2 = 1.7
#: R_1, R_2, R_3, S_1, S_2, S_3 of single row angular contact ball bearings.
ANGULAR_CONTACT = 5.03e-7, 1.97, 1.90e-12, 1.30e-2, 0.68, 1.91e-12
#: Geometry constants K_z of the starvation.
K_Z_DEEP_GROOVE, K_Z_ANGULAR_CONTACT = 3.1, 4.4


class DragTerms(NamedTuple):
    """tanh(omega / speed) (constant + arm P + hydrodynamic max(|omega|, least_speed)^(2/3) + M) + viscous omega [N m].

    arm   [m]; P is the load of the bearing [N]

    M is that of SKF's model (`SkfDrag`), 0 without, with n = |omega|:

    rolling (P + pushed + pushed_by_speed n^2)^0.54 n^0.6 exp(-starving n) / (1 + heating n^1.28)
    + sliding ((P + slid + slid_by_speed n^2)^power + slid_beside) (mu + (mu_rest - mu) exp(-thin n^1.4))
    """

    speed: float
    constant: float = 0.0
    arm: float = 0.0
    hydrodynamic: float = 0.0
    least_speed: float = 1.0
    viscous: float = 0.0
    rolling: float = 0.0
    pushed: float = 0.0
    pushed_by_speed: float = 0.0
    starving: float = 0.0
    heating: float = 0.0
    sliding: float = 0.0
    slid: float = 0.0
    slid_by_speed: float = 0.0
    power: float = 1.0
    slid_beside: float = 0.0
    mu: float = 0.0
    mu_rest: float = 0.0
    thin: float = 0.0


@compiled_or_not
def skf_torque(terms, omega, load):
    """Torque of SKF's model [N m] >= 0."""
    n = np.abs(omega)
    pressed = load + terms.pushed + terms.pushed_by_speed * n * n
    rolling = terms.rolling * pressed**0.54 * n**0.6
    rolling = rolling * np.exp(-terms.starving * n) / (1.0 + terms.heating * n**1.28)
    slid = (load + terms.slid + terms.slid_by_speed * n * n) ** terms.power + terms.slid_beside
    mu = terms.mu + (terms.mu_rest - terms.mu) * np.exp(-terms.thin * n**1.4)
    return rolling + terms.sliding * slid * mu


@compiled_or_not
def braking_torque(terms, omega, load):
    """Torque against the rotation [N m], signed like omega [rad/s], by `DragTerms` and a load [N]."""
    torque = terms.hydrodynamic * np.maximum(np.abs(omega), terms.least_speed) ** EXPONENT
    if terms.sliding > 0.0:
        torque = torque + skf_torque(terms, omega, load)
    return np.tanh(omega / terms.speed) * (terms.constant + terms.arm * load + torque) + terms.viscous * omega


@compiled_or_not
def braking_slope(terms, omega, load):
    """Derivative of `braking_torque` by the speed [N m s/rad]."""
    faded, speed = np.tanh(omega / terms.speed), np.maximum(np.abs(omega), terms.least_speed)
    hydrodynamic = terms.hydrodynamic * speed**EXPONENT
    sliding = terms.constant + terms.arm * load + hydrodynamic
    steeper = np.where(np.abs(omega) > terms.least_speed, EXPONENT * hydrodynamic / speed, 0.0)
    slope = (1.0 - faded**2) / terms.speed * sliding + np.abs(faded) * steeper + terms.viscous
    if terms.sliding > 0.0:
        n, h = np.abs(omega), SPEED_DIFFERENCE
        torque = skf_torque(terms, n, load)
        by_speed = (skf_torque(terms, n + h, load) - torque) / h
        slope = slope + (1.0 - faded**2) / terms.speed * torque + np.abs(faded) * by_speed
    return slope


@checked
@short(constant="N m", viscous="N m s/rad", speed="rad/s")
@dataclass(frozen=True)
class Drag:
    """A torque that brakes a shaft: constant tanh(omega / speed) + viscous omega; of seals, oil, a fan or a bearing.

    constant   [N m]
    viscous    torque per speed of the shaft [N m s/rad]
    speed      [rad/s] that regularizes the constant torque at standstill, so that a shaft comes to rest smoothly

    A shaft carries it as a part at any axial position, or a `Bearing` carries it. Raises ValueError for values out of
    range.
    """

    constant: float = 0.0
    viscous: float = 0.0
    speed: float = field(default=1.0, kw_only=True)

    def __post_init__(self):
        brakes = "a drag brakes"
        constant = f"constant must lie in [0, {LARGEST_TORQUE:g}) N m, {brakes}, got {self.constant}"
        require(0 <= self.constant < LARGEST_TORQUE, constant)
        viscous = f"viscous must lie in [0, {LARGEST_VISCOUS:g}) N m s/rad, {brakes}, got {self.viscous}"
        require(0 <= self.viscous < LARGEST_VISCOUS, viscous)
        check_fading_speed(self.speed)

    @property
    def terms(self) -> DragTerms:
        """The terms of the torque."""
        return DragTerms(self.speed, self.constant, viscous=self.viscous)

    @property
    def needs_load(self) -> bool:
        """Whether the torque depends on the load of a bearing."""
        return False

    @checked
    def torque(self, omega: Numbers):
        """Torque against the rotation [N m] at speeds of the shaft [rad/s], number or array; signed like the speed."""
        return braking_torque(self.terms, _finite("omega", omega, "rad/s"), 0.0)


@checked
@short(d_m="mm", viscosity="m^2/s", load="N", speed="rad/s")
@dataclass(frozen=True)
class BearingDrag:
    """Drag of a rolling bearing after Palmgren: M_0 of the oil and M_1 = f_1 P d_m of the load.

    d_m         mean diameter, (bore + outer diameter) / 2 [m]
    f_0         of type and lubrication: for an oil bath about 2 for deep groove ball bearings, 2 to 4 for cylindrical
                and 6 for tapered roller bearings
    viscosity   kinematic, of the oil in the bearing [m^2/s]
    f_1         of type and load: 0.0004 to 0.0009 (P_0 / C_0)^0.55 for deep groove ball bearings (Harris and Kotzalas),
                0.0002 to 0.0004 for cylindrical roller bearings
    load        equivalent load P [N]; by default the radial force of the elastic `Bearing` that carries the drag, as it
                is in the run
    speed       [rad/s] that regularizes the torque at standstill by tanh(omega / speed)

    M_0 = 1e-7 f_0 (nu n)^(2/3) d_m^3 [N mm] for nu n > 2000, nu in mm^2/s, n in 1/min, d_m in mm. Below it is constant;
    sources round it there to 160e-7 f_0 d_m^3, which is 0.8 % more. Raises ValueError for values that suggest another
    unit.

    A. Palmgren, Grundlagen der Waelzlagertechnik (1964); T. A. Harris and M. N. Kotzalas, Rolling bearing analysis,
    CRC Press (2007); f_0 and f_1 stand in catalogues of bearings and in ISO/TR 14179-2.
    """

    d_m: float
    f_0: float
    viscosity: float
    f_1: float = 0.0
    load: float | None = field(default=None, kw_only=True)
    speed: float = field(default=1.0, kw_only=True)

    def __post_init__(self):
        (least, largest), (thin, thick) = DIAMETERS, VISCOSITIES
        diameter = f"d_m must lie in ({least:g}, {largest:g}) m, got {self.d_m:g}; pass metres: 60*mm"
        require(least < self.d_m < largest, diameter)
        require(0 <= self.f_0 < LARGEST_F_0, f"f_0 must lie in [0, {LARGEST_F_0:g}), about 2, got {self.f_0}")
        viscosity = f"viscosity must lie in ({thin:g}, {thick:g}) m^2/s, got {self.viscosity:g}"
        require(thin < self.viscosity < thick, f"{viscosity}; pass m^2/s, the kinematic viscosity: 20 mm^2/s are 20e-6")
        require(0 <= self.f_1 < LARGEST_F_1, f"f_1 must lie in [0, {LARGEST_F_1:g}), about 0.0003, got {self.f_1}")
        newton = f"load must lie in [0, 1e9) N, got {self.load}"
        require(self.load is None or 0 <= self.load < 1e9, newton)
        check_fading_speed(self.speed)

    @property
    def terms(self) -> DragTerms:
        """The terms of the torque; the arm is 0 where the load is given."""
        per_radian = self.viscosity / (mm**2 * rpm)
        hydrodynamic = 1e-10 * self.f_0 * per_radian**EXPONENT * (self.d_m / mm) ** 3
        arm = self.f_1 * self.d_m
        constant, arm = (0.0, arm) if self.load is None else (arm * self.load, 0.0)
        return DragTerms(self.speed, constant, arm, hydrodynamic, LEAST_VISCOUS_SPEED / per_radian)

    @property
    def needs_load(self) -> bool:
        """Whether the torque depends on the force of the bearing in the run."""
        return self.load is None and self.f_1 > 0

    @checked
    def torque(self, omega: Numbers, load: Numbers = 0.0):
        """Torque against the rotation [N m] at speeds of the shaft [rad/s], number or array; signed like the speed.

        load   radial force of the bearing >= 0 [N], if the drag has no load of its own
        """
        force = _finite("load", load, "N")
        require(bool((force >= 0).all()), f"load must be >= 0 N, got {force.min():g}; pass the magnitude of the force")
        return braking_torque(self.terms, _finite("omega", omega, "rad/s"), force)


@checked
@short(d="mm", D="mm", viscosity="m^2/s", load="N", C_0="N", speed="rad/s")
@dataclass(frozen=True)
class SkfDrag:
    """Drag of a ball bearing after SKF's model: rolling, with shear heating and starvation, and sliding.

    series      of a deep groove ball bearing, the first digits of its name: "60", "62", "63", "619", ...; or
                "angular contact" of a single row
    d, D        bore and outer diameter [m]
    viscosity   kinematic, of the oil in the bearing [m^2/s]
    load        (radial, axial) load of the bearing [N]; by default the radial force of the `RollingBearing` or elastic
                `Bearing` that carries the drag, as it is in the run, without an axial one: deep groove bearings only
    C_0         static capacity [N], which deep groove bearings under an axial load need
    starvation  3e-8 for an oil bath with a low level or an oil jet, 6e-8 for grease or oil and air
    mu_EHL      coefficient of sliding in a full film: 0.05 for mineral, 0.04 for synthetic oils, 0.1 for transmission
                fluids
    mu_bl       that without a film: 0.12 in motion (0.15 at the start)
    speed       [rad/s] that regularizes the torque at standstill by tanh(omega / speed)

    M = phi_ish phi_rs G_rr (nu n)^0.6 + mu_sl G_sl [N mm], without churning in an oil bath and without seals: give
    these as a further `Drag`. Raises ValueError for values that suggest another unit.

    Formulas: SKF, Rolling bearings (catalogue, chapter Friction, tables 2). The geometric constants are those of public
    programs, of which two agree for series 619 and 639 and for angular contact; one gives the others. No public source
    was at hand for the constants of roller bearings: use `BearingDrag` for these.
    """

    series: str
    d: float
    D: float
    viscosity: float
    load: tuple[float, float] | None = field(default=None, kw_only=True)
    C_0: float | None = field(default=None, kw_only=True)
    starvation: float = field(default=3e-8, kw_only=True)
    mu_EHL: float = field(default=0.05, kw_only=True)
    mu_bl: float = field(default=0.12, kw_only=True)
    speed: float = field(default=1.0, kw_only=True)

    def __post_init__(self):
        known = [name for names in DEEP_GROOVE_SERIES for name in names]
        text = f'series must be one of {known} or "angular contact", got {self.series!r}; use BearingDrag for rollers'
        require(self.series in known or self._angular, text)
        sizes = f"d and D must be 0 < d < D < 3 m, got d = {self.d:g}, D = {self.D:g}; pass metres: 25*mm"
        require(0 < self.d < self.D < DIAMETERS[1], sizes)
        thin, thick = VISCOSITIES
        viscosity = f"viscosity must lie in ({thin:g}, {thick:g}) m^2/s, got {self.viscosity:g}"
        require(thin < self.viscosity < thick, f"{viscosity}; pass m^2/s, the kinematic viscosity: 20 mm^2/s are 20e-6")
        require(0 <= self.starvation < 1e-6, f"starvation must lie in [0, 1e-6), about 3e-8, got {self.starvation:g}")
        for name in ("mu_EHL", "mu_bl"):
            value = getattr(self, name)
            require(0 < value < 1, f"{name} must lie in (0, 1), about 0.05 and 0.12, got {value}")
        given = self.load is not None or not self._angular
        require(
            given, "load must be given for angular contact bearings, which their axial load matters to: (radial, axial)"
        )
        if self.C_0 is not None:
            require(0 < self.C_0 < np.inf, f"C_0 must be > 0 N and finite, got {self.C_0}")
        if self.load is not None:
            require_finite("load", self.load, "pass (radial, axial) in N")
            require(
                len(self.load) == 2 and min(self.load) >= 0, f"load must be (radial, axial) >= 0 N, got {self.load}"
            )
            needed = self._angular or self.load[1] == 0 or (self.C_0 or 0.0) > 0
            require(needed, f"C_0 must be given beside an axial load, got {self.C_0}; pass newtons")
        check_fading_speed(self.speed)

    @property
    def _angular(self) -> bool:
        return self.series == "angular contact"

    @property
    def terms(self) -> DragTerms:
        """The terms of the torque."""
        d_m, nu, per_radian = (self.d + self.D) / 2 / mm, self.viscosity / mm**2, 1 / rpm
        (radial, axial), k_z = self.load or (0.0, 0.0), K_Z_ANGULAR_CONTACT if self._angular else K_Z_DEEP_GROOVE
        starving = self.starvation * nu * (self.d + self.D) / mm * np.sqrt(k_z / (2 * (self.D - self.d) / mm))
        film = {
            "starving": float(starving * per_radian),
            "heating": 1.84e-9 * (d_m * per_radian) ** 1.28 * nu**0.64,
            "mu": self.mu_EHL,
            "mu_rest": self.mu_bl,
            "thin": 2.6e-8 * (nu * per_radian) ** 1.4 * d_m,
        }
        viscous = (nu * per_radian) ** 0.6 * mm
        if self._angular:
            r_1, r_2, r_3, s_1, s_2, s_3 = ANGULAR_CONTACT
            return DragTerms(
                self.speed,
                rolling=r_1 * d_m**1.97 * viscous,
                pushed=radial + r_2 * axial,
                pushed_by_speed=r_3 * d_m**4 * per_radian**2,
                sliding=s_1 * d_m**0.26 * mm,
                slid=radial,
                slid_by_speed=s_3 * d_m**4 * per_radian**2,
                power=4 / 3,
                slid_beside=s_2 * axial ** (4 / 3),
                **film,
            )
        r_1, s_1, s_2 = next(constants for names, constants in DEEP_GROOVE_SERIES.items() if self.series in names)
        rolling = r_1 * d_m**1.96 * viscous
        if axial == 0:
            sliding = s_1 * d_m**-0.26 * mm
            loads = {"pushed": radial, "slid": radial, "power": 5 / 3}
            return DragTerms(self.speed, rolling=rolling, sliding=sliding, **loads, **film)
        sine = np.sin(np.radians(24.6 * (axial / (self.C_0 or np.inf)) ** 0.24))
        pushed = float(radial + DEEP_GROOVE_R_2 * axial / sine)
        beside = float((radial**5 + s_2 * d_m**1.5 * axial**4 / sine) ** (1 / 3))
        sliding = s_1 * d_m**-0.145 * mm
        return DragTerms(self.speed, rolling=rolling, pushed=pushed, sliding=sliding, slid_beside=beside, **film)

    @property
    def needs_load(self) -> bool:
        """Whether the torque depends on the force of the bearing in the run."""
        return self.load is None

    @checked
    def torque(self, omega: Numbers, load: Numbers = 0.0):
        """Torque against the rotation [N m] at speeds of the shaft [rad/s], number or array; signed like the speed.

        load   radial force of the bearing >= 0 [N], if the drag has no load of its own
        """
        force = _finite("load", load, "N")
        require(bool((force >= 0).all()), f"load must be >= 0 N, got {force.min():g}; pass the magnitude of the force")
        require(self.needs_load or not np.any(force), f"load is given by the drag, {self.load} N; leave it out here")
        return braking_torque(self.terms, _finite("omega", omega, "rad/s"), force)


AnyDrag = Drag | BearingDrag | SkfDrag


def _finite(name: str, values, unit: str) -> np.ndarray:
    """The values as array; ValueError unless all are finite."""
    require_finite(name, values, f"pass {unit}")
    return np.asarray(values, float)
