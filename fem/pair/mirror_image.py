"""The mirror image of a pair in the plane of its axes, whose left flanks are the right flanks of the pair."""

from dataclasses import replace
from math import pi

from fem.gear.gear import Gear
from fem.gear.rim_support import mirrored
from fem.microgeometry.flank import Sides
from fem.pair.pair import GearPair
from fem.support.arguments import checked


@checked
def mirror_image(pair: GearPair) -> GearPair:
    """The pair mirrored in the plane of its axes, whose left flanks are the right flanks of the pair.

    Left and right flanks change places, and the hand of the helix and the sense of rotation change their signs; axial
    positions stay. Its phase is `GearPair.back_phase` minus that of the pair, its ring angle 2 pi `back_phase` / |z|
    minus that of the pair, its `Offsets.f_sigma_beta` has the other sign. Tooth k of the mirrored pinion is tooth -k of
    the pinion, tooth k of the mirrored wheel tooth 1 - k of the wheel. A map under torques < 0 is solved with it.
    """
    return GearPair(_mirrored(pair.pinion, 0), _mirrored(pair.wheel, 1), a=pair.a)


def _mirrored(gear: Gear, first: int) -> Gear:
    """The mirror image of a gear, whose tooth k is tooth first - k of the gear."""
    sides = gear.coast_flank, gear.drive_flank
    left, right = (tuple(_renumbered(part, first, gear.z) for part in side) for side in sides)
    support = tuple(mirrored(part, 2 * pi * first / abs(gear.z)) for part in gear.support)
    return replace(gear, beta=-gear.beta, flank=left if left == right else Sides(left, right), support=support)


def _renumbered(part, first: int, z: int):
    """A modification; one that counts the teeth with tooth k for tooth first - k."""
    return part.taken_from(first, -1, z) if hasattr(part, "taken_from") else part
