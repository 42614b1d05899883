"""Shafts as data: inertia of their parts, support of their bearings, displaced axes, refusals."""

import numpy as np
import pytest
from paper_gears import paper_gear

from exugear import Bearing, Coupling, Disc, Placement, Shaft
from fem.units import mm

GEAR = {30 * mm: paper_gear()}


def test_cylinder_has_its_closed_form_inertia():
    length, d, d_bore = 0.2, 0.1, 0.04
    disc = Disc.cylinder(length, d, d_bore, density=7850)
    mass = 7850 * np.pi / 4 * (0.1**2 - 0.04**2) * 0.2
    assert disc.mass == pytest.approx(mass)
    assert disc.inertia == pytest.approx(mass / 2 * (0.05**2 + 0.02**2))
    assert disc.transverse == pytest.approx(mass / 12 * (3 * (0.05**2 + 0.02**2) + 0.2**2))


def test_cylinders_end_to_end_equal_a_single_cylinder():
    """Against the gear's own blank, from which they are told apart by subtraction."""
    bare = Shaft("a", GEAR)
    whole = Shaft("a", {**GEAR, 200 * mm: Disc.cylinder(0.3, 0.05)})
    halves = {125 * mm: Disc.cylinder(0.15, 0.05), 275 * mm: Disc.cylinder(0.15, 0.05)}
    parts = Shaft("a", {**GEAR, **halves})
    for name in ("mass", "inertia", "transverse", "centre"):
        assert getattr(parts, name) == pytest.approx(getattr(whole, name), rel=1e-12)
    disc = Disc.cylinder(0.3, 0.05)
    assert whole.mass - bare.mass == pytest.approx(disc.mass)
    assert whole.inertia - bare.inertia == pytest.approx(disc.inertia)
    steiner = bare.mass * disc.mass / whole.mass * (170 * mm) ** 2
    assert whole.transverse == pytest.approx(bare.transverse + disc.transverse + steiner)
    assert whole.centre == pytest.approx((30 * mm * bare.mass + 200 * mm * disc.mass) / whole.mass)


def test_several_parts_share_an_axial_position():
    disc, bearing = Disc.cylinder(0.1, 0.05), Bearing(1e8, 1e8, 1e5)
    shaft = Shaft("a", {30 * mm: [paper_gear(), disc, disc, bearing]})
    assert shaft.gears == {30 * mm: paper_gear()}
    assert shaft.bearings == {30 * mm: bearing}
    assert shaft.discs == [(30 * mm, disc)] * 2
    assert shaft.mass == pytest.approx(Shaft("a", GEAR).mass + 2 * disc.mass)
    assert shaft.centre == pytest.approx(30 * mm)


def test_rotor_behind_a_coupling_is_not_part_of_the_shaft():
    coupling = Coupling(1e4, 2.0, inertia=0.1)
    shaft = Shaft("a", {0.0: coupling, **GEAR})
    assert shaft.coupling == coupling and Shaft("a", GEAR).coupling is None
    assert shaft.inertia == Shaft("a", GEAR).inertia


def test_support_of_two_bearings():
    shaft = Shaft("a", {0.0: Bearing(5e8, 1e8), **GEAR, 90 * mm: Bearing(4e8)})
    k = shaft.support
    assert np.diag(k)[:3] == pytest.approx([9e8, 9e8, 1e8])
    tilt = 5e8 * (30 * mm) ** 2 + 4e8 * (60 * mm) ** 2
    assert np.diag(k)[3:] == pytest.approx([tilt, tilt, 0])
    lever = -5e8 * 30 * mm + 4e8 * 60 * mm
    assert (k[0, 4], k[1, 3]) == pytest.approx((lever, -lever))
    assert np.linalg.matrix_rank(k[:5, :5]) == 5


