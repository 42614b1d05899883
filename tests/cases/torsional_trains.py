"""Torsional trains with published natural frequencies, as gearboxes whose meshes are stiff or one of the springs."""

from collections.abc import Sequence
from math import pi

import numpy as np
from paper_gears import paper_gear, paper_pair
from scenes import linear_law

import fem
from exugear import Coupling, Gearbox, MeshForce, Shaft, Stage
from fem.units import deg, mm

R_B = paper_pair().pinion.r_b


def torsion(length: float, d: float, shear_modulus: float = 68e9) -> float:
    """Torsional stiffness of a solid shaft [N m/rad]."""
    return shear_modulus * pi * d**4 / 32 / length


def stiff_law() -> MeshForce:
    return linear_law(k=(1e12,) * 3, backlash=0.5 * mm)


def geared_train() -> Gearbox:
    """A turbine whose gear drives a shaft to port, and by an idler one to starboard; radii 0.5 and 0.8 m.

    Friswell, Penny, Garvey, Lees, Dynamics of rotating machines (2010), section 9.6.3: 10.304, 20.479, 24.423 Hz with
    rigid teeth.
    """
    small, large = (fem.Gear(z=z, m_n=20 * mm, b=200 * mm, d_bore=200 * mm) for z in (50, 80))
    equal, unequal = fem.GearPair(small, small, a=1.0), fem.GearPair(small, large, a=1.3)
    propeller = Coupling(torsion(3.5, 0.25), inertia=450.0)
    turbine = Shaft("turbine", {0.0: [small, Coupling(torsion(2.5, 0.2), inertia=3200.0)]}, inertia=200.0)
    idler = Shaft("idler", {0.0: small}, inertia=200.0)
    port, starboard = (Shaft(name, {0.0: [large, propeller]}, inertia=800.0) for name in ("port", "starboard"))
    return Gearbox([
        Stage(turbine, port, stiff_law(), pair=unequal, angle=90 * deg),
        Stage(turbine, idler, stiff_law(), pair=equal),
        Stage(idler, starboard, stiff_law(), pair=unequal),
    ])  # fmt: skip


def two_shafts(
    fast: Sequence[Coupling], slow: Sequence[Coupling], torsion: float, inertias: tuple[float, float]
) -> Gearbox:
    """Two equal gears with couplings behind them, whose mesh is a torsional spring [N m/rad]."""
    law = linear_law(k=(torsion / R_B**2,) * 3, reach=9 * mm)
    couplings = {"fast": fast, "slow": slow}
    shafts = [
        Shaft(name, {0.0: [paper_gear(), *couplings[name]]}, inertia=inertia)
        for name, inertia in zip(couplings, inertias, strict=True)
    ]
    return Gearbox([Stage(*shafts, law, pair=paper_pair())])


def five_discs() -> Gearbox:
    """A chain of five discs on four springs, the second of which is the mesh: 81.21, 141.21, 378.95, 536.36 Hz.

    The same book, example 9.7.1.
    """
    load = Coupling(14e3, inertia=0.15, further=Coupling(10e3, inertia=0.05, name="brake"))
    return two_shafts([Coupling(12e3, inertia=3.5e-3)], [load], 12e3, (3.5e-3, 3.5e-3))


def motor_and_two_rotors() -> Gearbox:
    """A motor, gears of 25e-6 kg m^2, a rotor behind each: 425.4, 634.1, 3247.2 Hz with rigid teeth (the same book)."""
    rotor = Coupling(5e3, inertia=700e-6)
    return two_shafts([Coupling(10e3, inertia=400e-6), rotor], [rotor], 1e12 * R_B**2, (25e-6, 25e-6))


def hidden_low_mode(gear: float) -> tuple[Gearbox, np.ndarray]:
    """A wind turbine's rotor behind its shaft, a gear shaft of small inertia [kg m^2], a generator.

    With the natural frequencies [Hz] of rotor and generator on both springs in series, and of the gear shaft between
    them; exact to the ratio of the gear's inertia to the others.
    """
    rotor, generator, shaft, mesh = 5.0, 1e4, 1e3, 4.2e8 * R_B**2
    box = two_shafts([Coupling(shaft, inertia=rotor)], [], mesh, (gear, generator))
    low = 1 / (1 / shaft + 1 / mesh) * (1 / rotor + 1 / generator)
    return box, np.sqrt([0.0, low, (shaft + mesh) / gear]) / (2 * pi)
