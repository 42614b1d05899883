"""Lines at which a planetary set vibrates, in turns of the carrier against the ring, and what excites each of them.

As the planets pass a point of the ring, a mesh harmonic l of planet n, at the angle psi_n, is heard there as
exp(i o (theta + psi_n)) with the orders o = l |z_r| + k, k = 0, +-1, ...: the mesh cycles l |z_r| times per turn, and
its distance from the point comes and goes once per turn. Equal planets add up to the share |sum exp(i o psi_n)| / N.
Evenly spaced they cancel unless o is a multiple of N, which as |z_r| = -z_s mod N is k = l z_s mod N: for k = 0 all
meshes act in phase, for k = +-1 they push sun and ring sideways, for larger k they bend the ring in |k| waves. Errors
of the sun turn past a planet by |z_r| / z_s, those of a planet by |z_r| / |z_p| per turn of the carrier.

Stepped planets with z_1 teeth at the sun and z_2 at the ring mesh with the sun |z_r| z_1 / z_2 times per turn; planet n
then has the phase -l z_s psi_n instead of l |z_r| psi_n. However their teeth are put in, those at the ring fit its own.

Sources: R. G. Parker, J. Sound Vib. 236 (2000); M. Inalpolat and A. Kahraman, A theoretical and experimental
investigation of modulation sidebands of planetary gear sets, J. Sound Vib. 323 (2009).
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

#: Share of the sum of planets in phase below which they cancel.
CANCELS = 1e-6
#: Distance of orders below which two lines are one.
SAME = 1e-6


class SideBandLine(NamedTuple):
    """A line of a set.

    order      in turns of the carrier against the ring
    harmonic   of the mesh about which it stands
    offset     distance from that harmonic
    share      of equal planets in it, of their sum in phase; NaN of an error of a single planet
    cause      in words
    """

    order: float
    harmonic: int
    offset: float
    share: float
    cause: str


def side_band_lines(
    z: tuple[int, int, int, int],
    angles: np.ndarray,
    harmonics: int,
    carrier_orders: int,
    members: Sequence[str],
    mesh: str = "ring",
) -> list[SideBandLine]:
    """The lines about mesh harmonics, by rising order; of equal orders the first cause counts, others are added.

    z                teeth of sun, planet at the sun, planet at the ring, and ring
    angles           (n_planet,) of the planets [rad]
    carrier_orders   largest distance from a mesh harmonic, in orders of the carrier
    members          of "sun" and "planet": those whose own turns are listed too, with a carrier order beside them
    mesh             "sun" or "ring": whose meshes, which differ where planets are stepped
    """
    lines: list[SideBandLine] = []
    sun, at_sun, at_ring, ring = (abs(teeth) for teeth in z)
    turns = {"sun": ring / sun * at_sun / at_ring, "planet": ring / at_ring}
    mesh_order, waves = (ring, ring) if mesh == "ring" else (ring * at_sun / at_ring, -sun)
    for harmonic in range(1, harmonics + 1):
        for offset in sorted(range(-carrier_orders, carrier_orders + 1), key=abs):
            share = _share(harmonic * waves + offset, angles)
            cause = _cause_of_passing(harmonic, offset, share)
            lines.append(SideBandLine(harmonic * mesh_order + offset, harmonic, offset, share, cause))
        for name, turn in turns.items():
            for sense in (1, -1) if name in members else ():
                for passing in (0, 1, -1):
                    beside = sense * turn + passing
                    share = _share(harmonic * waves + passing - sense, angles) if name == "sun" else np.nan
                    cause = _cause_of_member(name, passing, sense)
                    lines.append(SideBandLine(harmonic * mesh_order + beside, harmonic, beside, share, cause))
    merged: list[SideBandLine] = []
    for line in sorted(lines, key=lambda line: line.order):
        if merged and line.order - merged[-1].order < SAME:
            merged[-1] = merged[-1]._replace(cause=f"{merged[-1].cause}; {line.cause}")
        elif line.order > SAME:
            merged.append(line)
    return merged


def _share(number: float, angles: np.ndarray) -> float:
    """Share of equal planets of their sum in phase, of a wave of a whole number of waves around the ring."""
    return float(np.abs(np.exp(1j * number * np.asarray(angles)).mean()))


def _cause_of_passing(harmonic: int, offset: int, share: float) -> str:
    """What excites a line at whole orders of the carrier beside a mesh harmonic."""
    if share < CANCELS:
        what = f"mesh harmonic {harmonic}" if offset == 0 else "once per turn of carrier or ring"
        return f"{what}: equal planets cancel, unequal ones or errors of carrier and ring excite it"
    waves = {0: "torque", 1: "lateral force on sun and ring"}.get(abs(offset), f"ring bends in {abs(offset)} waves")
    what = f"mesh harmonic {harmonic}" if offset == 0 else "planet pass"
    add_up = "add up" if share > 1 - CANCELS else f"add up to {share:.3g} of planets in phase"
    return f"{what}: {waves}, equal planets {add_up}"


def _cause_of_member(name: str, passing: int, sense: int) -> str:
    """What excites a line at a member's own turn beside a mesh harmonic."""
    if passing == 0:
        return f"error of the {name}, once per turn against the carrier"
    if name == "sun" and passing == sense:
        return "error of the sun, once per turn against the ring"
    return f"error of the {name}, once per turn against the carrier, as planets pass"
