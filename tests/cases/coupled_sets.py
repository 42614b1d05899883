"""Stepped planets, Ravigneaux and Simpson sets on meshes of known stiffness."""

from typing import Any

from planetary_boxes import waving_law

import exugear
import fem
from fem.units import deg, mm


def gear(z: int, b: float = 25 * mm) -> fem.Gear:
    return fem.Gear(z=z, m_n=3 * mm, alpha_n=20 * deg, b=b, d_bore=min(20, z) * mm)


def ring_shaft(name: str, pair: exugear.RingPair, axial: float = 0.0) -> exugear.Shaft:
    return exugear.Shaft(name, {axial: pair.wheel}, inertia=0.05, mass=5.0)


def carrier_shaft(name: str = "carrier") -> exugear.Shaft:
    return exugear.Shaft(name, {}, inertia=0.02, mass=5.0)


def stepped(law: exugear.MeshForce | None = None, **changes: Any) -> exugear.Planetary:
    """Sun 24, planets 36 and 21, ring 81: two gears on each planet, 40 mm apart."""
    sun, at_sun, at_ring = gear(24), gear(36), gear(21)
    ring_pair = exugear.RingPair(at_ring, -81, a=-90 * mm)
    parts = {
        "sun": exugear.Shaft("sun", {0.0: sun}),
        "ring": ring_shaft("ring", ring_pair, 40 * mm),
        "carrier": carrier_shaft(),
        "planet": exugear.Shaft("planet", {0.0: at_sun, 40 * mm: at_ring}),
        "sun_pair": fem.GearPair(sun, at_sun, a=90 * mm),
        "ring_pair": ring_pair,
    }
    meshes = dict.fromkeys(("sun_mesh", "ring_mesh"), law or waving_law())
    return exugear.Planetary(**parts | meshes | changes)


def ravigneaux(
    law: exugear.MeshForce | None = None, side: int = 1, inner: dict[str, Any] | None = None, **changes: Any
) -> list[Any]:
    """Small sun 30, short planets 20, long ones 31, large sun 42, ring 105; inner: of the inner planets."""
    law = law or waving_law()
    small, short, long, large = gear(30), gear(20), gear(31, 60 * mm), gear(42)
    ring_pair = exugear.RingPair(long, -105, a=-109.5 * mm)
    outer = exugear.Planetary(
        sun=exugear.Shaft("large", {0.0: large}),
        ring=ring_shaft("ring", ring_pair),
        carrier=carrier_shaft(),
        sun_pair=fem.GearPair(large, long, a=109.5 * mm),
        ring_pair=ring_pair,
        sun_mesh=law,
        ring_mesh=law,
        **changes,
    )
    of_short = exugear.InnerPlanets(
        outer=outer,
        sun=exugear.Shaft("small", {0.0: small}),
        sun_pair=fem.GearPair(small, short, a=75 * mm),
        planet_pair=fem.GearPair(short, long, a=76.5 * mm),
        sun_mesh=law,
        planet_mesh=law,
        side=side,
        **inner or {},
    )
    return [outer, of_short]


def simpson(law: exugear.MeshForce | None = None) -> list[exugear.Planetary]:
    """Two sets 30/30/90 with one sun; the front carrier turns with the rear ring, which drives out."""
    planet = gear(30)
    sun_pair, ring_pair = fem.GearPair(planet, planet, a=90 * mm), exugear.RingPair(planet, -90, a=-90 * mm)
    sun = exugear.Shaft("sun", {0.0: planet, 60 * mm: planet})
    out = exugear.Shaft("out", {60 * mm: ring_pair.wheel}, inertia=0.05, mass=5.0)
    options = {"sun": sun, "sun_pair": sun_pair, "ring_pair": ring_pair}
    options |= dict.fromkeys(("sun_mesh", "ring_mesh"), law or waving_law())
    front = {"ring": ring_shaft("front ring", ring_pair), "carrier": out, "axial_position": 0.0, "name": "front"}
    rear = {"ring": out, "carrier": carrier_shaft("rear carrier"), "axial_position": 60 * mm, "name": "rear"}
    return [exugear.Planetary(**options, **front), exugear.Planetary(**options, **rear)]
