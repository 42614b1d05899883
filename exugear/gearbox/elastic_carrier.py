"""Carriers of planetary sets that yield: stiffness between the pins of the planets, mounted on the carrier's shaft.

In statics the pins have coordinates of their own (`exugear.load_factors.elastic_statics`). In runs the carrier is in
series with each pin: with the stiffness K_b of the bearing and the compliance C of the carrier at its pin, both over
the motion of the planet against the rigid carrier, K = K_b (1 + C K_b)^-1. That leaves out how one pin moves the
others, and pins are the same in all directions across their axis; `series_error` bounds what this changes.
"""

from collections.abc import Mapping, Sequence
from math import inf
from typing import NamedTuple

import numpy as np

from exugear.gearbox.bearing import Bearing, about_pole
from exugear.gearbox.housing import PER_SEAT, Housing, SeatCoupling, check_seats, seat_coupling, seat_label
from exugear.gearbox.shaft import Shaft
from fem.support.validation import require

#: Largest share by which the energy of a deflection of the pins may change where each stands in series alone.
LARGEST_ERROR = 0.01
#: Common twist over the turns of the pins under their own forces, below which it is rounding.
LEAST_SHARE = 1e-9
#: Share of the largest diagonal entry below which a pin does not resist a motion.
FREE = 1e-12


class SeriesPin(NamedTuple):
    """Stiffness and damping (6, 6) of a bearing and the carrier below it, the same in all directions about the pin."""

    stiffness: np.ndarray
    damping: np.ndarray

    def at(self, lever: float) -> "SeriesPin":
        """About a pole on the planet's axis, at an axial distance of the bearing from it [m]."""
        return SeriesPin(about_pole(self.stiffness, lever), about_pole(self.damping, lever))


def check_carrier(stiffness: Housing, carrier: Shaft, planets: Sequence[Shaft]) -> None:
    """Require that the seats are those of planets on pins, or of bearings of a carrier without sections."""
    check_seats(stiffness, [*planets, carrier], "carrier_stiffness")
    seated = [seat_label(seat) for seat in stiffness.seats if seat[0] == carrier.name]
    twice = f"carrier_stiffness has the seats {seated}, but the carrier {carrier.name!r} has sections, which yield too"
    require(not seated or not carrier.sections, f"{twice}; leave its sections out, or these seats")


def pins_in_series(stiffness: Housing, planets: Sequence[Shaft]) -> dict[str, SeriesPin]:
    """Each planet's bearing in series with the carrier below it, by the name of the planet; of those with seats."""
    coupling = _coupling(stiffness, planets)
    return {name: _series(coupling, number) for number, (name, _) in enumerate(stiffness.seats)}


def series_error(stiffness: Housing, planets: Sequence[Shaft]) -> float:
    """Largest share by which the energy of a deflection of the pins differs where each stands in series alone."""
    coupling, pins = _coupling(stiffness, planets), pins_in_series(stiffness, planets)
    apart = np.zeros_like(coupling.stiffness)
    for number, (name, _) in enumerate(stiffness.seats):
        part = slice(PER_SEAT * number, PER_SEAT * (number + 1))
        apart[part, part] = pins[name].stiffness
    values, vectors = np.linalg.eigh(apart / np.outer(scale := _scale(apart), scale))
    resisting = values > FREE
    root = (vectors[:, resisting] / np.sqrt(values[resisting])) / scale[:, None]
    return float(np.abs(np.linalg.eigvalsh(root.T @ (coupling.stiffness - apart) @ root)).max())


def common_twist(stiffness: Housing, arms: Mapping[str, np.ndarray]) -> float:
    """Stiffness [N m/rad] of the twist common to all pins, by which tangential forces on pins turn the others.

    arms   (2,) of each planet's pin from the axis of the carrier [m]

    inf where they turn none.
    """
    moves, n = np.flatnonzero(stiffness.over_six.ravel()), len(stiffness.seats)
    compliance = np.zeros((PER_SEAT * n,) * 2)
    compliance[np.ix_(moves, moves)] = np.linalg.inv(stiffness.seat_stiffness)
    forces = np.zeros((n, PER_SEAT))
    for force, (name, _) in zip(forces, stiffness.seats, strict=True):
        x, y = arms[name]
        force[:2] = np.array([-y, x]) / (n * (x**2 + y**2))
    by_pins = np.einsum("ic,icjd,jd->ij", forces, compliance.reshape(n, PER_SEAT, n, PER_SEAT), forces)
    twist = float(by_pins.sum() - by_pins.trace())
    return (1 - 1 / n) / twist if twist > LEAST_SHARE * by_pins.trace() else inf


