"""Two gears in mesh, external or a pinion in a ring (ISO 21771); gears that cannot run together are refused.

Radii, roll lengths and the centre distance of a ring are < 0 (`fem.gear.gear`), by which the formulas hold for both.
"""

from dataclasses import dataclass
from functools import cached_property
from math import acos, copysign, cos, hypot, inf, pi, tan

from fem.gear.data_sheet import PAIR, RING_PAIR, DataSheet, listed
from fem.gear.gear import Gear
from fem.gear.involute import inverse_involute, involute
from fem.pair.interference import radial_clearance, remedies, root_clearance, tip_clearance
from fem.pair.path_of_contact import PathOfContact
from fem.support.arguments import DERIVED, checked
from fem.support.representation import short
from fem.support.validation import as_floats, require, require_within, set_fields
from fem.units import deg, mm

#: Negative backlash that counts as rounded data of a drawing [modules].
ROUNDING = 1e-4
#: Backlash that is the rounding of a calculation [m].
NO_BACKLASH = 1e-12
#: Negative clearance of two points that touch on the path of contact: rounding [modules].
TOUCHING = 1e-7


@checked
@short(a="mm")
@dataclass(frozen=True)
class GearPair:
    """Two gears in mesh at the working centre distance a [m]; by default that without backlash.

    The wheel may be a ring with internal teeth (z < 0): a is then < 0, and accepted with either sign. A helical ring
    has the hand of its pinion, the same beta.

    Raises ValueError where the two cannot run together: different base pitch, helix angles that are not equal and
    opposite (of a ring: equal), no contact, total contact ratio below 1, interference or no tip clearance at a root, an
    undercut that goes beyond the pitch point, negative backlash; of a ring also for tips that strike one another
    outside the path of contact (trochoidal interference). Whether a pinion can be pushed radially into its ring is told
    by `radial_clearance`.
    """

    pinion: Gear
    wheel: Gear
    a: float = DERIVED

    def __post_init__(self):
        as_floats(self)
        pinion, wheel = self.pinion, self.wheel
        for name in ("m_n", "alpha_n"):
            values = getattr(pinion, name), getattr(wheel, name)
            got = f"got {values[0]:g} and {values[1]:g}"
            require(
                abs(values[0] - values[1]) < 1e-9,
                f"{name} of pinion and wheel must be equal, {got}; give both gears the same",
            )
        self._check_ring()
        opposite = abs(pinion.beta + wheel.sign * wheel.beta) < 1e-9
        hands = f"{pinion.beta / deg:g} and {wheel.beta / deg:g} deg"
        hand = "equal, in a ring" if wheel.internal else "equal and opposite"
        require(opposite, f"beta of pinion and wheel must be {hand}, got {hands}; change the hand of one gear")
        if self.a is None:
            thick = (
                f"the teeth of x = {pinion.x:.4g} and {wheel.x:.4g} are too thick for any centre distance in the ring"
            )
            fit = not self.internal or self._involute_without_backlash > 0
            require(fit, f"{thick}; reduce x or s_n of either gear")
            set_fields(self, a=self.a_without_backlash)
        elif self.internal:
            set_fields(self, a=-abs(self.a))
        self._check_contact()
        self._check_clearances()

    def _check_ring(self) -> None:
        """Require that a ring is the wheel, and large enough for its pinion."""
        pinion, wheel = self.pinion.z, self.wheel.z
        first = f"pinion must be an external gear, got z = {pinion}"
        remedy = "give the ring as wheel, fem.GearPair(planet, ring); its torques are those of the planet"
        require(pinion > 0, f"{first}; {remedy}")
        larger = f"the ring must have more teeth than its pinion, got {pinion} and {wheel}"
        require(wheel > 0 or pinion + wheel < 0, f"{larger}; raise |z| of the ring")

    @property
    def internal(self) -> bool:
        """Whether the wheel is a ring with internal teeth."""
        return self.wheel.internal

    def _check_contact(self) -> None:
        base, tips = self.pinion.r_b + self.wheel.r_b, self.pinion.r_a + self.wheel.r_a
        if self.internal:
            roots = self.pinion.r_a + self.wheel.r_f
            span = (
                "mm (beyond the upper bound base circles overlap or tip circles part, below the lower one the pinion "
            )
            require_within("a", self.a, roots, min(base, tips), unit=mm, remedy=f"{span}strikes the ring's root)")
        else:
            span = "mm (base circles touch below, tip circles part above; pass metres: 150*mm)"
            require_within("a", self.a, base, tips, unit=mm, remedy=span)
        a, longer = f"a = {self.a / mm:g} mm", "lengthen the teeth by d_a"
        remedy = f"raise |a|, {a}, or {longer}" if self.internal else f"reduce {a} or raise d_a"
        no_path = f"the path of contact is empty, eps_alpha = {self.eps_alpha:.4g} must be > 0"
        require(self.eps_alpha > 0, f"{no_path}; {remedy}")
        require(self.eps_gamma > 1, f"contact ratio must exceed 1, got {self.eps_gamma:.4g}; {remedy}")

    def _check_clearances(self) -> None:
        for gear, mate, name in ((self.pinion, self.wheel, "pinion"), (self.wheel, self.pinion, "wheel")):
            lowest = self.path_of_contact.on_wheel(mate.roll_tip)
            unusual = gear.undercut or self.internal
            passes = unusual and root_clearance(gear, mate, self.a) > -TOUCHING * gear.m_n
            require(
                lowest > gear.roll_form or (passes and gear.undercut),
                f"interference: the mate's tip reaches roll length {lowest / mm:.4g} mm of the {name}, whose involute "
                f"begins at {gear.roll_form / mm:.4g} mm; {remedies(gear, mate, name)}",
            )
            strikes = f"interference: the mate's tip strikes the root of the {name} below its involute"
            require(passes or not self.internal, f"{strikes}; {remedies(gear, mate, name)}")
            pitch = self.roll_pitch if gear is self.pinion else self.path_of_contact.on_wheel(self.roll_pitch)
            cut = f"undercut removes the involute of the {name} up to roll length {gear.roll_form / mm:.4g} mm"
            beyond = f"beyond the pitch point at {pitch / mm:.4g} mm"
            apart = lowest > gear.roll_form or gear.roll_form < pitch
            require(apart, f"{cut}, {beyond}; raise its profile shift x = {gear.x:g}")
            clearance = self.a - gear.r_f - mate.r_a
            farther = "reduce |a|" if self.internal else "raise a"
            deeper = "raise |d_f|" if gear.internal else "reduce d_f"
            got = f"got {clearance / mm:g} mm; {farther}, a = {self.a / mm:g} mm, or {deeper} of the {name}"
            require(clearance > 0, f"tip clearance at the {name}'s root must be > 0, {got}")
        if self.internal:
            clearance = tip_clearance(self.pinion, self.wheel, self.a)
            overlap = "trochoidal interference: the tips of pinion and ring overlap outside the path of contact"
            remedy = "shorten the teeth of either by d_a, or take a ring with more teeth"
            require(clearance > -TOUCHING * self.pinion.m_n, f"{overlap} by {-clearance / mm:.4g} mm; {remedy}")
        j, rounding = self._backlash_at(self.a), ROUNDING * self.pinion.m_n
        looser = f"{'reduce |a|, a' if self.internal else 'raise a'} = {self.a / mm:.6g} mm, or reduce s_n"
        require(j > -rounding, f"backlash must be >= 0, got {j / mm:.4g} mm on the line of action; {looser}")

    @property
    def a_without_backlash(self) -> float:
        """Centre distance at which the teeth fill each other's spaces [m]; at least the sum of the base radii.

        That of a ring is < 0, and the largest in size: a ring gets backlash as its pinion moves towards its centre.
        """
        alpha_wt = inverse_involute(max(0.0, self._involute_without_backlash))
        return (self.pinion.r_b + self.wheel.r_b) / cos(alpha_wt)

    @property
    def _involute_without_backlash(self) -> float:
        """inv(alpha_wt) at which the two half teeth of a pair take half a pitch of the working pitch circles."""
        pinion, wheel = self.pinion, self.wheel
        return (pinion.z * pinion.psi_b + wheel.z * wheel.psi_b - pi) / (pinion.z + wheel.z)

    def _backlash_at(self, a: float) -> float:
        """Backlash along the line of action at centre distance a [m], < 0 where the teeth overlap."""
        base = self.pinion.r_b + self.wheel.r_b
        return 2 * base * (involute(acos(base / a)) - self._involute_without_backlash)

    @cached_property
    def path_of_contact(self) -> PathOfContact:
        """Path of contact at the centre distance of the pair."""
        return PathOfContact(self.pinion, self.wheel, self.a)

    @property
    def alpha_wt(self) -> float:
        """Working transverse pressure angle [rad]."""
        return self.path_of_contact.alpha_wt

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
        """Backlash j_bt along the line of action [m]; rounding of data, and negative ones by it, count as 0."""
        j = self._backlash_at(self.a)
        return j if j > NO_BACKLASH else 0.0

    @property
    def roll_pitch(self) -> float:
        """Roll length of the pinion at the pitch point [m]."""
        return self.path_of_contact.pitch

    @property
    def roll_start(self) -> float:
        """Roll length of the pinion where the path of contact begins [m]."""
        return self.path_of_contact.start

    @property
    def roll_end(self) -> float:
        """Roll length of the pinion where the path of contact ends [m]."""
        return self.path_of_contact.end

    @property
    def eps_alpha(self) -> float:
        """Transverse contact ratio."""
        return (self.roll_end - self.roll_start) / self.p_bt

    @property
    def eps_beta(self) -> float:
        """Overlap ratio."""
        return self.b * abs(tan(self.beta_b)) / self.p_bt

    @property
    def eps_gamma(self) -> float:
        """Total contact ratio."""
        return self.eps_alpha + self.eps_beta

    @property
    def back_phase(self) -> float:
        """Sum of the phases of driving and coast flank: the coast flank's phase is this minus the driving flank's."""
        r_w1, _ = self.path_of_contact.r_w
        return (self.pinion.thickness(r_w1) * self.pinion.z / (2 * pi * r_w1)) % 1.0

    @cached_property
    def radial_clearance(self) -> float:
        """Least clearance [m] while the pinion is pushed radially into its ring, a tooth in a space; external: inf.

        < 0: radial assembly is not possible. Push the pinion in along the axis, or shorten the teeth by d_a, or take
        a ring with more teeth.
        """
        return radial_clearance(self.pinion, self.wheel, self.a) if self.internal else inf

    def data_sheet(self) -> DataSheet:
        """Quantities of ISO 21771 by symbol, in SI units; print it for a table in mm and degrees.

        Index 1 is the pinion, 2 the wheel. Sliding is given at the ends of the path of contact, where it is largest.
        """
        pinion, wheel, j_wt = self.pinion, self.wheel, self.backlash / cos(self.alpha_wt)
        (r_w1, r_w2), u, path = self.path_of_contact.r_w, wheel.z / pinion.z, self.path_of_contact
        length, start, end = path.length, path.start, path.end
        sizes = {
            "u": u,
            "a_0": self.a_without_backlash,
            "d_w1": 2 * r_w1,
            "d_w2": 2 * r_w2,
            "g_alpha": end - start,
            "j_bt": self.backlash,
            "j_wt": j_wt,
            "j_bn": self.backlash * cos(self.beta_b),
            "j_r": self.a - self.a_without_backlash,
            "c_1": self.a - pinion.r_a - wheel.r_f,
            "c_2": self.a - wheel.r_a - pinion.r_f,
            "d_Ff1": 2 * pinion.r_form,
            "d_Nf1": 2 * hypot(pinion.r_b, start),
            "d_Na1": 2 * hypot(pinion.r_b, end),
            "d_Ff2": 2 * wheel.r_form,
            "d_Nf2": 2 * copysign(hypot(wheel.r_b, length - end), wheel.r_b),
            "d_Na2": 2 * copysign(hypot(wheel.r_b, length - start), wheel.r_b),
            "K_gf": (self.roll_pitch - start) * (1 / r_w1 + 1 / r_w2),
            "K_ga": (end - self.roll_pitch) * (1 / r_w1 + 1 / r_w2),
            "zeta_f1": specific_sliding(start, length - start, u),
            "zeta_f2": specific_sliding(length - end, end, 1 / u),
        }
        return DataSheet(repr(self), listed(PAIR | RING_PAIR if self.internal else PAIR, self, sizes))


def specific_sliding(roll: float, mate_roll: float, u: float) -> float:
    """Specific sliding of a flank at its roll length and that of the mating flank [m]; u = z_mate / z."""
    return 1 - mate_roll / (u * roll) if roll else -inf
