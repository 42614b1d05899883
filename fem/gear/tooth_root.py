"""The tooth root between involute and root circle: the trochoid that a rack generates, or a circular arc.

That of an internal gear is an arc, with the signs of `fem.gear.gear`, or the trochoid of `fem.gear.pinion_cutter`.

Polar coordinates as in `tooth_profile`. A point of the root is named by its share of the way from the involute (0) to
the root circle (1). Both curves have `roll_form`, the roll length at share 0, and `psi_f`, the angle at share 1.
"""

from dataclasses import dataclass
from functools import cached_property
from math import acos, asin, copysign, cos, hypot, pi, sin, sqrt, tan

import numpy as np
import scipy

from fem.gear.involute import involute

#: Largest share of the way along a circular root that its radial line takes.
LINE = 0.25


@dataclass(frozen=True)
class Trochoid:
    """Root that a generating rack leaves, undercut or not, in the transverse section.

    The rounding of the rack's tip is a circle in the normal section (ISO 53), hence in the transverse section an
    ellipse, longer by 1 / cos(beta) along the pitch line.

    z, r, alpha_t   number of teeth, reference radius [m], transverse pressure angle [rad]
    beta            helix angle at the reference circle [rad]
    psi_b           half angle of the tooth at the base circle [rad]
    depth           depth of the rack's tip below the reference circle [m]
    rho             radius of the rack's tip rounding in the normal section [m]
    """

    z: int
    r: float
    alpha_t: float
    beta: float
    psi_b: float
    depth: float
    rho: float

    @property
    def r_b(self) -> float:
        """Base radius [m]."""
        return self.r * cos(self.alpha_t)

    @property
    def tip_centre(self) -> float:
        """Distance of the centre of the rounding from the middle of the rack's tooth [m]; < 0: too large a radius."""
        half_space = self.r * (pi / self.z - self.psi_b + involute(self.alpha_t))
        cos_n, _ = self._in_normal_section(self.alpha_t)
        return half_space - (self.depth - self.rho) * tan(self.alpha_t) - self.rho / float(cos_n) / cos(self.beta)

    @property
    def straight_roll(self) -> float:
        """Roll length that the end of the rack's straight flank generates [m]; < 0: the rack undercuts the tooth.

        That end lies at depth - rho (1 - sin(alpha_n)) below the reference circle: h_FfP of ISO 53 less the shift.
        """
        _, sin_n = self._in_normal_section(self.alpha_t)
        straight = self.depth - self.rho * (1 - float(sin_n))
        return self.r * sin(self.alpha_t) - straight / sin(self.alpha_t)

    @property
    def undercuts(self) -> bool:
        """Whether the trochoid cuts off the involute above the base circle."""
        return self.straight_roll < -1e-6 * self.r

    @cached_property
    def theta_form(self) -> float:
        """Inclination of the rack's normal at the root form circle [rad]."""
        if not self.undercuts:
            return self.alpha_t
        brentq = scipy.optimize.brentq
        base = brentq(lambda theta: float(self.at(theta)[0]) - self.r_b, self.alpha_t, pi / 2, xtol=1e-15)
        return brentq(self._outside, self.alpha_t, base, xtol=1e-15)

    def _outside(self, theta: float) -> float:
        r, psi = self.at(theta)
        return float(psi - self.psi_b + involute(acos(min(1.0, self.r_b / float(r)))))

    @cached_property
    def roll_form(self) -> float:
        """Roll length at the root form circle [m]."""
        if not self.undercuts:
            return max(0.0, self.straight_roll)
        return sqrt(max(0.0, float(self.at(self.theta_form)[0]) ** 2 - self.r_b**2))

    @property
    def psi_f(self) -> float:
        """Angle where the root circle begins [rad]."""
        return pi / self.z - self.tip_centre / self.r

    def _in_normal_section(self, theta) -> tuple[np.ndarray, np.ndarray]:
        """Cosine and sine of theta as seen in the normal section, where its tangent is cos(beta) tan(theta)."""
        length = np.sqrt(1 - (sin(self.beta) * np.sin(theta)) ** 2)
        return np.cos(theta) / length, cos(self.beta) * np.sin(theta) / length

    def at(self, theta) -> tuple[np.ndarray, np.ndarray]:
        """r [m] and psi [rad] where the rack's normal has the inclination theta: pi/2 on the root circle.

        The normal passes through the pitch point; offset is its distance from the centre of the ellipse along the
        pitch line.
        """
        cos_n, sin_n = self._in_normal_section(theta)
        depth, reach = self.depth - self.rho, self.rho * cos_n / cos(self.beta)
        offset = depth / np.tan(theta) - reach * sin(self.beta) ** 2
        across, up = offset + reach, self.r - depth - self.rho * sin_n
        turn = (offset - self.tip_centre) / self.r
        return np.hypot(across, up), pi / self.z - (np.arctan2(across, up) - turn)

    def points(self, share) -> tuple[np.ndarray, np.ndarray]:
        """r [m] and psi [rad] at shares (n,) of the turn of the rack's normal, or of the length of an undercut root."""
        share = np.asarray(share, float)
        if self.undercuts:
            share = np.interp(share, self._lengths, np.linspace(0, 1, self._lengths.size))
        return self.at(self.theta_form + share * (pi / 2 - self.theta_form))

    @cached_property
    def _lengths(self) -> np.ndarray:
        """Shares of the length at equal steps of the normal, which hardly turns along an undercut."""
        r, psi = self.at(np.linspace(self.theta_form, pi / 2, 201))
        lengths = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(r * np.exp(1j * psi))))])
        return lengths / lengths[-1]


