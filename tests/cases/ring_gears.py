"""Internal gears and pinions in them."""

import fem
from fem import Density
from fem.units import deg, mm

#: A mesh that is coarse enough for tests of symmetry and balance.
COARSE = fem.Resolution(density=Density(flank=6, fillet=1, tooth=2, rim=1, body=2, width=1), slices=8)


def planet(z: int = 23, x: float = 0.3, **options) -> fem.Gear:
    """A pinion of module 2 mm."""
    return fem.Gear(**{"z": z, "m_n": 2 * mm, "x": x, "b": 20 * mm, "d_bore": (z - 10) * 2 * mm} | options)


def ring(z: int = -71, x: float = 0.2, *, height: float = 0.8, rim: float = 5.0, **options) -> fem.Gear:
    """A ring of module 2 mm, its addendum and the thickness of its rim in modules; spur."""
    sizes = {"d_a": (-z - 2 * (height + x)) * 2 * mm, "d_rim": (-z + 2 * (1.25 - x + rim)) * 2 * mm}
    return fem.Gear(**{"z": z, "m_n": 2 * mm, "x": x, "b": 20 * mm} | sizes | options)


def ring_pair(**options) -> fem.GearPair:
    """A spur pinion in a ring, without backlash by default."""
    return fem.GearPair(planet(), ring(), **options)


def helical_ring_pair() -> fem.GearPair:
    """Right-hand pinion and ring."""
    helix = {"beta": 10 * deg}
    return fem.GearPair(planet(**helix), ring(d_a=140.2 * mm, d_rim=170 * mm, **helix))


def wind_turbine_stage(**options) -> fem.GearPair:
    """Planet and ring of the second stage of NREL's 5 MW reference drivetrain; the ring by a cutter of 30 teeth."""
    sizes = {"m_n": 21 * mm, "b": 550 * mm, "material": fem.Material(E=206e9)}
    pinion = fem.Gear(z=36, x=0.5039, d_a=815.663 * mm, d_f=724.663 * mm, d_bore=500 * mm, **sizes)
    cutter = fem.PinionCutter(z_0=30, x_0=0.0, rho_a0=0.3 * 21 * mm)
    return fem.GearPair(
        pinion, fem.Gear(z=-93, x=0.1171, d_rim=2300 * mm, cutter=cutter, **sizes | options), a=584 * mm
    )


def few_teeth() -> fem.GearPair:
    """Pinion of 17 teeth in a ring of 52, module 3 mm."""
    sizes = {"m_n": 3 * mm}
    pinion = planet(17, 0.4, d_bore=(17 - 2.5 + 0.8 - 4) * 3 * mm, **sizes)
    return fem.GearPair(pinion, ring(-52, 0.2, d_a=(52 - 2.0) * 3 * mm, d_rim=(52 + 2.1 + 6) * 3 * mm, **sizes))


def bolted(**options) -> fem.Bolts:
    """Bolts of a ring, by default eight."""
    placed = {} if "angles" in options else {"number": 8}
    return fem.Bolts(**placed | {"radial": 1e9, "tangential": 1e9, "width": 6 * mm} | options)


def thin_ring_pair(support=()) -> fem.GearPair:
    """Few teeth in a ring whose rim is 2.25 modules thick; its rim clamped by default."""
    return fem.GearPair(planet(19), ring(-53, -0.1, rim=2.25, support=support))
