"""The gap between two flanks in a transverse section: exact involutes and the material removed from them.

One gear, the host, carries the strips of a slice; the normals of its flank are the directions of contact. It is the
pinion before the pitch point and the wheel behind it (`mesh_geometry.host_changes_at`), so that only the tip of the
mate can end the strips.
"""

from math import atan2, copysign, cos, pi, sin, sqrt

import numpy as np
from numba import types

from fem.contact.mesh_geometry import PAIR_RECORDS
from fem.microgeometry.compiled_flank import ROUNDING, SHAPE, FlankSections, add_removed, turned
from fem.support.numba_cache import unchecked
from fem.support.on_demand import on_demand

#: Gauss points and weights across a slice, and in its middle section.
GAUSS = np.stack(np.polynomial.legendre.leggauss(3), axis=1)
MIDDLE = np.array([[0.0, 2.0]])
#: Newton steps to the mate's tip corner; they end with a step shorter than this share of the roll length at the tip.
NEWTON_STEPS, SHORTEST = 12, 1e-8
#: Gap of flanks that cannot touch [m].
OUT_OF_REACH = 1.0
#: Angle between a flank and the line of action beyond which it is out of reach, before the gear has turned once; least
#: cosine of the angle between the normals of both flanks in Newton's steps: flanks that touch face one another.
TURNED_AWAY, LEAST_FACING = pi / 2, 0.1
#: Numba's type of sections of a flank.
FLANK_SECTIONS = types.NamedTuple((types.int64[::1], types.float64[::1], types.float64[::1]), FlankSections)


#: Middle section of a slice: number of the tooth pair; gear that carries the strips, 0: pinion or 1: wheel; its axial
#: position and the width of the slice [m]; base radii of host and mate [m]; transmission error about which gap and
#: approach are linearized, by which the roll lengths of host and mate on the line of action, nominal and mate_nominal,
#: overlap [m]; roll lengths at the host's root form and tip circle and at the mate's tip circle [m]; material that
#: pitch deviations remove from host and mate [m], which turn the whole flank, whose corner stays on the tip circle;
#: whether all of the host's flank is beyond the mate's tip, or turned away, so that the two cannot touch.
SECTION = np.dtype(
    [
        *((name, "i8") for name in ("number", "host")),
        *((name, "f8") for name in ("axial", "width", "r_host", "r_mate", "te", "nominal", "mate_nominal")),
        *((name, "f8") for name in ("form", "tip", "mate_tip", "set_back", "mate_set_back")),
        ("out_of_reach", "b1"),
    ]
)


@unchecked
def sections_of(mesh, number, low, high, te):
    """(n,) SECTION of slices of tooth pairs from low to high (n,) [m], linearized about te (n,) [m]."""
    sections = np.empty(number.size, SECTION)
    for i in range(number.size):
        at, position = sections[i], mesh.position
        at.number, at.axial, at.width, at.te = number[i], (low[i] + high[i]) / 2, high[i] - low[i], te[i]
        roll = position.pitch + (position.phase + at.number) * position.p_bt + at.axial * position.slope
        at.host = 0 if roll < position.host_changes_at else 1
        host, mate = mesh.gears[at.host], mesh.gears[1 - at.host]
        at.r_host, at.r_mate, at.form, at.tip = host.r_b, mate.r_b, host.roll_form, host.roll_tip
        at.nominal = (position.length - roll if at.host else roll) + te[i] / 2
        at.mate_nominal, at.mate_tip = position.length - at.nominal + te[i], mate.roll_tip
        at.set_back, at.mate_set_back = _set_back(mesh, at.host, at.number), _set_back(mesh, 1 - at.host, at.number)
        nearest = min(foot_at(mesh, at, at.form), foot_at(mesh, at, at.tip)) - at.mate_set_back
        host_angle = max(at.form - at.nominal, at.nominal - at.tip) / abs(at.r_host)
        mate_least = 0.0 if at.r_mate > 0 else mate.roll_form
        mate_angle = max(mate_least - at.mate_nominal, at.mate_nominal - at.mate_tip) / abs(at.r_mate)
        at.out_of_reach = nearest > at.mate_tip or max(host_angle, mate_angle) > TURNED_AWAY
    return sections


@unchecked
def _set_back(mesh, gear, number):
    """Material [m] that pitch deviations remove from the tooth of a gear, 0 or 1, in a tooth pair."""
    return turned(mesh.wheel if gear else mesh.pinion, mesh.table, -number if gear else number)


@on_demand(
    *(types.none, PAIR_RECORDS, types.int64, types.int64, types.float64, FLANK_SECTIONS),
    *(types.float64[:, ::1], types.float64[:, ::1]),
)
def _add_removed(mesh, gear, role, factor, sections, roll, removed):
    """Add the material [m] that rows of a role remove from a gear, 0 or 1: `add_removed`."""
    rows = mesh.wheel if gear else mesh.pinion
    add_removed(rows, mesh.table, mesh.gears[gear], role, factor, sections, roll, removed)


@unchecked
def to_mate_frame(mesh, at, roll):
    """The host's point at a roll length from the mate's centre (x, y) [m], and the mate's roll length there [m].

    Pitch deviations shorten roll lengths: `roll` is given before, the mate's is that after it.
    """
    angle = -mesh.position.alpha - (roll - at.nominal) / at.r_host
    n_x, n_y, shortened = -sin(angle), cos(angle), roll - at.set_back
    x, y = mesh.position.a - at.r_host * n_y - shortened * n_x, at.r_host * n_x - shortened * n_y
    return x, y, copysign(sqrt(max(x * x + y * y - at.r_mate * at.r_mate, 0.0)), at.r_mate)


