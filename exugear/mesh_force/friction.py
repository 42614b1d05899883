"""Coulomb friction between the teeth as data: the sum over the tooth pairs in contact, over the mesh cycle.

A tooth pair that touches at a distance s beyond the pitch point along the line of action n slides with
(omega_1 - omega_2) s along t = z x n and carries the share w of the force. All tooth pairs together push the wheel with
mu F A along t in the pitch point, A = sum w sign(s), and turn it with mu F B about z, B = sum w |s|; on the pinion act
the opposite force and moment. The gears roll at the pitch point, so that the push does no work there and friction
dissipates the power mu F B |omega_1 - omega_2|.
"""

from dataclasses import dataclass, field
from math import ceil, cos, floor, tan
from typing import Annotated

import numpy as np
import xarray as xr

from exugear.force_table.kernel_records import record_of, record_type
from exugear.mesh_force.friction_coefficient import NiemannFriction, PowerLaw, SchlenkFriction
from exugear.mesh_force.ring_pair import RingPair
from fem.pair.pair import GearPair
from fem.ste.ste_map import PHASE, TORQUE, over_torque_and_phase, pair_of
from fem.support.arguments import Finite, checked
from fem.support.representation import short
from fem.support.validation import require

#: Steps of the tables over a pitch.
STEPS = 512
SHARE, PAIR = "load_share", "pair"
#: Least value of `MeshFriction.speed` [rad/s].
LEAST_SPEED = 0.01
#: Coefficient of friction over cos(beta_b), for the transverse mesh force, as a power law (`PowerLaw`); speed over
#: which friction fades [rad/s]; tangent of the working pressure angle; number of steps of the tables.
FRICTION = record_type(
    *((name, "f8") for name in PowerLaw._fields), ("speed", "f8"), ("tan_alpha_wt", "f8"), ("steps", "i8")
)
LAWS = SchlenkFriction, NiemannFriction
Coefficient = float | SchlenkFriction | NiemannFriction


def check_path(name: str, pair) -> None:
    """ValueError for a pair whose path of contact is not known."""
    remedy = "a ring has no path of contact: pass the tables, MeshFriction(coefficient, pull, lever)"
    require(isinstance(pair, GearPair), f"{name} must be a fem.GearPair, got {type(pair).__name__}; {remedy}")


@checked
@short(lever="mm", speed="rad/s")
@dataclass(frozen=True, eq=False)
class MeshFriction:
    """Friction of a gear mesh; the tables hold the driving flank, the back flank is its mirror image.

    coefficient  Coulomb's coefficient of friction mu, of the normal force: a number, or the law of `SchlenkFriction` or
                 `NiemannFriction`, by which it follows the mesh force and the speed
    pull         (n,) share of the load beyond the pitch point minus the share before it, over phases i / n
    lever        (n,) mean distance of the load from the pitch point [m], over phases i / n
    speed        [rad/s] over which friction fades at low speed, by the factor tanh((omega_1 - omega_2) / speed)

    The tables are interpolated linearly between the phases and hold at the nominal centre distance. The direction of
    sliding follows from omega_1 - omega_2 alone: where teeth vibrate faster along their flanks than they slide, next to
    the pitch point, the friction does not change its sign. Raises ValueError for tables out of range.
    """

    coefficient: Coefficient
    pull: np.ndarray
    lever: np.ndarray
    speed: float = field(default=1.0, kw_only=True)

    def __post_init__(self):
        for name in ("pull", "lever"):
            table = np.array(getattr(self, name), float)
            table.setflags(write=False)
            object.__setattr__(self, name, table)
        _check_scalars(self.coefficient, self.speed)
        _check_tables(self.pull, self.lever)

    @classmethod
    @checked
    def of_pair(
        cls, pair: Annotated[GearPair, check_path], coefficient: Coefficient, *, speed: float = 1.0
    ) -> "MeshFriction":
        """Friction of a pair whose load is spread evenly over the width and, in each section, over the tooth pairs.

        Its loss is that of Ohlendorf's tooth loss factor. In helical gears the load is spread rather evenly over all
        contact lines and the loss is higher: use `from_ste`.

        Raises ValueError for a ring gear, whose path of contact is not known.
        """
        start, end = _contact(_tooth_positions(pair), pair)
        total = np.zeros((3, STEPS))
        for low, high, number in _sections(pair):
            total += np.sum(_integrals(start, end, low, high), axis=1) / number
        width, pull, lever = total
        return cls(coefficient, pull / width, lever / width * pair.p_bt, speed=speed)

    @classmethod
    @checked
    def from_ste(
        cls, ste: xr.Dataset, coefficient: Coefficient, *, torque: float, speed: float = 1.0
    ) -> "MeshFriction":
        """Friction by the load shares of an STE map at a pinion torque [N m], even over the width of each tooth pair.

        A tooth pair that carries load before the path of contact begins or after it ends, because teeth deflect,
        counts as in contact at that end of the path. Raises ValueError for a map without load_share or with further
        axes, and for a torque outside the map.
        """
        over_torque_and_phase(ste)
        pair = pair_of(ste)
        position = _tooth_positions(pair)
        share = _shares(ste, torque, position)
        width, pull, lever = _integrals(*_contact(position, pair), *_path(pair))
        on, end = width > 0, np.clip(position, *_path(pair))
        width = np.where(on, width, 1.0)
        pull, lever = np.where(on, pull / width, np.sign(end)), np.where(on, lever / width, np.abs(end))
        pull, lever = ((share * x).sum(axis=0) / share.sum(axis=0) for x in (pull, lever))
        return cls(coefficient, pull, lever * pair.p_bt, speed=speed)

    @checked
    def power_law(self, pair: GearPair | RingPair) -> PowerLaw:
        """The coefficient of a pair as a power law of mesh force and speed; a number has the exponent 0."""
        law = self.coefficient
        return law.power_law(pair) if isinstance(law, LAWS) else PowerLaw(law)

    @checked
    def loss(self, pair: GearPair | RingPair, *, force: Finite = 0.0, speed: Finite = 0.0) -> float:
        """Share of the power that friction dissipates in a mesh of the pair, at constant mesh force and speed.

        A coefficient that follows a law is that at a mesh force [N] and a speed of the pinion [rad/s].
        """
        turns = abs(1 / pair.pinion.r_b + 1 / pair.wheel.r_b)
        coefficient = self.power_law(pair).at(abs(force), speed * pair.pinion.r_b * turns)
        return float(coefficient / cos(pair.beta_b) * self.lever.mean() * turns)

    @checked
    def table(self, pair: GearPair | RingPair) -> np.record:
        """The record that `exugear.kernels.friction_kernels` read for a pair: `FRICTION`, behind it the tables."""
        n, law = self.pull.size, self.power_law(pair)
        transverse = law._replace(factor=law.factor / cos(pair.beta_b))
        head = record_of(FRICTION, **transverse._asdict(), speed=self.speed, tan_alpha_wt=tan(pair.alpha_wt), steps=n)
        kind = record_type(("head", FRICTION), ("pull", "f8", n), ("lever", "f8", n))
        return record_of(kind, head=head, pull=self.pull, lever=self.lever)


