"""A pinion in an internal ring gear: its kinematics (ISO 21771: z, a and r_b of a ring are < 0)."""

from dataclasses import dataclass
from math import acos, cos, inf, pi

from fem.gear.gear import Gear
from fem.support.arguments import checked
from fem.support.representation import short
from fem.support.validation import require
from fem.units import mm


@short(r_b="mm", b="mm", beta="deg", m_n="mm", r="mm")
@dataclass(frozen=True)
class Ring:
    """Internal gear with z < 0 teeth, whose body is not known: a shaft that carries it needs its inertia and mass.

    r_b base radius < 0 [m], b face width [m], beta helix angle [rad], m_n normal module [m], r reference radius < 0 [m]
    """

    z: int
    r_b: float
    b: float
    beta: float
    m_n: float
    r: float


@checked
@short(a="mm", backlash="um")
@dataclass(frozen=True)
class RingPair:
    """A pinion that meshes with a ring gear (ISO 21771).

    pinion     `fem.Gear`
    z          number of teeth of the ring gear, < 0
    a          centre distance [m], < 0
    backlash   along the line of action [m]; inf: the back flank never touches

    Of the ring it knows the number of teeth alone: pass a `MeshForce` made from a table, for example of a constant
    stiffness. A map by finite elements needs the whole ring: `fem.GearPair(planet, ring)`, which has the same signs.

    Raises ValueError for z and a of the wrong sign, and for base circles that overlap.
    """

    pinion: Gear
    z: int
    a: float
    backlash: float = inf

    def __post_init__(self):
        external = f"pinion must be an external gear, with z > 0, got z = {self.pinion.z}; give the ring's teeth as z"
        require(self.pinion.z > 0, external)
        more = f"z must be a whole number below -{self.pinion.z} (a ring has z < 0), got {self.z}"
        require(self.z == int(self.z) and self.z < -self.pinion.z, more)
        require(self.backlash >= 0, f"backlash must be >= 0 m (inf: no back flank), got {self.backlash}")
        base = self.pinion.r_b + self.wheel.r_b
        require(self.a < 0, f"a must be < 0 m for a ring gear, got {self.a}; change its sign")
        apart = f"a must lie beyond {base / mm:.6g} mm, where the base circles touch, got {self.a / mm:.6g} mm"
        require(-10 < self.a < base, f"{apart} (pass metres)")

    @property
    def wheel(self) -> Ring:
        """The ring gear."""
        pinion, ratio = self.pinion, self.z / self.pinion.z
        return Ring(self.z, pinion.r_b * ratio, pinion.b, pinion.beta, pinion.m_n, pinion.r * ratio)

    @property
    def alpha_wt(self) -> float:
        """Working transverse pressure angle [rad]."""
        return acos((self.pinion.r_b + self.wheel.r_b) / self.a)

    @property
    def beta_b(self) -> float:
        """Base helix angle of the pinion [rad]."""
        return self.pinion.beta_b

    @property
    def b(self) -> float:
        """Face width [m]."""
        return self.pinion.b

    @property
    def back_phase(self) -> float:
        """Sum of the phases of driving and back flank."""
        r_w1 = self.pinion.r_b / cos(self.alpha_wt)
        return (self.pinion.thickness(r_w1) * self.pinion.z / (2 * pi * r_w1)) % 1.0