def check_series(stiffness: Housing, carrier: Shaft, planets: Sequence[Shaft], arms: Mapping[str, np.ndarray]) -> None:
    """ValueError where runs cannot have the carrier in series with its pins; arms: as in `common_twist`."""
    seated = [seat_label(seat) for seat in stiffness.seats if seat[0] == carrier.name]
    statics = "exugear.load_distribution takes the whole matrix"
    beside = f"runs have no seats of bearings on the carrier {carrier.name!r} itself, got {seated}"
    require(not seated, f"{beside}; {statics}, leave these seats out for runs")
    of_pins: Mapping[str, Shaft] = {shaft.name: shaft for shaft in planets}
    unlike = [
        name
        for name, _ in stiffness.seats
        for bearing in of_pins[name].bearings.values()
        if not (isinstance(bearing, Bearing) and bearing.linear)
    ]
    rolling = f"runs take carrier_stiffness in series with linear pins, those of {unlike} are not"
    require(not unlike, f"{rolling}; pass pin=Bearing(radial=...) with the tangent under the load")
    error = series_error(stiffness, planets)
    coupled = f"in runs the carrier {carrier.name!r} would stand in series with each pin alone, the same in all"
    coupled = f"{coupled} directions: that changes the energy of the pins by up to {100 * error:.2g} %, more than"
    turn = (
        f"give the twist common to all pins, of {common_twist(stiffness, arms):.3g} N m/rad, to the carrier's shaft by"
    )
    turn = f"{turn} sections or Coupling(torsion=...)"
    require(error <= LARGEST_ERROR, f"{coupled} {100 * LARGEST_ERROR:g} %; {turn}, and pass the rest; {statics}")


def _coupling(stiffness: Housing, planets: Sequence[Shaft]) -> SeatCoupling:
    return seat_coupling(stiffness, planets, [shaft.name for shaft in planets])


def _series(coupling: SeatCoupling, number: int) -> SeriesPin:
    """The pin of a number with the carrier's compliance there, other pins unloaded."""
    housing, part = coupling.housing, slice(PER_SEAT * number, PER_SEAT * (number + 1))
    moves = housing.over_six.ravel()
    compliance = np.zeros_like(coupling.bearings)
    compliance[np.ix_(moves, moves)] = np.linalg.inv(housing.seat_stiffness)
    of_carrier, bearing, damping = compliance[part, part], coupling.bearings[part, part], coupling.damping[part, part]
    yielding = np.linalg.solve(np.eye(PER_SEAT) + of_carrier @ bearing, np.eye(PER_SEAT))
    together = bearing @ yielding
    of_seat = housing.damping_time * together.T @ of_carrier @ together
    return SeriesPin(_isotropic(together), _isotropic(yielding.T @ damping @ yielding + of_seat))


def _isotropic(k: np.ndarray) -> np.ndarray:
    """The mean of a matrix (6, 6) over all directions about z, without rotation about z."""
    radial, tilt = (k[0, 0] + k[1, 1]) / 2, (k[3, 3] + k[4, 4]) / 2
    coupling = (k[0, 4] + k[4, 0] - k[1, 3] - k[3, 1]) / 4
    mean = np.diag([radial, radial, k[2, 2], tilt, tilt, 0.0])
    mean[0, 4] = mean[4, 0] = coupling
    mean[1, 3] = mean[3, 1] = -coupling
    return mean


def _scale(matrix: np.ndarray) -> np.ndarray:
    diagonal = np.sqrt(np.maximum(np.diagonal(matrix), 0.0))
    return np.where(diagonal > 0, diagonal, 1.0)
