"""The flanks of placed gears touch on the line of action, and overlap there by the transmission error."""

import numpy as np
import pytest
from contacts import position_of
from helical_gears import helical
from involutes import involute_flank
from paper_gears import few_teeth, paper_gear
from ring_gears import helical_ring_pair, ring_pair

import fem
from fem.pair.placement import Placement, meshing_angles, placements
from fem.units import deg, mm, um

PAIRS = [
    fem.GearPair(paper_gear(), paper_gear(), a=150 * mm),
    fem.GearPair(few_teeth(), few_teeth(z=41)),
    fem.GearPair(helical(1), helical(-1), a=150 * mm),
]


def flank_point(placement: Placement, roll: float, axial: float) -> complex:
    """Point x + iy of the driving flank of tooth 0 at a roll length, in the transverse plane at axial."""
    r, psi = involute_flank(placement.gear, roll)
    x, y, mid_plane = placement.centre
    return x + 1j * y + r * np.exp(1j * (placement.angle + placement.gear.twist * (axial - mid_plane) + psi))


@pytest.mark.parametrize("pair", PAIRS)
@pytest.mark.parametrize("lag", [0.0, 0.5, 1.0])
def test_flanks_overlap_along_the_line_of_action_by_the_transmission_error(pair, lag):
    position, te = position_of(pair, 0.3, 3 * mm, a=pair.a + 0.2 * mm), 20 * um
    alpha = position.alpha
    towards_wheel = np.sin(alpha) + 1j * np.cos(alpha)
    pinion, wheel = placements(position, te, lag=lag)
    for axial in (-5 * mm, 0.0, 8 * mm):
        roll = position.nominal(0, axial)
        on_pinion = flank_point(pinion, roll + (1 - lag) * te, axial)
        on_wheel = flank_point(wheel, position.path.on_wheel(roll) + lag * te, axial)
        foot = pair.pinion.r_b * (np.cos(alpha) - 1j * np.sin(alpha))
        assert on_pinion == pytest.approx(foot + (roll + (1 - lag) * te) * towards_wheel, abs=1e-12)
        assert on_pinion - on_wheel == pytest.approx(te * towards_wheel, abs=1e-12)


@pytest.mark.parametrize("pair", PAIRS)
def test_teeth_pass_the_line_of_centres_by_half_their_thickness(pair):
    """At phase 0 the flanks of both gears pass the pitch point, for either direction and any direction to the wheel."""
    half = [
        gear.thickness(r) / (2 * r) for gear, r in zip((pair.pinion, pair.wheel), pair.path_of_contact.r_w, strict=True)
    ]
    for direction in (1, -1):
        pinion, wheel = meshing_angles(pair, 30 * deg, direction)
        assert pinion == pytest.approx(30 * deg - direction * half[0])
        assert wheel == pytest.approx(210 * deg - direction * half[1])


def test_teeth_turn_by_a_pitch_a_mesh_cycle():
    pair = PAIRS[1]
    for direction in (1, -1):
        start, end = (meshing_angles(pair, 0.2, direction, phase=phase) for phase in (0.25, 1.25))
        turned = np.subtract(end, start)
        assert turned == pytest.approx([direction * 2 * np.pi / pair.pinion.z, -direction * 2 * np.pi / pair.wheel.z])


@pytest.mark.parametrize("phase", [0.0, 0.3, 0.7])
def test_points_of_contact_are_points_of_both_flanks(phase):
    """The placements put the same point of the line of action on both involutes, of spur and helical pairs."""
    for pair in (ring_pair(), helical_ring_pair()):
        position = position_of(pair, phase)
        roll = position.nominal(0, 0.0)
        points = []
        for placed, own_roll in zip(placements(position), (roll, pair.path_of_contact.on_wheel(roll)), strict=True):
            gear = placed.gear
            r = gear.sign * np.hypot(gear.r_b, own_roll)
            psi = gear.psi_b - (own_roll / gear.r_b - np.arctan(own_roll / gear.r_b))
            points.append(placed.centre[0] + r * np.exp(1j * (placed.angle + psi)))
        assert points[0] == pytest.approx(points[1], abs=1e-15)


def test_the_tooth_of_the_ring_lies_at_its_meshing_angle():
    """At the pitch point the teeth of both gears lie on the same side of the pinion, half a pitch apart or less."""
    pair = ring_pair()
    pinion, wheel = meshing_angles(pair, 0.4)
    assert abs(pinion - 0.4) < np.pi / pair.pinion.z
    assert abs((wheel - 0.4 + np.pi) % (2 * np.pi) - np.pi) < np.pi / -pair.wheel.z