def test_displaced_shaft_turns_about_its_axial_zero():
    offset = Placement(x=1e-4, y=-2e-4, tilt_x=1e-3, tilt_y=2e-3, z=3e-4)
    assert offset.at(0.0) == pytest.approx([1e-4, -2e-4, 3e-4])
    there = [1e-4 + 0.5 * 2e-3, -2e-4 - 0.5 * 1e-3, 0.5 + 3e-4]
    assert offset.at(0.5) == pytest.approx(there, abs=2e-6)
    assert np.linalg.norm(offset.axis) == pytest.approx(1)


WEAK = np.diag([1e8, 1e8, 1e8, 1e5, 0.0, 0.0])


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: Shaft("a", GEAR, length=20 * mm), r"positions outside the shaft 'a': \[30.0\] mm of \[0, 20\] mm"),
        (lambda: Shaft("a", {-1 * mm: paper_gear()}, length=1.0), "positions outside the shaft"),
        (lambda: Shaft("", GEAR), "name of a shaft must not be empty"),
        (lambda: Shaft("$a$", GEAR), "must not begin with _ or hold"),
        (lambda: Shaft("_a", GEAR), "must not begin with _ or hold"),
        (lambda: Shaft("a", GEAR, length=300.0), "length must lie in"),
        (lambda: Shaft("a", GEAR, offset=1e-3), "must be an exugear.Placement"),
        (lambda: Shaft("a", {30 * mm: [paper_gear(), paper_gear()]}), "two of a kind at one position"),
        (lambda: Shaft("a", {30 * mm: [paper_gear(), "bearing"]}), "parts holds"),
        (lambda: Shaft("a", {**GEAR, 0.0: [Coupling(1, inertia=1, name="b")] * 2}), "rotors of shaft 'a' share a name"),
        (lambda: Coupling(1.0, inertia=1.0, further=2.0), "further must be a Coupling or a list of them"),
        (lambda: Shaft("a", {**GEAR, 0.0: Bearing(matrix=WEAK)}), "free to tilt"),
        (lambda: Shaft("a", {**GEAR, 0.0: Disc.cylinder(1, 1)}, inertia=np.inf), "inertia of shaft 'a' must be > 0"),
        (lambda: Shaft("a", GEAR, inertia=1.0, transverse=0.4), "inertia of shaft 'a' cannot exceed twice"),
        (lambda: Disc(-1, 1, 1), "mass of a disc"),
        (lambda: Disc(1, 1, 0.4), "cannot exceed twice"),
        (lambda: Disc(3.1, 85, 50), "radius of gyration of 5.24 m; pass kg and kg m.2"),
        (lambda: Coupling(1e12, inertia=1.0), "effectively rigid"),
        (lambda: Coupling(20.0, 40.0, inertia=1.0), "damping / torsion of a coupling must stay below 1 s, got 2"),
        (lambda: Disc.cylinder(30, 0.1), "pass metres"),
        (lambda: Disc.cylinder(0.1, 0.1, 0.2), "d > d_bore"),
        (lambda: Disc.cylinder(0.1, 0.1, density=0.5), "density must lie"),
        (lambda: Coupling(0.0, inertia=1.0), "torsion of a coupling"),
        (lambda: Coupling(1.0, inertia=0.0), "inertia of a coupling"),
        (lambda: Coupling(1.0, -1.0, inertia=1.0), "damping of a coupling"),
        (lambda: Placement(x=20), "pass metres"),
        (lambda: Placement(tilt_y=1.0), "pass radians"),
        (lambda: Placement(z=np.nan), "z of a placement"),
    ],
)
def test_impossible_parts_and_shafts_are_refused(build, message):
    with pytest.raises(ValueError, match=message):
        build()


def test_the_origin_has_one_name():
    """-1 * 0.0 of a mirrored layout is -0.0, by which a bearing would be at -0 mm."""
    ball = Bearing(radial=5e8, axial=1e8, tilt=1e5)
    shaft = Shaft("mirrored", {-0.0: ball, -10 * mm: paper_gear()})
    assert [str(axial) for axial in shaft.bearings] == ["0.0"]
