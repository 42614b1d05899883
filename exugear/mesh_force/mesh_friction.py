"""Coulomb friction between the teeth as data: the sum over the tooth pairs in contact, over the mesh cycle.

A tooth pair that touches at a distance s beyond the pitch point along the line of action n slides with
(omega_1 - omega_2) s along t = z x n and carries the share w of the force. All tooth pairs together push the wheel with
mu F A along t in the pitch point, A = sum w sign(s), and turn it with mu F B about z, B = sum w |s|; on the pinion act
the opposite force and moment. The gears roll at the pitch point, so that the push does no work there and friction
dissipates the power mu F B |omega_1 - omega_2|.
"""

from dataclasses import dataclass, field
from math import cos, isclose, nan, tan
from typing import Annotated, Any

import numpy as np
import xarray as xr

from exugear.mesh_force.friction_coefficient import (
    NiemannFriction,
    PowerLaw,
    SchlenkFriction,
    XuFriction,
    check_fading_speed,
)
from exugear.mesh_force.kernel_records import record_of, record_type
from exugear.mesh_force.load_distribution import (
    LoadDistribution,
    even_distribution,
    mapped_distribution,
    sign_and_distance,
)
from exugear.mesh_force.ring_pair import RingPair
from fem.pair.pair import GearPair
from fem.ste.ste_map import pair_of, pitches_of
from fem.support.arguments import Finite, checked
from fem.support.representation import short
from fem.support.validation import increasing, require, set_fields

#: Coefficient of friction over cos(beta_b), for the transverse mesh force, as a power law (`PowerLaw`); speed over
#: which friction fades [rad/s]; tangent of the working pressure angle; number of steps and of rows of the tables, ln of
#: the force of their first row and difference to that of the next one.
FRICTION = record_type(
    *((name, "f8") for name in (*PowerLaw._fields, "speed", "tan_alpha_wt")),
    *(("steps", "i8"), ("rows", "i8"), ("log_first", "f8"), ("log_step", "f8"), ("per_pitches", "f8")),
)
LAWS = SchlenkFriction, NiemannFriction, XuFriction
Coefficient = float | SchlenkFriction | NiemannFriction | XuFriction
#: Loads per face width [N/m] for which the tables of a local coefficient are made; points of each piece of a contact
#: line, of which the coefficient is the mean.
LINE_LOADS, POINTS = np.geomspace(3e3, 3e6, 19), 8


def check_path(name: str, pair) -> None:
    """ValueError for a pair whose path of contact is not known."""
    tables = "a ring has no path of contact: pass the tables, MeshFriction(coefficient, pull, lever)"
    remedy = f"{tables}, or take fem.GearPair(planet, ring)"
    require(isinstance(pair, GearPair), f"{name} must be a fem.GearPair, got {type(pair).__name__}; {remedy}")


