"""A housing as stiffness between the seats of bearings: seats yield under bearing forces, and one moves the other.

Bearings of a housing act on the displacement p - s of the shaft against its seat. Seats have no mass, so that with the
stiffnesses K_b of linear bearings and K_h of the housing

    s = S p,   S = (K_b + K_h)^-1 K_b,   force on the shafts = -(K p + D dp/dt),   K = K_b (1 - S),
    D = (1 - S)^T D_b (1 - S) + t S^T K_h S

with the damping D_b of the bearings and the damping time t of the housing (static condensation).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import scipy

from exugear.gearbox.bearing import Bearing
from exugear.gearbox.rolling_bearing import RollingBearing
from exugear.gearbox.shaft import Shaft
from fem.housing.reduced_housing import PER_SEAT, ReducedHousing
from fem.support.arguments import FilePath, Finite, checked
from fem.support.validation import numbers, require, require_finite, set_fields, text_of
from fem.units import mm

#: Relative error of a matrix that is rounding; least eigenvalue of a matrix scaled to a unit diagonal.
ROUNDING, LEAST = 1e-6, 1e-12
#: Distance of a seat from its bearing that is rounding [m].
NEAR = 1e-6
#: Damping time [s] from which on another unit is meant.
SLOW = 0.1

Seat = tuple[str, float]


@checked
@dataclass(frozen=True, eq=False, repr=False)
class Housing:
    """Static stiffness of a housing between the seats of bearings, mounted as it stands.

    seats          (name of the shaft, axial position of its bearing [m]) of n seats
    stiffness      (6 n, 6 n) over x, y, z and rotations about x, y, z of each seat, in the axes of the gearbox [N/m, N,
                   N m]; or (3 n, 3 n) over x, y, z, where seats are rigid against rotation; or (6 n + m, 6 n + m) of a
                   reduced model with m amplitudes of modes behind the seats (Craig & Bampton)
    mass           of the same shape, mass of a reduced model over the same coordinates [kg, kg m, kg m^2]: with it the
                   housing vibrates in runs and modes where the plan finds that it matters
    damping_time   damping of the housing over its stiffness [s]
    damping_ratio  of the modes of the housing on its mounts, beside it; needs a mass

    Bearings without a seat stand on ground. Raises ValueError for matrices that are not symmetric or not positive
    definite: a housing that is not mounted has no static stiffness.
    """

    seats: Sequence[Seat]
    stiffness: Any
    mass: Any = field(default=None, kw_only=True)
    damping_time: Finite = field(default=0.0, kw_only=True)
    damping_ratio: Finite = field(default=0.0, kw_only=True)

    def __post_init__(self):
        set_fields(self, seats=_seats_of(self.seats))
        set_fields(self, stiffness=self._matrix("stiffness", self.stiffness))
        if self.mass is not None:
            set_fields(self, mass=self._matrix("mass", self.mass))
            shapes = f"mass must be of the shape {self.stiffness.shape} of the stiffness, got {self.mass.shape}"
            require(self.mass.shape == self.stiffness.shape, shapes)
        light = "damping_ratio is that of the modes of the housing, which need mass=; or pass damping_time="
        require(self.mass is not None or not self.damping_ratio, light)
        low = f"damping_ratio must lie in [0, 0.5), got {self.damping_ratio:g}; 2 % are 0.02"
        require(0 <= self.damping_ratio < 0.5, low)
        late = f"damping_time must lie in [0, {SLOW:g}) s, got {self.damping_time:g}; pass damping / stiffness"
        require(0 <= self.damping_time < SLOW, late)

    def _matrix(self, name: str, values: object) -> np.ndarray:
        n, matrix = len(self.seats), np.array(numbers(name, values))
        sizes = 3 * n, PER_SEAT * n
        square = matrix.ndim == 2 and matrix.shape[0] == matrix.shape[1]
        square = square and (matrix.shape[0] == sizes[0] or matrix.shape[0] >= sizes[1])
        shapes = (
            f"{name} must be ({sizes[1]}, {sizes[1]}) or ({sizes[0]}, {sizes[0]}) for {n} seats, or larger by modes"
        )
        require(square, f"{shapes}, got {matrix.shape}")
        require_finite(name, matrix)
        diagonal = np.diagonal(matrix)
        number = int(diagonal.argmin())
        least = f"{name}[{number}, {number}] must be > 0, got {diagonal[number]:g}"
        require(bool((diagonal > 0).all()), f"{least}; leave out seats that the housing does not hold")
        scale = 1 / np.sqrt(diagonal)
        scaled = matrix * np.outer(scale, scale)
        uneven = f"{name} must be symmetric, it differs from its transpose by {np.abs(scaled - scaled.T).max():.3g}"
        require(bool(np.abs(scaled - scaled.T).max() < ROUNDING), f"{uneven} of its diagonal")
        smallest = float(np.linalg.eigvalsh((scaled + scaled.T) / 2)[0])
        free = f"{name} must be positive definite, its least eigenvalue over the diagonal is {smallest:.3g}"
        require(smallest > LEAST, f"{free}; fix the housing at its mounts before it is reduced")
        return (matrix + matrix.T) / 2

    def __repr__(self) -> str:
        return f"Housing({', '.join(seat_label(seat) for seat in self.seats)})"

    @classmethod
    @checked
    def from_file(
        cls,
        path: FilePath,
        seats: Sequence[Seat],
        *,
        mass: FilePath | None = None,
        damping_time: Finite = 0.0,
        damping_ratio: Finite = 0.0,
    ) -> "Housing":
        """The housing of a file of another code, reduced to its seats.

        path     .npz with "stiffness" or "K", and "mass" or "M" if it has one; or .mtx, a Matrix Market file
        seats    in the order of the coordinates of the file
        mass     Matrix Market file of the mass matrix; of .npz the file holds it

        Units are N, m, rad, kg. Raises FileNotFoundError, and ValueError for other files and as the class.
        """
        file = Path(path)
        if file.suffix == ".npz":
            require(mass is None, "mass must be left out beside an .npz file, which holds it as 'mass' or 'M'")
            with np.load(file, allow_pickle=False) as stored:
                names = {name: stored[name] for name in stored.files}
            k, m = (next((names[x] for x in pair if x in names), None) for pair in (("stiffness", "K"), ("mass", "M")))
            require(k is not None, f"path must hold 'stiffness' or 'K', {file.name} has {[*names]}")
            return cls(seats, k, mass=m, damping_time=damping_time, damping_ratio=damping_ratio)
        require(file.suffix == ".mtx", f"path must end in .npz or .mtx, got {file.name}")
        matrices = [None if each is None else _matrix_market(Path(each)) for each in (file, mass)]
        return cls(seats, matrices[0], mass=matrices[1], damping_time=damping_time, damping_ratio=damping_ratio)

    @classmethod
    @checked
    def from_reduction(
        cls,
        reduced: ReducedHousing,
        seats: Sequence[Seat],
        *,
        damping_time: Finite = 0.0,
        damping_ratio: Finite = 0.0,
    ) -> "Housing":
        """The housing of a mesh that `fem.reduce_housing` reduced.

        seats   (name of the shaft, axial position [m]) in the order of the reduction; its axes are those of the gearbox

        With its modes: it vibrates in runs where the plan finds that it matters. Raises ValueError as the class.
        """
        damping = {"damping_time": damping_time, "damping_ratio": damping_ratio}
        return cls(seats, reduced.stiffness, mass=reduced.mass, **damping)

    @property
    def over_six(self) -> np.ndarray:
        """(n, 6) whether each coordinate of each seat moves: without rotations where only x, y, z are given."""
        moves = np.ones((len(self.seats), PER_SEAT), bool)
        moves[:, 3:] = len(self.stiffness) >= PER_SEAT * len(self.seats)
        return moves

    @property
    def modes(self) -> int:
        """Number of amplitudes of modes behind the coordinates of the seats."""
        return len(self.stiffness) - int(self.over_six.sum())

    @cached_property
    def seat_stiffness(self) -> np.ndarray:
        """Static stiffness between the seats alone, (6 n, 6 n) or (3 n, 3 n)."""
        n, k = int(self.over_six.sum()), self.stiffness
        return k[:n, :n] - k[:n, n:] @ np.linalg.solve(k[n:, n:], k[n:, :n])

    @property
    def seat_rows(self) -> np.ndarray:
        """(6 n, n_coordinate) motion of the seats by the coordinates of the matrices."""
        moves = np.flatnonzero(self.over_six.ravel())
        rows = np.zeros((PER_SEAT * len(self.seats), len(self.stiffness)))
        rows[moves, np.arange(moves.size)] = 1.0
        return rows


def seat_number(housing: Housing | None, shaft: str, axial: float) -> int | None:
    """Number of the seat of a bearing; None where it stands on ground."""
    seats = () if housing is None else housing.seats
    at = [i for i, (name, position) in enumerate(seats) if name == shaft and abs(position - axial) < NEAR]
    return at[0] if at else None


def seat_label(seat: Seat) -> str:
    """A seat in words."""
    return f"{seat[0]} at {seat[1] / mm:g} mm"


def _seats_of(values: object) -> tuple[Seat, ...]:
    listed = isinstance(values, Sequence) and not isinstance(values, str) and len(values) > 0
    require(listed, f"seats must be a list of (name of a shaft, axial position [m]), got {text_of(values)}")
    seats: list[Seat] = []
    for value in values:  # type: ignore[attr-defined]
        pair = isinstance(value, Sequence) and not isinstance(value, str) and len(value) == 2
        named = pair and isinstance(value[0], str) and isinstance(value[1], int | float | np.floating)
        require(named, f"seats must hold pairs such as ('fast', 20*mm), got {text_of(value)}")
        seats.append((value[0], float(value[1])))
    twice = [seat_label(seat) for seat in seats if seats.count(seat) > 1]
    require(not twice, f"seats {sorted({*twice})} are listed twice")
    return tuple(seats)


def _matrix_market(file: Path) -> np.ndarray:
    matrix = scipy.io.mmread(file)
    return matrix.toarray() if hasattr(matrix, "toarray") else np.asarray(matrix)


def check_seats(housing: Housing, shafts: Sequence[Shaft], argument: str = "housing") -> None:
    """Require that every seat is that of a bearing of these shafts; argument: which has the seats."""
    by_name = {shaft.name: shaft for shaft in shafts}
    for seat in housing.seats:
        name, axial = seat
        known = [seat_label((shaft.name, x)) for shaft in shafts for x in shaft.bearings]
        at = [x for x in by_name[name].bearings if abs(x - axial) < NEAR] if name in by_name else []
        require(bool(at), f"{argument} has a seat {seat_label(seat)}, where no bearing is; bearings are {known}")


@dataclass(frozen=True, eq=False)
class SeatCoupling:
    """Linear bearings on a housing, its seats eliminated, over the 6 n motions of the shafts at the seats.

    housing   the housing
    bearings  (6 n, 6 n) stiffness of the bearings, 0 of seats whose shaft does not move
    damping   (6 n, 6 n) damping of the bearings
    """

    housing: Housing
    bearings: np.ndarray
    damping: np.ndarray

    @cached_property
    def seat_motion(self) -> np.ndarray:
        """(6 n, 6 n) motion of the seats by that of the shafts."""
        moves, motion = np.flatnonzero(self.housing.over_six.ravel()), np.zeros_like(self.bearings)
        total = self.bearings[np.ix_(moves, moves)] + self.housing.seat_stiffness
        motion[moves] = np.linalg.solve(total, self.bearings[moves])
        return motion

    @cached_property
    def against_seats(self) -> np.ndarray:
        """(6 n, 6 n) motion of the shafts against their seats."""
        return np.eye(len(self.bearings)) - self.seat_motion

    @cached_property
    def of_housing(self) -> np.ndarray:
        """(6 n, 6 n) stiffness of the housing by the motion of the shafts."""
        moves = np.flatnonzero(self.housing.over_six.ravel())
        return self.seat_motion[moves].T @ self.housing.seat_stiffness @ self.seat_motion[moves]

    @cached_property
    def stiffness(self) -> np.ndarray:
        """(6 n, 6 n) stiffness of bearings and housing together."""
        whole = self.bearings @ self.against_seats
        return (whole + whole.T) / 2

    @cached_property
    def damping_matrix(self) -> np.ndarray:
        """(6 n, 6 n) damping of bearings and housing together."""
        of_bearings = self.against_seats.T @ self.damping @ self.against_seats
        return of_bearings + self.housing.damping_time * self.of_housing


def seat_coupling(housing: Housing, shafts: Sequence[Shaft], moving: Sequence[str]) -> SeatCoupling:
    """The linear bearings of shafts on a housing; moving: names of the shafts that move on their bearings."""
    by_name, n = {shaft.name: shaft for shaft in shafts}, len(housing.seats)
    stiffness, damping = np.zeros((PER_SEAT * n, PER_SEAT * n)), np.zeros((PER_SEAT * n, PER_SEAT * n))
    for i, seat in enumerate(housing.seats):
        if seat[0] not in moving:
            continue
        bearing = bearing_on(by_name, seat)
        part = slice(PER_SEAT * i, PER_SEAT * (i + 1))
        stiffness[part, part] = bearing.stiffness
        damping[part, part] = bearing.damping_time * bearing.stiffness
    return SeatCoupling(housing, stiffness, damping)


def bearing_on(shafts: Mapping[str, Shaft], seat: Seat) -> Bearing | RollingBearing:
    """The bearing on a seat."""
    name, axial = seat
    return next(bearing for x, bearing in shafts[name].bearings.items() if abs(x - axial) < NEAR)
