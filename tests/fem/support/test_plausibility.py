"""Values in a probable other unit warn with value, unit and remedy; machines from watches to mills do not."""

import warnings

import pytest
from paper_gears import paper_gear, paper_pair
from scenes import smooth_map

import exugear
import fem
from fem.units import mm


def shaft(*parts, name: str = "a") -> exugear.Shaft:
    return exugear.Shaft(name, {0.0: [paper_gear(), *parts]})


def stage(**damping) -> exugear.Stage:
    return exugear.Stage(shaft(name="fast"), shaft(name="slow"), smooth_map(), **damping)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: fem.Material(density=7.85), r"density 7.85 kg/m\^3 .*pass kg/m\^3: steel has 7850"),
        (lambda: exugear.Disc.cylinder(0.1, 0.1, density=7.85), r"density 7.85 kg/m\^3"),
        (lambda: exugear.Disc.cylinder(3, 8), r"1\.18e\+06 kg is heavier.*pass sizes in metres"),
        (lambda: shaft(exugear.Disc.cylinder(1.0, 3.0)), r"1\.8e\+04 times as heavy as the gears"),
        (lambda: shaft(exugear.Coupling(torsion=20, inertia=0.02)), r"torsion 20 N m/rad .* 20 kN m/rad are 20e3"),
        (lambda: stage(damping=3.6), r"damping 3.6 N s/m is 9\.5e-05 of the critical .*damping_ratio=0.06"),
        (lambda: fem.Gear(z=25, m_n=2e-6, b=2e-5, d_bore=2e-5), r"m_n 2e-06 m is below the modules of watches"),
    ],
)
def test_values_a_thousand_times_from_any_machine_warn(call, message):
    with pytest.warns(UserWarning, match=message) as caught:
        call()
    assert caught[0].filename == __file__


def test_machines_of_all_sizes_do_not_warn():
    """Gears of module 0.05 to 50 mm with a rotor behind a coupling that twists by 6 deg at K = 1 N/mm^2."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for m_n in (0.05 * mm, 2 * mm, 50 * mm):
            gear = fem.Gear(z=57, m_n=m_n, b=10 * m_n, d_bore=20 * m_n)
            torque = 1e6 * (2 * gear.r) ** 2 * gear.b / 2
            coupling = exugear.Coupling(torque / 0.1, inertia=5e7 * m_n**5)
            flywheel = exugear.Disc.cylinder(gear.b, 2.5 * gear.d_a)
            exugear.Shaft("a", {0.0: [gear, coupling, flywheel]})
        for density in (500.0, 1400.0, 2700.0, 19.3e3):
            fem.Material(density=density)
        stage(damping_ratio=0.002)
        assert fem.GearPair(paper_gear(), paper_gear(), a=150 * mm) == paper_pair()
