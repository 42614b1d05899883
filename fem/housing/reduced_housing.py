"""A housing reduced to the seats of bearings: its stiffness, its response to forces on them, and its radiated power.

Radiated power is the equivalent one (ERP): every part of the surface radiates as a piston, rho c/2 sum A |v_n|^2, an
upper estimate below the coincidence frequency.
"""

from dataclasses import dataclass
from math import pi
from typing import Annotated, Any

import numpy as np

from fem.support.arguments import Finite, Numbers, checked
from fem.support.user_warning import warn_user
from fem.support.validation import require, require_finite, text_of

__all__ = ["ReducedHousing"]

#: Coordinates of a seat: x, y, z and rotations about x, y, z.
PER_SEAT = 6
#: Density [kg/m^3] and speed of sound [m/s] of air.
AIR = 1.204, 343.2


def complex_numbers(name: str, values: Any) -> None:
    """ValueError unless the values are real or complex numbers in rows of equal length."""
    try:
        kind = np.asarray(values).dtype.kind
    except (TypeError, ValueError):
        kind = "O"
    require(kind in "fiuc", f"{name} must hold real or complex numbers, got {text_of(values)}")


Amplitudes = Annotated[Any, complex_numbers]


@dataclass(frozen=True, eq=False, repr=False)
class ReducedHousing:
    """A housing over the motions of its seats, 6 each, and the amplitudes of m modes while the seats stand.

    stiffness    (6 n + m, 6 n + m) [N/m, N, N m]; between the seats alone its first 6 n rows and columns
    mass         (6 n + m, 6 n + m) [kg, kg m, kg m^2], modes have a modal mass of 1
    centres      (n, 3) of the seats [m], about which they turn
    frequencies  natural frequencies [Hz] of the whole housing, its seats free, by the finite elements
    errors       relative errors of these of the reduced model: by the modes that are left out
    areas        (n_facet,) of the parts of the surface [m^2]
    velocities   (n_facet, 6 n + m) normal velocity of each by the rates of the coordinates
    """

    stiffness: np.ndarray
    mass: np.ndarray
    centres: np.ndarray
    frequencies: np.ndarray
    errors: np.ndarray
    areas: np.ndarray
    velocities: np.ndarray

    def __repr__(self) -> str:
        worst = f"frequencies up to {self.frequencies[-1]:.4g} Hz within {np.abs(self.errors).max():.2g}"
        return f"ReducedHousing({len(self.centres)} seats, {self.modes} modes, {worst})"

    @property
    def modes(self) -> int:
        """Number of modes."""
        return len(self.stiffness) - PER_SEAT * len(self.centres)

    @property
    def highest_mode(self) -> float:
        """Frequency [Hz] of the highest mode while the seats stand, beyond which responses lack modes."""
        return float(np.sqrt(np.diagonal(self.stiffness)[PER_SEAT * len(self.centres) :].max()) / (2 * pi))

    @property
    def seat_stiffness(self) -> np.ndarray:
        """(6 n, 6 n) static stiffness between the seats."""
        n = PER_SEAT * len(self.centres)
        return self.stiffness[:n, :n]

    @checked
    def response(self, frequency: Numbers, forces: Amplitudes, *, damping_ratio: Finite = 0.02) -> np.ndarray:
        """(n_frequency, 6 n + m) complex amplitudes of the coordinates under harmonic forces on the seats.

        frequency      (n_frequency,) > 0 [Hz]; a warning says so where the reduction has no modes any more
        forces         (n_frequency, 6 n) amplitudes of forces and moments on the seats [N, N m]; may be complex
        damping_ratio  of the housing, in [0, 0.5): a loss factor of twice that
        """
        at, n = np.atleast_1d(np.asarray(frequency, float)), PER_SEAT * len(self.centres)
        pushed = np.atleast_2d(np.asarray(forces))
        require(bool((at > 0).all()), f"frequency must be > 0 Hz, got {at.min():g}")
        require(0 <= damping_ratio < 0.5, f"damping_ratio must lie in [0, 0.5), got {damping_ratio:g}")
        shape = f"forces must be ({at.size}, {n}), 6 for each of {len(self.centres)} seats, got {pushed.shape}"
        require(pushed.shape == (at.size, n), shape)
        require_finite("forces", np.abs(pushed))
        beyond = f"frequency {at.max():.4g} Hz lies beyond the modes of the reduction, the highest at"
        if at.max() > self.highest_mode:
            warn_user(f"{beyond} {self.highest_mode:.4g} Hz: the response lacks those above; reduce with more modes=")
        load = np.zeros((at.size, len(self.stiffness)), complex)
        load[:, :n] = pushed
        stiffness = (1 + 2j * damping_ratio) * self.stiffness
        dynamic = stiffness - (2 * pi * at)[:, None, None] ** 2 * self.mass
        return np.linalg.solve(dynamic, load[..., None])[..., 0]

    @checked
    def surface_velocity(self, frequency: Numbers, forces: Amplitudes, *, damping_ratio: Finite = 0.02) -> np.ndarray:
        """(n_frequency, n_facet) complex amplitudes of the normal velocity [m/s]; arguments as of `response`."""
        omega = 2 * pi * np.atleast_1d(np.asarray(frequency, float))
        return 1j * omega[:, None] * (self.response(frequency, forces, damping_ratio=damping_ratio) @ self.velocities.T)

    @checked
    def radiated_power(self, frequency: Numbers, forces: Amplitudes, *, damping_ratio: Finite = 0.02) -> np.ndarray:
        """(n_frequency,) equivalent radiated power [W] into air, mean over time; arguments as of `response`.

        The level is 10 lg(P / 1e-12 W). All of the surface counts, inside and outside.
        """
        velocity = self.surface_velocity(frequency, forces, damping_ratio=damping_ratio)
        return self._power_of(velocity)

    @checked
    def power_of_motion(self, rates: Amplitudes) -> np.ndarray:
        """(n_frequency,) equivalent radiated power [W] of known motion, as `radiated_power`.

        rates   (n_frequency, 6 n + m) complex amplitudes of the rates of the coordinates [m/s, rad/s]
        """
        moving = np.atleast_2d(np.asarray(rates))
        shape = f"rates must be (n_frequency, {len(self.stiffness)}), got {moving.shape}"
        require(moving.ndim == 2 and moving.shape[1] == len(self.stiffness), shape)
        require_finite("rates", np.abs(moving))
        return self._power_of(moving @ self.velocities.T)

    def _power_of(self, velocity: np.ndarray) -> np.ndarray:
        """(n_frequency,) power [W] of normal velocities (n_frequency, n_facet) [m/s]."""
        density, speed = AIR
        return density * speed / 2 * (np.abs(velocity) ** 2 @ self.areas)