@unchecked
def turn_to_contact(mesh, at, roll):
    """Turn of the mate until it touches the host at a roll length, on the mate's base circle [m].

    Also the mate's roll length there [m]. By this turn the mate's involute moves along its normal.
    """
    x, y, mate_roll = to_mate_frame(mesh, at, roll)
    turn = atan2(y * at.r_mate - x * mate_roll, x * at.r_mate + y * mate_roll) + mesh.position.alpha
    mate_roll += at.mate_set_back
    return at.r_mate * turn + mate_roll - at.mate_nominal, mate_roll


@unchecked
def foot_at(mesh, at, roll):
    """The mate's roll length [m] where its normal, not turned, meets the host at a roll length [m]."""
    turn, met = turn_to_contact(mesh, at, roll)
    return met - turn


@unchecked
def opposing_roll(mesh, at, mate_roll):
    """Roll length of the host that the mate's normal at a roll length [m] meets, within the host's flank."""
    roll = min(max(at.nominal, at.form), at.tip)
    least, largest = min(at.form**2, at.tip**2), max(at.form**2, at.tip**2)
    for _ in range(NEWTON_STEPS):
        turn, met = turn_to_contact(mesh, at, roll)
        foot = met - turn
        facing = max(cos(between_normals(at, roll, foot)), LEAST_FACING)
        beyond, met = foot - at.mate_set_back - mate_roll, met - at.mate_set_back
        square = roll * roll + 2 * met * beyond * at.r_host / (facing * at.r_mate)
        last, roll = roll, copysign(sqrt(min(max(square, least), largest)), at.r_host)
        if abs(roll - last) < SHORTEST * abs(at.tip):
            break
    return roll


@unchecked
def first_roll(mesh, at):
    """Roll length of the host at the mate's tip corner [m]; that of its root form circle out of reach."""
    return at.form if at.out_of_reach else opposing_roll(mesh, at, at.mate_tip)


@unchecked
def write_gaps(mesh, sections, roll, gap, foot):
    """Write normal gaps under te, and the mate's roll lengths on its normals to the host's roll lengths (n, m).

    Loaded teeth meet along the normals of the mate, whose involute moves along them by its turn, as its corner does.
    """
    n, m = roll.shape
    on_gears = np.empty((2, n, m))
    for i in range(n):
        at = sections[i]
        for k in range(m):
            turn, met = turn_to_contact(mesh, at, roll[i, k])
            foot[i, k] = met - turn
            on_gears[at.host, i, k], on_gears[1 - at.host, i, k] = roll[i, k], foot[i, k]
            gap[i, k] = mesh.position.inclined * turn
    if mesh.position.modified:
        _add_material(mesh, sections, on_gears, gap)
    for i in range(n):
        if sections[i].out_of_reach:
            for k in range(m):
                gap[i, k] = OUT_OF_REACH


@unchecked
def _add_material(mesh, sections, on_gears, gap):
    """Add the gap by removed material other than pitch deviations, at roll lengths (2, n, m) of pinion and wheel.

    It is the mean along the line of contact; rounded edges, which lines of contact cross on less than a slice, count
    as in the middle section.
    """
    wide = 0
    for i in range(sections.size):
        wide += sections[i].width > 0
    for role in (SHAPE, ROUNDING):
        for point, weight in GAUSS if role == SHAPE and wide else MIDDLE:
            factor = weight / 2 * mesh.position.inclined
            for gear in range(2):
                _add_removed(mesh, gear, role, factor, _flanks_at(mesh, gear, sections, point), on_gears[gear], gap)


@unchecked
def _flanks_at(mesh, gear, sections, point):
    """`FlankSections` of a gear along the lines of contact, at a point of the slices: -1 at low, 1 at high ends."""
    n, sign = sections.size, -1 if gear else 1
    tooth, axial, shift = np.empty(n, np.int64), np.empty(n), np.empty(n)
    for i in range(n):
        at, ahead = sections[i], point * sections[i].width / 2
        tooth[i], axial[i] = sign * at.number, at.axial + ahead - mesh.gears[gear].axial
        shift[i] = sign * ahead * mesh.position.slope
    return FlankSections(tooth, axial, shift)


@unchecked
def material_along(mesh, sections, roll):
    """(2, n, m) material removed from both gears, pitch deviations apart, in middle sections at roll lengths."""
    n, m = roll.shape
    material = np.zeros((2, n, m))
    if mesh.position.modified:
        for gear in range(2):
            flanks = _flanks_at(mesh, gear, sections, 0.0)
            for role in (SHAPE, ROUNDING):
                _add_removed(mesh, gear, role, 1.0, flanks, roll, material[gear])
    return material


@unchecked
def between_normals(at, roll, foot):
    """Angle between the normals of host and mate at their roll lengths [rad]."""
    return (roll - at.nominal) / at.r_host - (foot - at.mate_nominal) / at.r_mate


@unchecked
def approach_at(mesh, at, roll, foot, from_host):
    """Normal approach per transmission error, of which each gear turns one half.

    from_host   angle of the direction of contact from the host's normal in the transverse section [rad]
    """
    from_mate = from_host + between_normals(at, roll, foot)
    tilted = sin(from_host) * roll / at.r_host + sin(from_mate) * min(foot, at.mate_tip) / at.r_mate
    return mesh.position.inclined * (cos(from_host) + cos(from_mate) - tilted) / 2


@unchecked
def arc_of_mate(at, foot):
    """Arc length of the mate [m] at a roll length, up to its tip [m]."""
    return min(foot, at.mate_tip) ** 2 / (2 * at.r_mate)