@checked
@short(lever="mm", speed="rad/s")
@dataclass(frozen=True, eq=False)
class MeshFriction:
    """Friction of a gear mesh; the tables hold the driving flank, the back flank is its mirror image.

    coefficient  Coulomb's coefficient of friction mu, of the normal force: a number, or the law of `SchlenkFriction`,
                 `NiemannFriction` or `XuFriction`, by which it follows the mesh force and the speed
    pull         (n,) share of the load beyond the pitch point on the path of contact minus the share before it, over
                 phases i / n of the pitches
    lever        (n,) mean distance of the load from the pitch point [m], over the same phases
    forces       (m,) mesh forces [N] in geometric progression, of the rows of pull and lever (m, n) for a local
                 coefficient (`XuFriction`), by which these are multiplied already
    speed        [rad/s] over which friction fades at low speed, by the factor tanh((omega_1 - omega_2) / speed)
    pair         `fem.GearPair` to which the tables belong; None: any, as of tables from elsewhere
    pitches      over which the phases of the tables run

    The tables are interpolated linearly between the phases and hold at the nominal centre distance. The direction of
    sliding follows from omega_1 - omega_2 alone: where teeth vibrate faster along their flanks than they slide, next to
    the pitch point, the friction does not change its sign. Raises ValueError for tables out of range.
    """

    coefficient: Coefficient
    pull: np.ndarray
    lever: np.ndarray
    speed: float = field(default=1.0, kw_only=True)
    forces: np.ndarray | None = field(default=None, kw_only=True)
    pair: GearPair | None = field(default=None, kw_only=True, repr=False)
    pitches: int = field(default=1, kw_only=True)

    def __post_init__(self):
        require(self.pitches >= 1, f"pitches must be at least 1, a whole number, got {self.pitches}")
        for name in ("pull", "lever", *["forces"] * (self.forces is not None)):
            table = np.array(getattr(self, name), float)
            table.setflags(write=False)
            set_fields(self, **{name: table})
        _check_scalars(self.coefficient, self.speed)
        _check_tables(self.pull, self.lever)
        _check_forces(self)

    @classmethod
    @checked
    def of_pair(
        cls, pair: Annotated[GearPair, check_path], coefficient: Coefficient, *, speed: float = 1.0
    ) -> "MeshFriction":
        """Friction of a pair whose load is spread evenly over the width and, in each section, over the tooth pairs.

        Its loss is that of Ohlendorf's tooth loss factor. In helical gears the load is spread rather evenly over all
        contact lines and the loss is higher: use `from_ste`.

        Raises ValueError for a `RingPair`, whose path of contact is not known.
        """
        return cls(coefficient, **_tables(coefficient, pair, even_distribution(pair)), speed=speed, pair=pair)

    @classmethod
    @checked
    def from_ste(
        cls, ste: xr.Dataset, coefficient: Coefficient, *, torque: float, speed: float = 1.0
    ) -> "MeshFriction":
        """Friction by the load shares of an STE map at a pinion torque [N m], even over the width of each tooth pair.

        The shares are those of the left flanks; the coast flank has them too, as mirror image.
        A tooth pair that carries load before the path of contact begins or after it ends, because teeth deflect,
        counts as in contact at that end of the path. Raises ValueError for a map without load_share or with further
        axes, and for a torque outside the map.
        """
        distribution = mapped_distribution(ste, torque)
        pair = pair_of(ste)
        tables = _tables(coefficient, pair, distribution)
        return cls(coefficient, **tables, speed=speed, pair=pair, pitches=pitches_of(ste))

    @checked
    def power_law(self, pair: GearPair | RingPair) -> PowerLaw:
        """The coefficient of a pair as a power law of mesh force and speed; a number has the exponent 0.

        The tables for a local coefficient (`XuFriction`) are multiplied by it already; its power law is the factor by
        which it changes with the speed.
        """
        law = self.coefficient
        return law.power_law(pair) if isinstance(law, LAWS) else PowerLaw(law)

    @checked
    def loss(self, pair: GearPair | RingPair, *, force: Finite | None = None, speed: Finite | None = None) -> float:
        """Share of the power that friction dissipates in a mesh of the pair, at constant mesh force and speed.

        force   mesh force [N], and
        speed   of the pinion [rad/s], at which a coefficient that follows a law is taken

        Raises ValueError where such a law lacks them, and for a pair to which the tables do not belong.
        """
        self.check_pair(pair)
        needed = f"force and speed must be given, as the coefficient is {self.coefficient!r}"
        require(not isinstance(self.coefficient, LAWS) or None not in (force, speed), f"{needed}; pass N and rad/s")
        force, speed = force or 0.0, speed or 0.0
        turns = abs(1 / pair.pinion.r_b + 1 / pair.wheel.r_b)
        coefficient = self.power_law(pair).at(abs(force), speed * pair.pinion.r_b * turns)
        lever = self.lever.mean(axis=-1)
        if self.forces is not None:
            lever = np.interp(np.log(max(abs(force), self.forces[0])), np.log(self.forces), lever)
        return float(coefficient / cos(pair.beta_b) * lever * turns)

    @checked
    def check_pair(self, pair: GearPair | RingPair) -> None:
        """ValueError unless the tables belong to a pair with these teeth, tip circles, widths and centre distance."""
        if self.pair is not None:
            remedy = "make it by MeshFriction.of_pair or from_ste"
            require_same_pair(self.pair, pair, "to which the friction belongs", remedy)

    @checked
    def table(self, pair: GearPair | RingPair) -> np.record:
        """The record that `exugear.contact.friction` reads for a pair: `FRICTION`, behind it the tables.

        Raises ValueError for a pair to which the tables do not belong.
        """
        self.check_pair(pair)
        law, (rows, steps) = self.power_law(pair), np.atleast_2d(self.pull).shape
        values = law._replace(factor=law.factor / cos(pair.beta_b))._asdict() | {"speed": self.speed}
        logarithms = np.log(self.forces) if self.forces is not None else np.zeros(2)
        values |= {"log_first": logarithms[0], "log_step": logarithms[1] - logarithms[0]}
        head = record_of(
            FRICTION, **values, tan_alpha_wt=tan(pair.alpha_wt), steps=steps, rows=rows, per_pitches=1 / self.pitches
        )
        kind = record_type(("head", FRICTION), ("pull", "f8", (rows, steps)), ("lever", "f8", (rows, steps)))
        return record_of(kind, head=head, pull=self.pull, lever=self.lever)