@dataclass(frozen=True)
class Arc:
    """Circular arc tangent to the root circle and to the involute, or to a radial line below the base circle.

    r_b, r_f        base and root radius [m], < 0 of an internal gear
    psi_b           half angle of the tooth at the base circle [rad]
    radius          radius of the arc [m]
    """

    r_b: float
    r_f: float
    psi_b: float
    radius: float

    @property
    def r_centre(self) -> float:
        """Distance of the arc's centre from the gear's centre [m]."""
        return self.r_f + self.radius

    @property
    def r_touch(self) -> float:
        """Radius where the arc ends on the flank [m]."""
        if self.on_line:
            return sqrt(self.r_centre**2 - self.radius**2)
        return copysign(hypot(self.r_b, self.roll_form), self.r_b)

    @property
    def on_line(self) -> bool:
        """Whether the arc ends on the radial line below the base circle, as that of an internal gear never does."""
        return 0 < self.r_centre < hypot(self.r_b, self.radius)

    @property
    def roll_form(self) -> float:
        """Roll length where the involute begins [m]."""
        return 0.0 if self.on_line else copysign(sqrt(self.r_centre**2 - self.r_b**2), self.r_b) - self.radius

    @property
    def psi_f(self) -> float:
        """Angle where the root circle begins [rad]."""
        if self.on_line:
            return self.psi_b + asin(self.radius / self.r_centre)
        return float(self.psi_b + self.radius / self.r_b - involute(acos(self.r_b / self.r_centre)))

    def points(self, share) -> tuple[np.ndarray, np.ndarray]:
        """r [m] and psi [rad] at shares (n,) of the way; 1/2 is the middle of the arc.

        The line from base circle to arc, where stress is low, takes a share of `LINE` at most.
        """
        centre, down = self.r_centre * np.exp(1j * self.psi_f), -np.exp(1j * self.psi_f)
        psi = self.psi_b - involute(acos(min(1.0, self.r_b / self.r_touch)))
        sweep = np.angle((self.r_touch * np.exp(1j * psi) - centre) / down)
        straight, arc = self.r_b - self.r_touch if self.on_line else 0.0, self.radius * abs(sweep)
        line = min(LINE, 0.5 * straight / (straight + arc / 2))
        way = np.interp(share, [0, line, 0.5, 1], [0, straight, straight + arc / 2, straight + arc])
        turn = np.minimum(1, (straight + arc - way) / arc)
        curve = centre + self.radius * down * np.exp(1j * sweep * turn)
        point = np.where(way < straight, (self.r_b - way) * np.exp(1j * self.psi_b), curve)
        sign = copysign(1, self.r_b)
        return sign * np.abs(point), np.angle(sign * point)