def _path(pair: GearPair) -> tuple[float, float]:
    """Ends of the path of contact, in pitches beyond the pitch point."""
    return (pair.roll_start - pair.roll_pitch) / pair.p_bt, (pair.roll_end - pair.roll_pitch) / pair.p_bt


def _tooth_positions(pair: GearPair) -> np.ndarray:
    """(n_pair, STEPS) positions of the tooth pairs in mid-plane, in pitches beyond the pitch point."""
    low, high = _path(pair)
    number = np.arange(floor(low - pair.eps_beta) - 1, ceil(high + pair.eps_beta) + 2)
    return number[:, None] + np.arange(STEPS) / STEPS


def _contact(position: np.ndarray, pair: GearPair) -> tuple[np.ndarray, np.ndarray]:
    """Positions of tooth pairs at both ends of the width; those of spur gears are a step of the table apart."""
    half = max(pair.eps_beta, 1 / STEPS) / 2
    return position - half, position + half


def _sections(pair: GearPair) -> list[tuple[float, float, float]]:
    """Sections of the path of contact, as (start, end, number of tooth pairs in contact)."""
    low, high = _path(pair)
    pitches = np.arange(ceil(high - low) + 1)
    ends = np.unique(np.r_[low + pitches, high - pitches].clip(low, high))
    middle = (ends[:-1] + ends[1:]) / 2
    number = np.floor(high - middle) + np.floor(middle - low) + 1
    return list(zip(ends[:-1], ends[1:], number, strict=True))


def _integrals(start: np.ndarray, end: np.ndarray, low: float, high: float) -> tuple[np.ndarray, ...]:
    """Integrals of 1, sign(x) and |x| from start to end, over the part between low and high."""
    p, q = np.clip(start, low, high), np.clip(end, low, high)
    return q - p, np.abs(q) - np.abs(p), (q * np.abs(q) - p * np.abs(p)) / 2


def _shares(ste, torque: float, position: np.ndarray) -> np.ndarray:
    """Load shares of tooth pairs at positions in mid-plane, in pitches beyond the pitch point, linear in the map."""
    require(SHARE in ste, f"the map must have {SHARE}; make it with fem.static_transmission_error, or use of_pair")
    given, phase = ste[TORQUE].values, ste[PHASE].values
    within = f"torque must lie in ({max(0.0, given[0]):g}, {given[-1]:g}] N m of the map, got {torque}"
    require(torque > 0 and given[0] <= torque <= given[-1], f"{within}; extend the map")
    near = np.array([np.interp(torque, given, hat) for hat in np.eye(given.size)])
    known = np.tensordot(near, ste[SHARE].transpose(TORQUE, PHASE, PAIR).values, 1)
    pairs = ste[PAIR].values
    number = np.arange(pairs.min() - 1, pairs.max() + 2)
    share = np.zeros((number.size, phase.size))
    share[pairs - number[0]] = known.T
    return np.interp(position, (number[:, None] + phase).ravel(), share.ravel(), left=0.0, right=0.0)


def _check_scalars(coefficient: Coefficient, speed: float) -> None:
    low = f"coefficient must lie in [0, 1), say 0.05, got {coefficient}"
    require(isinstance(coefficient, LAWS) or 0 <= coefficient < 1, low)
    slow = f"speed must be at least {LEAST_SPEED} rad/s and finite, got {speed}; take a hundredth of the shafts'"
    require(LEAST_SPEED <= speed < np.inf, slow)


def _check_tables(pull: np.ndarray, lever: np.ndarray) -> None:
    fits = pull.ndim == 1 and pull.shape == lever.shape and pull.size > 0
    require(fits, f"pull and lever must be (n,) over the same phases i / n, got {pull.shape} and {lever.shape}")
    most = np.abs(pull).max()
    require(bool(most <= 1 + 1e-9), f"pull must lie in [-1, 1], as the shares add up to 1, got {most:g}")
    low, high = lever.min(), lever.max()
    arm = f"lever must lie in [0, 1) m, a distance, got {low:g} to {high:g}; pass metres: 5*mm"
    require(bool(low >= 0 and high < 1), arm)
