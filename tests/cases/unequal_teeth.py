"""Gears whose teeth differ: maps by finite elements over all pitches, laws of rigid deviations over known springs."""

import numpy as np
from coarse_maps import COARSE
from planetary_boxes import STIFFNESS

import exugear
import fem
from fem.units import mm, um

#: Amplitude of a deviation that returns once per turn [m].
ONCE_PER_TURN = 6 * um


def pair_of_unequal_teeth(pinion: bool = True, wheel: bool = False) -> fem.GearPair:
    """A spur pair 12/13 on a larger centre distance; pitch deviations once per turn of these gears."""

    def gear(z: int, deviates: bool) -> fem.Gear:
        flank = fem.PitchDeviation(once_per_turn(z)) if deviates else ()
        return fem.Gear(z=z, m_n=3 * mm, b=20 * mm, d_bore=15 * mm, x=0.4, flank=flank)

    gears = gear(12, pinion), gear(13, wheel)
    return fem.GearPair(*gears, a=fem.GearPair(*gears).a + 0.1 * mm)


def once_per_turn(z: int) -> np.ndarray:
    """(z,) pitch deviations [m]."""
    return ONCE_PER_TURN * np.cos(2 * np.pi * np.arange(z) / z)


def map_over(pair: fem.GearPair, pitches: int, torque=(0, 20, 60, 150), phases: int = 10, **options):
    """Map of a pair over a number of pitches."""
    at = np.arange(pitches * phases) / phases
    return fem.static_transmission_error(pair, torque, at, resolution=COARSE, progress=False, **options)


def law_with_error(error, damping: float = 1500.0, in_pitch: int = 16) -> exugear.MeshForce:
    """F = k (deflection - error), error (n_pitch,) [m] in the middle of each pitch, by a periodic spline between."""
    error = np.asarray(error)
    phase = np.arange(error.size * in_pitch) / in_pitch
    smooth = fem.ste.ste_map.periodic_spline(np.arange(error.size) + 0.0, error, error.size)(phase)
    reach = np.array([0.0, 1 * mm])
    law = smooth[:, None] + reach, np.broadcast_to(STIFFNESS * reach, (phase.size, 2))
    return exugear.MeshForce(phase, *law, damping=damping, pitches=error.size)
