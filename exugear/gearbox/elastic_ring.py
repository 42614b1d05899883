"""The rim of a held ring as coordinates: amplitudes of its vibration modes, which the meshes of its planets excite."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from math import pi
from typing import NamedTuple

import numpy as np
import xarray as xr

from exugear.gearbox.elastic_shaft import CAP
from fem.support.validation import require

#: Flanks of the ring in `fem.ring_modes`: those that the driving and the coast flanks of planets press.
FLANKS = "left_flank", "right_flank"
MODE, AT = "ring_mode", "at"
#: What `fem.ring_modes` returns, with its axes.
NEEDED = {
    **dict.fromkeys(("frequency", "lobes", "turning"), (MODE,)),
    **dict.fromkeys(("radial", "tangential", *FLANKS), (MODE, AT)),
}


def check_ring_modes(name: str, value) -> None:
    """ValueError unless a value is what `fem.ring_modes` returns."""
    kind = f"{name} must be what fem.ring_modes(ring_pair) returns, got {type(value).__name__}"
    require(isinstance(value, xr.Dataset), kind)
    missing = [x for x, dims in NEEDED.items() if x not in value or value[x].dims != dims]
    require(not missing, f"{name} must be what fem.ring_modes(ring_pair) returns, it lacks {missing}")
    at = value[AT].values
    even = np.allclose(at, 2 * pi * np.arange(at.size) / at.size)
    require(bool(even), f"{name} must have all angles at of fem.ring_modes around the ring")


class Waves(NamedTuple):
    """Values around the ring at evenly spaced angles (n, m), and their slopes per spacing."""

    values: np.ndarray
    slopes: np.ndarray

    def at(self, angles: np.ndarray) -> np.ndarray:
        """(k, m) values at angles (k,) [rad], by the cubic polynomials of the compiled contact."""
        position = angles * len(self.values) / (2 * pi)
        first = np.floor(position)
        u, i = (position - first)[:, None], first.astype(int) % len(self.values)
        k, v = (i + 1) % len(self.values), 1 - u
        ends = v**2 * (1 + 2 * u) * self.values[i] + u**2 * (1 + 2 * v) * self.values[k]
        return ends + u * v * (v * self.slopes[i] - u * self.slopes[k])


@dataclass(frozen=True, eq=False, repr=False)
class ElasticRing:
    """The rim of a ring by its modes, of modal mass 1 kg.

    Modes above the cap of elastic shafts count by their flexibility alone: their mass is raised until their frequency
    is that of the cap, so that the steps of a run need not follow them.

    name            of its shaft
    modes           of `fem.ring_modes`
    damping_ratio   share of the critical damping in each mode
    """

    name: str
    modes: xr.Dataset
    damping_ratio: float

    def __repr__(self) -> str:
        return f"ElasticRing({self.name!r}, {self.number} modes)"

    @property
    def number(self) -> int:
        """Number of modes."""
        return self.modes.sizes[MODE]

    @cached_property
    def omega(self) -> np.ndarray:
        """(m,) angular frequencies [rad/s]."""
        return 2 * pi * self.modes["frequency"].values

    @cached_property
    def masses(self) -> np.ndarray:
        """(m,) modal masses [kg]."""
        return np.maximum(1.0, (self.omega / CAP) ** 2)

    @cached_property
    def stiffness(self) -> np.ndarray:
        """(m,) modal stiffnesses [N/m]."""
        return self.omega**2

    @cached_property
    def damping(self) -> np.ndarray:
        """(m,) damping [N s/m]."""
        return 2 * self.damping_ratio * self.omega * np.sqrt(self.masses)

    @cached_property
    def flanks(self) -> tuple[Waves, Waves]:
        """Displacement of the pinion's advance per amplitude while its driving, and its coast flanks press the ring."""
        left, right = (_waves(self.modes[flank].values.T) for flank in FLANKS)
        return left, Waves(-right.values, -right.slopes)

    def accelerations(
        self, amplitudes: np.ndarray, rates: np.ndarray, meshes: Iterable[tuple[np.ndarray, np.ndarray]]
    ) -> np.ndarray:
        """(n, m) accelerations of amplitudes (n, m) with their rates.

        meshes   of each planet the mesh force (n,) [N], < 0 on coast flanks, and its position (n,) on the ring [rad]
        """
        total = -rates * self.damping - amplitudes * self.stiffness
        for force, angle in meshes:
            for sign, flank in zip((1.0, -1.0), self.flanks, strict=True):
                pressed = sign * force > 0
                if pressed.any():
                    total[pressed] += force[pressed, None] * flank.at(angle[pressed])
        return total / self.masses

    def loss(self, rates: np.ndarray) -> np.ndarray:
        """(n,) power [W] that damping dissipates, from rates (n, m)."""
        return rates**2 @ self.damping

    def kinetic_energy(self, rates: np.ndarray) -> np.ndarray:
        """(n,) [J] from rates (n, m)."""
        return rates**2 @ self.masses / 2

    def strain_energy(self, amplitudes: np.ndarray) -> np.ndarray:
        """(n,) [J] from amplitudes (n, m)."""
        return amplitudes**2 @ self.stiffness / 2


def _waves(values: np.ndarray) -> Waves:
    """Values around the ring (n, m) with the slopes of the trigonometric polynomial through them."""
    n = len(values)
    order = np.arange(n // 2 + 1)
    order[-1] = 0
    slopes = np.fft.irfft(2j * pi / n * order[:, None] * np.fft.rfft(values, axis=0), n, axis=0)
    return Waves(np.ascontiguousarray(values), slopes)
