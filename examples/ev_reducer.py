"""A two-stage helical reducer of an electric axle up to 15,000 rpm: natural frequencies, run-up, bearing force orders.

    python examples/ev_reducer.py results

A rotor behind a splined coupling drives the input shaft; three shafts lie on elastic bearings. Mesh frequencies reach
5.8 kHz, so that both stages pass many modes of the gearbox. The maps are coarse: slice mode, half the elements along
every direction. All data are chosen here.
"""

import sys
from dataclasses import replace
from pathlib import Path

import exugear
import fem
from exugear import plots
from fem.units import deg, mm, rpm

LOAD, SPEED, DAMPING, PLAY = 1200.0, (500 * rpm, 15000 * rpm), 2500.0, 0.06 * mm
#: Axial positions of bearings and gears.
BEARINGS, FIRST, SECOND = (0.0, 110 * mm), 30 * mm, 75 * mm
TORQUES = {"first": (0, 2, 10, 40, 120, 300, 600), "second": (0, 5, 25, 100, 370, 900, 1800)}
COARSE = fem.Slices(fem.Density().scaled(0.5))


def pairs() -> dict[str, fem.GearPair]:
    """Both pairs with backlash; equal hands on the middle shaft."""
    first, second = {"m_n": 1.75 * mm, "b": 28 * mm}, {"m_n": 2.5 * mm, "b": 36 * mm}
    pinion, wheel = (
        fem.Gear(z=23, beta=-25 * deg, d_bore=20 * mm, **first),
        fem.Gear(z=71, beta=25 * deg, d_bore=45 * mm, **first),
    )
    upper, last = (
        fem.Gear(z=22, beta=18 * deg, d_bore=25 * mm, **second),
        fem.Gear(z=71, beta=-18 * deg, d_bore=70 * mm, **second),
    )
    tight = fem.GearPair(pinion, wheel), fem.GearPair(upper, last)
    return {name: replace(pair, a=pair.a + PLAY) for name, pair in zip(TORQUES, tight, strict=True)}


def gearbox(phases: int = 24) -> exugear.Gearbox:
    """Rotor, three shafts and six bearings."""
    geared = pairs()
    maps = {
        name: fem.static_transmission_error(pair, TORQUES[name], phases, resolution=COARSE, progress=False)
        for name, pair in geared.items()
    }
    laws = {name: exugear.MeshForce.from_ste(ste, damping=DAMPING) for name, ste in maps.items()}
    locating = exugear.Bearing(radial=2e8, axial=1e8, damping=1e-5)
    bearings = dict(zip(BEARINGS, (locating, exugear.Bearing(radial=2e8, damping=1e-5)), strict=True))
    motor = exugear.Coupling(torsion=1.5e4, damping=0.5, inertia=0.03)
    first, second = geared["first"], geared["second"]
    fast = exugear.Shaft("input", bearings | {-20 * mm: motor, FIRST: first.pinion})
    middle = exugear.Shaft("middle", bearings | {FIRST: first.wheel, SECOND: second.pinion})
    slow = exugear.Shaft("output", bearings | {SECOND: second.wheel})
    upper = exugear.Stage(middle, slow, laws["second"], pair=second, angle=-50 * deg)
    return exugear.Gearbox([exugear.Stage(fast, middle, laws["first"], pair=first), upper])
