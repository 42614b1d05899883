"""A small planetary set whose thin ring stands on a bush or on bolts, with the modes of its rim."""

from dataclasses import replace
from functools import cache

import numpy as np
import xarray as xr
from planetary_boxes import waving_law
from ring_gears import COARSE, bolted, planet, ring

import exugear
import fem
from fem.units import mm, um

BUSH = fem.Bush(radial=1e8, tangential=1e8)
BOLTS = bolted(number=6, radial=1e8, tangential=1e8)
#: Number of ring modes: pairs of one to six lobes, and the turning one.
MODES = 13
PHASES = np.arange(12) / 12
FORCES = np.array([0.0, 500.0, 2000.0, 6000.0])


@cache
def gears() -> tuple[fem.Gear, fem.Gear]:
    """Sun and planet, thin enough for a backlash."""
    sizes = {"m_n": 2 * mm, "b": 20 * mm, "s_n": 3.08 * mm}
    return fem.Gear(z=21, d_bore=20 * mm, **sizes), planet(24, 0.0, s_n=3.08 * mm)


@cache
def ring_pair(support=BUSH) -> fem.GearPair:
    """Planet and ring, whose rim is three modules thick."""
    return fem.GearPair(gears()[1], ring(-69, 0.0, rim=3.0, support=support), a=-45.0 * mm)


@cache
def ring_modes(support=BUSH, number: int = MODES) -> xr.Dataset:
    """The lowest modes of the ring."""
    return fem.ring_modes(ring_pair(support), number, resolution=COARSE)


@cache
def ring_map(support=BUSH) -> xr.Dataset:
    """A map with the compliance of the bending rim, and a wave of the rest; of bolts over the pitches between them."""
    pair, modes = ring_pair(support), ring_modes(support)
    pitches = 1 if isinstance(support, fem.Bush) else 23
    phase = (np.arange(pitches)[:, None] + PHASES).ravel()
    around = np.interp(2 * np.pi * phase / 69, modes["at"].values, modes["bending"].values)
    if pitches == 1:
        around[:] = around.mean()
    te = np.multiply.outer(FORCES, 3e-9 * (1 + 0.1 * np.cos(2 * np.pi * phase)) + around)
    return fem.ste_map(pair, FORCES * pair.pinion.r_b, phase, te, pitches=pitches)


def set_on_ring(support=BUSH, *, modes: bool = True, **options) -> exugear.Planetary:
    """Three planets by default; modes: whether the ring has modes."""
    sun, of_planet = gears()
    shafts = {
        "sun": exugear.Shaft("sun", {0.0: sun}),
        "ring": exugear.Shaft("ring", {0.0: ring_pair(support).wheel}),
        "carrier": exugear.Shaft("carrier", {}, inertia=2e-3, mass=1.0),
    }
    meshes = {
        "sun_mesh": replace(waving_law(0.1, damping=3e3), backlash=50 * um),
        "sun_pair": fem.GearPair(sun, of_planet, a=45.0 * mm),
    }
    given = {"ring_mesh": ring_map(support), "damping": 3e3} | ({"ring_modes": ring_modes(support)} if modes else {})
    return exugear.Planetary(**shafts | meshes | given | options)


def box_on_ring(support=BUSH, **options) -> exugear.Gearbox:
    """The set with its ring held."""
    return exugear.Gearbox([set_on_ring(support, **options)], held="ring")
