"""Two external gears in mesh (ISO 21771); gears that cannot run together are refused."""

from dataclasses import dataclass
from functools import cached_property
from math import acos, cos, hypot, inf, pi, tan

from fem.gear.data_sheet import PAIR, DataSheet, listed
from fem.gear.gear import Gear
from fem.gear.involute import inverse_involute, involute
from fem.pair.interference import remedies, root_clearance
from fem.pair.path_of_contact import PathOfContact
from fem.support.arguments import DERIVED, checked
from fem.support.representation import short
from fem.support.validation import as_floats, require, require_within, set_fields
from fem.units import deg, mm

#: Negative backlash that counts as rounded data of a drawing [modules].
ROUNDING = 1e-4
#: Backlash that is the rounding of a calculation [m].
NO_BACKLASH = 1e-12


@checked
@short(a="mm")
@dataclass(frozen=True)
class GearPair:
    """Two external gears in mesh at the working centre distance a [m]; by default that without backlash.

    Raises ValueError where the two cannot run together: different base pitch, helix angles that are not equal and
    opposite, no contact, total contact ratio below 1, interference or no tip clearance at a root, an undercut that goes
    beyond the pitch point, negative backlash.
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
            require(abs(values[0] - values[1]) < 1e-9, f"{name} of pinion and wheel must be equal, {got}")
        opposite = abs(pinion.beta + wheel.beta) < 1e-9
        hands = f"{pinion.beta / deg:g} and {wheel.beta / deg:g} deg"
        require(
            opposite, f"beta of pinion and wheel must be equal and opposite, got {hands}; change the hand of one gear"
        )
        if self.a is None:
            set_fields(self, a=self.a_without_backlash)
        self._check_contact()
        self._check_clearances()

    def _check_contact(self) -> None:
        base, tips = self.pinion.r_b + self.wheel.r_b, self.pinion.r_a + self.wheel.r_a
        span = "mm (base circles touch below, tip circles part above; pass metres: 150*mm)"
        require_within("a", self.a, base, tips, unit=mm, remedy=span)
        no_path = f"the path of contact is empty, eps_alpha = {self.eps_alpha:.4g} must be > 0"
        require(self.eps_alpha > 0, f"{no_path}; reduce a = {self.a / mm:g} mm or raise d_a")
        eps = f"{self.eps_gamma:.4g}"
        require(
            self.eps_gamma > 1, f"contact ratio must exceed 1, got {eps}; reduce a = {self.a / mm:g} mm or raise d_a"
        )

    def _check_clearances(self) -> None:
        for gear, mate, name in ((self.pinion, self.wheel, "pinion"), (self.wheel, self.pinion, "wheel")):
            lowest = self.path_of_contact.on_wheel(mate.roll_tip)
            passes = gear.undercut and root_clearance(gear, mate, self.a) > 0
            require(
                lowest > gear.roll_form or passes,
                f"interference: the mate's tip reaches roll length {lowest / mm:.4g} mm of the {name}, whose involute "
                f"begins at {gear.roll_form / mm:.4g} mm; {remedies(gear, mate, name)}",
            )
            pitch = self.roll_pitch if gear is self.pinion else self.path_of_contact.on_wheel(self.roll_pitch)
            cut = f"undercut removes the involute of the {name} up to roll length {gear.roll_form / mm:.4g} mm"
            beyond = f"beyond the pitch point at {pitch / mm:.4g} mm"
            apart = lowest > gear.roll_form or gear.roll_form < pitch
            require(apart, f"{cut}, {beyond}; raise its profile shift x = {gear.x:g}")
            clearance = self.a - gear.r_f - mate.r_a
            deeper = f"raise a = {self.a / mm:g} mm or reduce d_f of the {name}"
            got = f"got {clearance / mm:g} mm; {deeper}"
            require(clearance > 0, f"tip clearance at the {name}'s root must be > 0, {got}")
        j, rounding = self._backlash_at(self.a), ROUNDING * self.pinion.m_n
        looser = f"raise a = {self.a / mm:.6g} mm or reduce s_n"
        require(j > -rounding, f"backlash must be >= 0, got {j / mm:.4g} mm on the line of action; {looser}")

    @property
    def a_without_backlash(self) -> float:
        """Centre distance at which the teeth fill each other's spaces [m]; at least the sum of the base radii."""
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
            "d_Nf2": 2 * hypot(wheel.r_b, length - end),
            "d_Na2": 2 * hypot(wheel.r_b, length - start),
            "K_gf": (self.roll_pitch - start) * (1 / r_w1 + 1 / r_w2),
            "K_ga": (end - self.roll_pitch) * (1 / r_w1 + 1 / r_w2),
            "zeta_f1": specific_sliding(start, length - start, u),
            "zeta_f2": specific_sliding(length - end, end, 1 / u),
        }
        return DataSheet(repr(self), listed(PAIR, self, sizes))


def specific_sliding(roll: float, mate_roll: float, u: float) -> float:
    """Specific sliding of a flank at its roll length and that of the mating flank [m]; u = z_mate / z."""
    return 1 - mate_roll / (u * roll) if roll > 0 else -inf
