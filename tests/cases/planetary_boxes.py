"""Planetary sets on meshes of known stiffness: gears of 30, 30 and 90 teeth, and gearboxes with a set."""

from functools import cache
from typing import Any

import numpy as np

import exugear
import fem
from fem.units import deg, mm, um

GEAR = fem.Gear(z=30, m_n=3 * mm, alpha_n=20 * deg, b=25 * mm, d_bore=30 * mm)
SUN_PAIR = fem.GearPair(GEAR, GEAR, a=90 * mm)
RING_PAIR = exugear.RingPair(GEAR, -90, a=-SUN_PAIR.a)
#: Mean stiffness of every mesh [N/m].
STIFFNESS = 5e8


@cache
def waving_law(amplitude: float = 0.1, damping: float = 1500.0, phases: int = 32) -> exugear.MeshForce:
    """F = k deflection, k with a first harmonic over the mesh cycle; amplitude: its share."""
    phase = np.arange(phases) / phases
    k = STIFFNESS * (1 + amplitude * np.cos(2 * np.pi * phase))
    return exugear.MeshForce(phase, np.array([0, 1 * mm]), np.outer(k, [0, 1 * mm]), damping=damping)


def members() -> dict[str, exugear.Shaft]:
    """Sun, ring and carrier, free to spin."""
    sun, ring = exugear.Shaft("sun", {0.0: GEAR}), exugear.Shaft("ring", {0.0: RING_PAIR.wheel}, inertia=0.05, mass=5.0)
    return {"sun": sun, "ring": ring, "carrier": exugear.Shaft("carrier", {}, inertia=0.02, mass=5.0)}


def planetary(law: exugear.MeshForce | None = None, **changes: Any) -> exugear.Planetary:
    """Three planets, unless they are changed, on one law for all meshes."""
    meshes = dict.fromkeys(("sun_mesh", "ring_mesh"), law or waving_law())
    pairs = {"sun_pair": SUN_PAIR, "ring_pair": RING_PAIR}
    return exugear.Planetary(**members() | meshes | pairs | changes)


def published_set() -> dict[str, Any]:
    """Pairs and members of the set of Shweiki et al. (ISMA 2016), z 21/39/-99, spur here."""
    sun, planet = (fem.Gear(z=z, m_n=10 * mm, b=220 * mm, d_bore=60 * mm) for z in (21, 39))
    pairs = {"sun_pair": fem.GearPair(sun, planet, a=300 * mm), "ring_pair": exugear.RingPair(planet, -99, a=-300 * mm)}
    parts = {"sun": {0.0: sun}, "ring": {0.0: pairs["ring_pair"].wheel}, "carrier": {}}
    return pairs | {name: exugear.Shaft(name, x, inertia=0.5, mass=50.0) for name, x in parts.items()}


def planetary_box(
    held: str | tuple[str, ...] = "ring", law: exugear.MeshForce | None = None, **changes: Any
) -> exugear.Gearbox:
    """A gearbox of such a set alone; driving, driven and housing among the changes are the gearbox's."""
    of_box = {name: changes.pop(name) for name in ("driving", "driven", "housing") if name in changes}
    return exugear.Gearbox([planetary(law, **changes)], held=held, **of_box)


PIN = exugear.Bearing(radial=1e8, axial=1e8, tilt=1e6, damping_time=2e-5)
NEEDLE = exugear.RollingBearing.needle(
    Z=18, D_w=3 * mm, D_pw=25 * mm, L_we=20 * mm, clearance=10 * um, guidance=1e7, damping_time=2e-5
)


def planar_box(
    sun_bearing: exugear.Bearing | None = PIN,
    law: exugear.MeshForce | None = None,
    held: str = "ring",
    bearings: exugear.Bearing | None = None,
    **changes: Any,
) -> exugear.Gearbox:
    """A gearbox of a set whose planets stand on elastic pins; bearings: of ring and carrier, by default ideal ones."""
    parts = {"sun": [GEAR, sun_bearing], "ring": [RING_PAIR.wheel, bearings], "carrier": [bearings]}
    sizes = {"sun": {}, "ring": {"inertia": 0.05, "mass": 5.0}, "carrier": {"inertia": 0.02, "mass": 5.0}}
    shafts = {
        name: exugear.Shaft(name, {0.0: [part for part in listed if part]} if any(listed) else {}, **sizes[name])
        for name, listed in parts.items()
    }
    return planetary_box(held, law, **{"pin": PIN} | shafts | changes)


def helical_box(
    law: exugear.MeshForce | None = None,
    held: str | tuple[str, ...] = "ring",
    bearing: exugear.Bearing | None = PIN,
    ring_parts: tuple = (),
    **changes: Any,
) -> exugear.Gearbox:
    """A gearbox of a helical set on elastic pins in space; bearing: of sun, ring and carrier, None: ideal ones."""
    beta, sizes = 15 * deg, {"z": 30, "m_n": 3 * mm, "alpha_n": 20 * deg, "b": 25 * mm, "d_bore": 30 * mm}
    sun, planet = (fem.Gear(**sizes, beta=angle) for angle in (beta, -beta))
    a = 90 * mm / np.cos(beta)
    pairs = {"sun_pair": fem.GearPair(sun, planet, a=a), "ring_pair": exugear.RingPair(planet, -90, a=-a)}
    parts = {"sun": [sun], "ring": [pairs["ring_pair"].wheel, *ring_parts], "carrier": []}
    sizes_of = {"sun": {}, "ring": {"inertia": 0.05, "mass": 5.0}, "carrier": {"inertia": 0.02, "mass": 5.0}}
    shafts = {
        name: exugear.Shaft(
            name, {0.0: on_it} if (on_it := [*listed, *[bearing] * bool(bearing)]) else {}, **sizes_of[name]
        )
        for name, listed in parts.items()
    }
    return planetary_box(held, law, **{"pin": PIN} | pairs | shafts | changes)
