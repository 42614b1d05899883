"""A small planetary set whose thin ring stands on a bush or on bolts, with its maps and modes."""

from functools import cache

import xarray as xr
from ring_gears import COARSE, bolted, planet, ring

import exugear
import fem
from fem.units import mm

BUSH = fem.Bush(radial=1e8, tangential=1e8)
BOLTS = bolted(number=6, radial=1e8, tangential=1e8)
TORQUES = [0.0, 10.0, 40.0, 100.0]
#: Teeth of sun, planet and ring.
TEETH = 21, 24, -69


@cache
def ring_pair(support=BUSH) -> fem.GearPair:
    """Planet and ring, whose rim is three modules thick."""
    backlash = {"a": -45.0 * mm}
    return fem.GearPair(planet(24, 0.0), ring(-69, 0.0, rim=3.0, support=support), **backlash)


@cache
def ring_map(support=BUSH) -> xr.Dataset:
    """Map of the ring, on bolts over all pitches."""
    pair = ring_pair(support)
    ste = fem.static_transmission_error(pair, TORQUES, 12, resolution=COARSE, progress=False)
    return fem.over_pitches(ste) if "ring_angle" in ste.dims else ste


@cache
def ring_modes(support=BUSH, number: int = 13) -> xr.Dataset:
    """The lowest modes of the ring."""
    return fem.ring_modes(ring_pair(support), number, resolution=COARSE)


@cache
def sun_map() -> xr.Dataset:
    """Map of sun and planet."""
    sun = fem.Gear(z=21, m_n=2 * mm, b=20 * mm, d_bore=20 * mm)
    pair = fem.GearPair(sun, planet(24, 0.0), a=45.0 * mm)
    return fem.static_transmission_error(pair, TORQUES, 12, resolution=COARSE, progress=False)


def set_on_ring(support=BUSH, number: int | None = 13, **options) -> exugear.Planetary:
    """Three planets by default; number: of ring modes, None: none."""
    sun, ste = sun_map(), ring_map(support)
    shafts = {
        "sun": exugear.Shaft("sun", {0.0: fem.pair_of(sun).pinion}),
        "ring": exugear.Shaft("ring", {0.0: fem.pair_of(ste).wheel}),
        "carrier": exugear.Shaft("carrier", {}, inertia=2e-3, mass=1.0),
    }
    modes = {"ring_modes": ring_modes(support, number)} if number else {}
    given = {"sun_mesh": sun, "ring_mesh": ste, "damping_ratio": 0.06} | modes
    return exugear.Planetary(**shafts | given | options)


def box_on_ring(support=BUSH, number: int | None = 13, **options) -> exugear.Gearbox:
    """The set with its ring held."""
    return exugear.Gearbox([set_on_ring(support, number, **options)], held="ring")