def _tables(coefficient: Coefficient, pair: GearPair, distribution: LoadDistribution) -> dict[str, Any]:
    """pull, lever and, for a local coefficient, forces of a friction."""
    if not isinstance(coefficient, XuFriction):
        pull, distance = sign_and_distance(distribution)
        return {"pull": pull, "lever": distance * pair.p_bt}
    start, end, share, line_load = distribution
    tables = np.zeros((2, LINE_LOADS.size, share.shape[1]))
    for number in range(POINTS):
        distance = (start + (end - start) * (number + 0.5) / POINTS) * pair.p_bt
        for pull, lever, load in zip(*tables, LINE_LOADS, strict=True):
            rubbing = share / POINTS * coefficient.local(pair, distance, load * line_load)
            pull += (rubbing * np.sign(distance)).sum(axis=0)
            lever += (rubbing * np.abs(distance)).sum(axis=0)
    return {"pull": tables[0], "lever": tables[1], "forces": LINE_LOADS * pair.b}


def require_same_pair(expected: GearPair | RingPair, pair: GearPair | RingPair, reason: str, remedy: str) -> None:
    """ValueError unless a pair has the teeth, tip circles, widths and centre distance expected, for a reason."""
    geometry, given = _geometry(expected), _geometry(pair)
    differing = [name for name in geometry if not isclose(geometry[name], given.get(name, nan), rel_tol=1e-9)]
    differences = f"got {pair}, which differs in {', '.join(differing)}"
    require(not differing, f"pair must be {expected}, {reason}, {differences}; {remedy}")


def _geometry(pair: GearPair | RingPair) -> dict[str, float]:
    """What friction depends on, by its name: of the gears, and the centre distance."""
    gears = {"pinion": pair.pinion} | ({"wheel": pair.wheel} if isinstance(pair, GearPair) else {})
    names = "z", "m_n", "alpha_n", "beta", "b", "s_n", "d_a"
    values = {f"{name} of the {side}": getattr(gear, name) for side, gear in gears.items() for name in names}
    return values | {"a": pair.a} | ({} if isinstance(pair, GearPair) else {"z of the ring": pair.z})


def _check_scalars(coefficient: Coefficient, speed: float) -> None:
    low = f"coefficient must lie in [0, 1), say 0.05, got {coefficient}"
    require(isinstance(coefficient, LAWS) or 0 <= coefficient < 1, low)
    check_fading_speed(speed)


def _check_tables(pull: np.ndarray, lever: np.ndarray) -> None:
    fits = pull.ndim in (1, 2) and pull.shape == lever.shape and pull.size > 0
    require(fits, f"pull and lever must be (n,) over the same phases i / n, got {pull.shape} and {lever.shape}")
    most = np.abs(pull).max()
    require(bool(most <= 1 + 1e-9), f"pull must lie in [-1, 1], as the shares add up to 1, got {most:g}")
    low, high = lever.min(), lever.max()
    arm = f"lever must lie in [0, 1) m, a distance, got {low:g} to {high:g}; pass metres: 5*mm"
    require(bool(low >= 0 and high < 1), arm)


def _check_forces(friction: MeshFriction) -> None:
    """ValueError unless tables over mesh forces belong to a local coefficient, and single rows to a mean one."""
    local, forces, shape = isinstance(friction.coefficient, XuFriction), friction.forces, friction.pull.shape
    remedy = "make it with MeshFriction.of_pair or from_ste"
    given = f"forces and pull (m, n) belong to a XuFriction and to no other coefficient; {remedy}"
    require(local == (forces is not None) == (len(shape) == 2), given)
    if forces is not None:
        increasing("forces", forces, least=2)
        steps = np.diff(np.log(forces))
        require(forces.shape == shape[:1], f"forces must be (m,) for pull (m, n), got {forces.shape} and {shape}")
        require(bool(forces[0] > 0 and np.ptp(steps) < 1e-6), f"forces must be a geometric progression > 0 N; {remedy}")
