"""Tooth pairs one by one: what a force law over a hunting period is composed of, where teeth differ.

A pair of gears whose teeth differ repeats after z_1 z_2 / gcd pitches, too many for a map of all of them. The contact
of several tooth pairs under a transmission error te is composed of

    te - d_p = h_p(f_p; s_p) + sum over q of c_pq f_q     where f_p > 0, sum of f_p = mesh force

with the deflection h of a tooth pair that carries the load f alone at the position s on the path of contact, the
coupling c of two tooth pairs by the bodies of their gears, and the pitch deviations d. s counts in pitches from the
pitch point on; the tooth pair with the number k is at s = phase + k. What single teeth have beside a pitch deviation
changes h of their tooth pairs by an increment, solved with this tooth against a tooth of the mate without deviations,
and moves their load along the face: its moment couples with the loads of the neighbours, too. Where few teeth of either
gear have it, or where it is far larger on few, as spalls are, what the tooth pairs of both have beside the sum of
increments is solved as well.
"""

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from math import ceil, gcd, lcm, tan
from typing import NamedTuple

import numpy as np
import scipy
import xarray as xr

from fem.contact.contact_slices import ContactSlices
from fem.contact.coupling import compiled_compliance
from fem.contact.line_contact import DEPTH, compliance_at, loaded_distance
from fem.contact.resolution import Resolution, Slices
from fem.contact.tooth_contact import ToothContact
from fem.gear.gear import Gear
from fem.microgeometry.flank import alike_on_all_teeth, edges, of_single_tooth, pitch_deviations
from fem.pair.mesh_position import MeshPosition
from fem.pair.offsets import ANGLES, Offsets
from fem.pair.pair import GearPair
from fem.ste.inputs import check_offsets_mesh, checked_torque
from fem.ste.load_interpolation import over_parts
from fem.ste.map_solver import ContactModel, compliances_of
from fem.ste.ste_map import CENTROID, LAW_OFFSETS, STIFFNESS, TE, TORQUE, pair_attributes
from fem.support.arguments import Finite, checked
from fem.support.blas_threads import one_thread
from fem.support.progress import bar, shown
from fem.support.representation import exact
from fem.support.validation import require

#: Loads of single tooth pairs over the largest mesh force: a tooth that stands proud carries all of it, a coupled one
#: more.
LOADS = np.geomspace(0.002, 1.6, 14)
#: Loads at which increments are solved, over the largest of `LOADS`: those of a helix slope change within a factor of 3
#: of the load under which the contact spreads over the face.
INCREMENT_LOADS = np.geomspace(0.001, 1, 10)
#: Load at which the line loads are taken that couple tooth pairs, over the largest mesh force.
COUPLED_LOAD = 0.3
#: Shares of the mesh force that both of two tooth pairs carry at least from whose contact a coupling follows, and by
#: how much it deflects less than either alone [m].
LEAST_CARRIED, UNCOUPLED = 0.05, 1e-9
#: Loads of the states by which a law states its error, over the largest mesh force.
CHECKED_LOADS = np.array([0.05, 0.3, 1.0])
#: Positions in a pitch of single tooth pairs of spur gears, of those of helical gears and of increments, and of
#: couplings; pitches beyond the ends of the path.
KNOTS, FEW_KNOTS, COUPLING_KNOTS, BEYOND = 32, 16, 64, 0.3
#: Positions in a pitch beside kinks and ends of the path, and how far [pitches]: a tip corner enters the contact within
#: its width there, and lines of contact of helical teeth begin at a point.
CLOSE_KNOTS, CLOSE = 128, 0.1
#: Positions in a pitch of increments with further kinks, as beside the edges of a spall, and of those of spur
#: gears close to kinks and ends of the path.
KINKED_KNOTS = 64
#: Least length of a part of the path between kinks [pitches].
SHORTEST_PART = 0.004
#: Gap beyond the path up to which tooth pairs may touch [m].
FURTHEST_GAP = 1e-3
#: Steps in a pitch at which increments are given.
INCREMENT_STEPS = 64
#: Tooth pairs of which both teeth have increments, up to which they are solved as such; of more those alone that depend
#: on the load this many times as much as all others.
MOST_MEETING, STANDS_OUT = 64, 2.0
#: Pitch deviation of a tooth that is missing [m], and material removed from it.
MISSING = 0.5e-3
POSITION, DISTANCE, INCREMENT_TORQUE = "position", "distance", "increment_torque"
GEARS = "pinion", "wheel"


@dataclass(frozen=True)
class SinglePair:
    """Tooth pair 0 alone: the model of its contact, and the forces and misalignments of its states.

    bodies, slices   as `compliances_of` gives them
    forces           (n,) mesh forces >= 0 [N]
    """

    model: ContactModel
    bodies: tuple
    slices: int
    forces: np.ndarray

    def at(self, a: float, axial: float, position: float) -> MeshPosition:
        """The mesh with this tooth pair alone at a position [pitches]."""
        return MeshPosition(self.model.pair, a, axial, position, candidates=range(1))

    def contact(self, position: MeshPosition) -> ToothContact:
        """The contact at a mesh position."""
        return ToothContact(position, self.bodies[0], self.bodies[1], self.slices)

    def states(self, at: tuple[float, float, float]) -> np.ndarray:
        """`of` the tooth pair alone at (a, axial, position)."""
        return self.of(self.at(*at))

    def of(self, position: MeshPosition) -> np.ndarray:
        """(3, n_force, n_misalignment) te [m], stiffness [N/m] and centroid [m] at a mesh position."""
        contact = self.contact(position)
        misalignment = self.model.misalignment(contact.position.alpha).ravel()
        force, angle = np.broadcast_arrays(self.forces[:, None], misalignment)
        loads = force.ravel(), angle.ravel()
        first, second = contact.strip_quantities, contact.slice_quantities
        if isinstance(self.model.resolution, Slices):
            first, second = second, first
        with one_thread():
            try:
                states = first(*loads)
            except RuntimeError:
                if position.candidates is None:
                    raise
                # Far beyond the path: strips are finer than the contact of light loads at tip corners is known, and
                # bodies of few slices soften too far under large ones.
                states = second(*loads)
        return np.array([states[name].reshape(force.shape) for name in (TE, STIFFNESS, CENTROID)])


@checked
def tooth_pair_map(
    pair: GearPair,
    torque: Finite,
    *,
    offsets: Offsets | None = None,
    resolution: Resolution | Slices | None = None,
    checks: int = 8,
    executor: Executor | None = None,
    progress: bool = True,
) -> xr.Dataset:
    """Deflections of single tooth pairs, their couplings, and the deviations of all teeth: for laws over long periods.

    `exugear.MeshForce.from_tooth_pairs` composes a force law over all pitches of it, at the cost of a map of a few
    pitches.

    torque      largest pinion torque of the law [N m]
    offsets     as in `static_transmission_error`; of the angles the misalignment alone may be an axis
    checks      number of random phases of the period at which the contact of all tooth pairs is solved, too, under
                three torques: the law states its error against them. Where few teeth have more than a pitch deviation,
                half of them are where these are in mesh. Of 8 phases the rms is that of random states within a factor
                of 2.5 in 19 of 20 laws, beside spalls less sure; the largest error exceeds 95 % of all states in four
                of five laws. It is no bound: the largest of 500 states is 2.5 times as much on average
    resolution, executor, progress
                as in `static_transmission_error`

    Returns a dataset with these variables; the inputs are its attributes:

    te              over (torque, *offsets, position): transmission error [m] of the tooth pair of flanks without what
                    single teeth have, alone under the torque
    stiffness, centroid
                    likewise, as in a map
    coupling        over (distance, position): transmission error of a tooth pair by a load on that which is further
                    ahead by whole pitches [m/N]
    pinion_pitch, wheel_pitch
                    over the teeth of either gear: pitch deviations [m]
    pinion_increment, wheel_increment
                    over (pinion_variant or wheel_variant, *offsets, increment_torque, position): change of te by what
                    teeth have beside pitch deviations [m]
    pinion_moment, wheel_moment
                    likewise: change of load times force centroid [N m]
    pinion_variant_of, wheel_variant_of
                    over the teeth: number of the increment; -1: none
    meeting_increment, meeting_moment
                    over (meeting, ...): what tooth pairs of which both teeth have increments have beside their sum
    meeting_of      over (pinion_variant, wheel_variant): its number; -1: the sum is taken. Where more than 64 meet,
                    those are solved whose increments depend on the load far more than the others', as spalls do
    moment_coupling over (moment_of, distance, position): transmission error of a tooth pair by a moment of the load on
                    that further ahead, of that by a moment of the former [1/N], and of moment by moment [rad/(N m)]

    te_check        over (torque_check, phase_check): transmission error [m] of the whole contact; te_alike: of flanks
                    without what single teeth have

    position        of the tooth pair on the path of contact, in pitches from the pitch point
    parts           attribute: positions of the ends of the path and of kinks, between which te is smooth

    Raises ValueError for bad input, and where so many teeth are missing that contact would have to bridge more pitches
    than tooth pairs are known for; RuntimeError if a contact does not converge.
    """
    offsets = Offsets() if offsets is None else offsets
    values = offsets.values(pair)
    check_offsets_mesh(pair, values["a"], values["axial"])
    largest = float(checked_torque(pair, torque)[-1])
    require(largest > 0, f"torque must be > 0 N m, the largest of the law, got {torque}")
    turns = "tooth pairs of a ring on bolts or a bush differ with its angle"
    require(not pair.wheel.support, f"{turns}; map it over ring_angles, and take fem.over_pitches")
    axes = offsets.axes()
    unknown = [name for name in axes if name not in LAW_OFFSETS]
    require(not unknown, f"offsets of a force law may be {list(LAW_OFFSETS)}, got {unknown}; take misalignment")
    alike = _with_flanks(pair, *(alike_on_all_teeth(gear.drive_flank) for gear in _gears(pair)))
    force = largest / pair.pinion.r_b
    model = ContactModel(pair, values, resolution or Resolution())
    bodies, slices = compliances_of(pair, model.offsets, model.resolution)
    nominal = SinglePair(replace(model, pair=alike), bodies, slices, force * np.append(0.0, LOADS))
    parts = within_reach(nominal, parts_of_path(alike, float(values["a"].min())))
    _check_missing(pair, float(parts[-1] - parts[0]))
    with shown(progress):
        position = knots_close_to_kinks(parts, FEW_KNOTS if pair.beta_b else KNOTS, CLOSE_KNOTS)
        states = _solved(nominal, position, executor, "single tooth pairs")
        on_path = (position >= parts[1]) & (position <= parts[-2])
        states[0] = rising(states[0], on_path)
        aligned = aligned_tooth_pairs(nominal)
        alone = _te_of_aligned(nominal, aligned, position, states[0], executor)
        coupling = couplings(aligned, parts, force, position, alone)
        solver = IncrementSolver(nominal, parts, executor, {})
        increments = [_increments(solver, pair, number) for number in range(2)]
        meeting = _meeting(solver, pair, increments)
        checked_phase = _checked_phases(pair, checks, increments)
        whole = [
            _whole_contacts(replace(nominal, model=each, forces=force * CHECKED_LOADS), checked_phase)
            for each in (model, nominal.model)
        ]
    data = _labelled(pair, nominal, axes, parts, position, states, coupling, increments, meeting)
    for name, te in zip(("te_check", "te_alike"), whole, strict=True):
        data[name] = ("torque_check", "phase_check"), te, {"units": "m"}
    return data.assign_coords(torque_check=largest * CHECKED_LOADS, phase_check=checked_phase)


def _check_missing(pair: GearPair, reach: float) -> None:
    """ValueError where teeth are missing one beside another, so that no tooth pair within reach [pitches] touches."""
    period = lcm(pair.pinion.z, abs(pair.wheel.z))
    broken = [_pitch(gear) > MISSING for gear in _gears(pair)]
    number = np.arange(period)
    whole = np.flatnonzero(~(broken[0][-number % pair.pinion.z] | broken[1][number % abs(pair.wheel.z)]))
    missing = [f"{np.flatnonzero(x).tolist()} of the {name}" for x, name in zip(broken, GEARS, strict=True) if x.any()]
    gap = float(np.diff(whole, append=whole[0] + period).max()) if whole.size else float(period)
    far = f"teeth {' and '.join(missing)} are missing: others would have to bridge {gap:g} pitches"
    require(gap <= reach, f"{far}, but touch over {reach:.3g}; the gears do not run on like this")


def _checked_phases(pair: GearPair, checks: int, increments: list["Increments"]) -> np.ndarray:
    """Random phases (n,) of the period, half of them where the few teeth with increments are in mesh."""
    require(checks >= 0, f"checks must be a number of phases >= 0, got {checks}")
    z, random = (pair.pinion.z, abs(pair.wheel.z)), np.random.default_rng(0)
    period = lcm(*z)
    phase = random.uniform(0, period, checks)
    # tooth i of the pinion is in mesh about phase -i, tooth i of the wheel about phase i
    near = [
        (sign * i, n)
        for sign, n, x in zip((-1, 1), z, increments, strict=True)
        for i in np.flatnonzero(x.variant_of >= 0)
    ]
    if near and 2 * len(near) < sum(z):
        for i in range(checks // 2):
            tooth, n = near[i % len(near)]
            phase[i] = (tooth + n * random.integers(period // n) + random.uniform(-0.6, 0.6)) % period
    return np.sort(phase)


def _whole_contacts(single: SinglePair, phase: np.ndarray) -> np.ndarray:
    """(n_load, n) te [m] of the contact of all tooth pairs at phases (n,)."""
    a, axial = float(single.model.offsets["a"][0]), float(single.model.offsets["axial"][0])
    te = np.zeros((single.forces.size, phase.size))
    for i, at in enumerate(phase):
        te[:, i] = single.of(MeshPosition(single.model.pair, a, axial, float(at)))[0, :, 0]
    return te


def _pitch(gear: Gear) -> np.ndarray:
    """(z,) pitch deviations of the teeth of a gear [m]."""
    return sum((np.array(part.values) for part in pitch_deviations(gear.drive_flank)), np.zeros(abs(gear.z)))


def _gears(pair: GearPair) -> tuple[Gear, Gear]:
    return pair.pinion, pair.wheel


def _with_flanks(pair: GearPair, pinion, wheel) -> GearPair:
    """The pair with other left flanks on all teeth."""
    return GearPair(replace(pair.pinion, flank=tuple(pinion)), replace(pair.wheel, flank=tuple(wheel)), a=pair.a)


def parts_of_path(pair: GearPair, a: float) -> np.ndarray:
    """Positions [pitches] of the ends of the path of contact, of kinks between, and half a pitch beyond."""
    path = MeshPosition(pair, a, 0.0, 0.0).path
    slope, p_bt = abs(tan(pair.beta_b)) * pair.b / 2 / pair.p_bt, pair.p_bt
    rolls = [path.start, path.end]
    if not slope:
        rolls += edges(pair.pinion.drive_flank, pair.pinion.face)
        rolls += [path.on_wheel(roll) for roll in edges(pair.wheel.drive_flank, pair.wheel.face)]
    kinks = (np.array(rolls) - path.pitch) / p_bt
    inside = np.unique(np.concatenate([kinks - slope, kinks + slope]))
    start, end = kinks[0] - slope, kinks[1] + slope
    inside = inside[(inside >= start) & (inside <= end)]
    distinct = inside[np.append(True, np.diff(inside) > SHORTEST_PART)]
    distinct[-1] = end
    return np.concatenate([[start - BEYOND], distinct, [end + BEYOND]])


def within_reach(single: SinglePair, parts: np.ndarray) -> np.ndarray:
    """The parts with the outermost positions so near to the path that the flanks there are within a millimetre."""
    a, axial = (float(single.model.offsets[name].max()) for name in ("a", "axial"))

    def furthest(end: float, beyond: float) -> float:
        for share in np.linspace(1, 0.1, 10):
            position = end + share * (beyond - end)
            if abs(single.contact(single.at(a, axial, position)).first_touch(0.0)) < FURTHEST_GAP:
                return float(position)
        raise ValueError(f"flanks do not meet beside the path of contact at {end:.3g} pitches; check tips and offsets")

    return np.concatenate([[furthest(parts[1], parts[0])], parts[1:-1], [furthest(parts[-2], parts[-1])]])


def knots(parts: np.ndarray, in_pitch: int) -> np.ndarray:
    """Positions with those of all parts, evenly spaced in each: at least four in a part, for a cubic."""
    inner = [np.linspace(low, high, max(4, ceil(in_pitch * (high - low)) + 1))[:-1] for low, high in pairwise(parts)]
    return np.append(np.concatenate(inner), parts[-1])


def knots_close_to_kinks(parts: np.ndarray, in_pitch: int, beside_kinks: int) -> np.ndarray:
    """`knots` that lie closer together beside ends of the path and kinks."""
    reach = round(CLOSE * beside_kinks)
    at = parts[1:-1, None] + np.arange(-reach, reach + 1) / beside_kinks
    even = knots(parts, in_pitch)
    far = np.abs(even[:, None] - parts[1:-1]).min(axis=1) >= CLOSE
    nearest = np.abs(at[..., None] - parts[1:-1]).argmin(axis=-1) == np.arange(len(at))[:, None]
    close = at[nearest & (at > parts[0]) & (at < parts[-1])]
    joined = np.sort(np.concatenate([even[far | np.isin(even, parts)], close]))
    return joined[np.append(True, np.diff(joined) > SHORTEST_PART / 4)]


def _solved(single: SinglePair, position: np.ndarray, executor: Executor | None, what: str) -> np.ndarray:
    """(3, n_force, n_a, n_misalignment, n_axial, n_position) `SinglePair.states`."""
    a, axial = single.model.offsets["a"], single.model.offsets["axial"]
    grid = [(float(x), float(y), float(s)) for x in a for y in axial for s in position]
    spread = map if executor is None else partial(executor.map, chunksize=ceil(len(grid) ** 0.5 / 2))
    count = f"{what}: {len(grid) * single.forces.size} states"
    solved = np.array(list(bar(spread(single.states, grid), count, np.ones(len(grid)))))
    shaped = solved.reshape(a.size, axial.size, position.size, *solved.shape[1:])
    return np.transpose(shaped, (3, 4, 0, 5, 1, 2))


def aligned_tooth_pairs(single: SinglePair) -> SinglePair:
    """The tooth pair without misalignment, at the first centre distance and axial offset."""
    offsets = {name: np.zeros(1) if name in ANGLES else values[:1] for name, values in single.model.offsets.items()}
    return replace(single, model=replace(single.model, offsets=offsets))


def _te_of_aligned(
    single: SinglePair, aligned: SinglePair, position: np.ndarray, te: np.ndarray, executor: Executor | None
) -> np.ndarray:
    """(n_force, n_position) te of the aligned tooth pair [m], from the states te of the other where it has these."""
    alpha = single.at(float(single.model.offsets["a"][0]), 0.0, 0.0).alpha
    among = np.flatnonzero(single.model.misalignment(alpha).ravel() == 0)
    if among.size:
        return te[:, 0, among[0], 0]
    return _solved(aligned, position, executor, "aligned tooth pairs")[0][:, 0, 0, 0]


def rising(te: np.ndarray, on_path: np.ndarray) -> np.ndarray:
    """te (n_force, ..., n_position) [m] that grows with the force by half of its least growth on the path or more.

    Where flanks would touch far beyond the path, at gaps of some 100 um, contacts at tip corners are solved to some
    tenths of a micrometre, more than light loads deflect them.
    """
    growth = np.diff(te, axis=0)
    least = growth[..., on_path].min(axis=tuple(range(1, te.ndim)), keepdims=True) / 2
    floor = np.concatenate([np.zeros_like(least[:1]), np.cumsum(least, axis=0)])
    return np.maximum.accumulate(te - floor, axis=0) + floor


class CoupledLoads(NamedTuple):
    """Slices of a tooth pair at a position, each (n,), and their loads under the mesh force 1, and moment 1 [1/m]."""

    low: np.ndarray
    high: np.ndarray
    share: np.ndarray
    tilting: np.ndarray


#: Kinds of loads behind and ahead that couple: shares, a moment behind, a moment ahead, both moments.
KINDS = ("share", "share"), ("tilting", "share"), ("share", "tilting"), ("tilting", "tilting")


def couplings(
    single: SinglePair, parts: np.ndarray, force: float, solved: np.ndarray, te: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Positions (n,) [pitches] and couplings (4, n_distance, n) of `KINDS` of a tooth pair there with those ahead.

    single          aligned tooth pair
    solved, te      positions (n_solved,) and transmission errors (n_force, n_solved) of the tooth pair alone [m]
    """
    step = 1 / COUPLING_KNOTS
    position = np.arange(np.floor(parts[0] / step), np.ceil(parts[-1] / step) + 1) * step
    a, axial = float(single.model.offsets["a"][0]), float(single.model.offsets["axial"][0])
    # at the corners where helical teeth touch beside the path, contacts are too narrow to carry moments
    inner = np.clip(position, *(parts[[1, -2]] if single.model.pair.beta_b else parts[[0, -1]]))
    loads = [_coupled_loads(single.contact(single.at(a, axial, float(s))), COUPLED_LOAD * force) for s in inner]
    distances = min(ceil(parts[-1] - parts[0]), *(len(body.blocks) - 1 for body in single.bodies))
    values = np.zeros((len(KINDS), distances, position.size))
    for i, s in enumerate(position):
        for n in range(1, distances + 1):
            of_ahead = loads[min(i + n * COUPLING_KNOTS, len(loads) - 1)]
            values[:, n - 1, i] = _coupling(single, a, axial, float(s), n, loads[i], of_ahead)
    factor = _of_contact(single, position, values[0, 0], force, over_parts(solved, te.T, parts, position))
    # the tooth pair nearer to an end of the path changes its couplings with all others
    before = position + 0.5 < (parts[0] + parts[-1]) / 2
    behind, ahead = np.where(before, factor, 1), np.where(before, 1, factor)
    for n in range(distances):
        values[:, n] *= behind * np.append(ahead[n * COUPLING_KNOTS :], np.ones(n * COUPLING_KNOTS))[: behind.size]
    return position, values


def _of_contact(
    single: SinglePair, position: np.ndarray, coupling: np.ndarray, force: float, te: np.ndarray
) -> np.ndarray:
    """Factors (n,) of couplings (n,) of tooth pairs at positions (n,) with those a pitch ahead, by their contact.

    te      (n, n_force) of the tooth pair alone at these positions [m]

    Tip corners slide along the mate as the transmission error grows, whether their tooth deflects or others do, and
    load on a relief is inclined: deflections do not quite add as those of line loads do. With these factors two alike
    tooth pairs have the transmission error of their contact under the largest mesh force.
    """
    a, axial = float(single.model.offsets["a"][0]), float(single.model.offsets["axial"][0])
    of_two, whole = replace(single, forces=np.array([force])), np.sqrt(force)
    deflections = [scipy.interpolate.CubicSpline(np.sqrt(single.forces), values) for values in te]
    loads, factors = force * np.linspace(LEAST_CARRIED, 1 - LEAST_CARRIED, 50), {}
    for s, c, first, second in zip(position, coupling, deflections, deflections[COUPLING_KNOTS:], strict=False):
        of_pairs = replace(of_two.at(a, axial, float(s)), candidates=range(2))
        together = float(of_two.of(of_pairs)[0, 0, 0])

        def of_first(load, together=together, first=first):
            return (together - first(np.sqrt(load))) / (force - load)

        def too_much(load, together=together, second=second, of_first=of_first):
            return second(np.sqrt(force - load)) + of_first(load) * load - together

        above = too_much(loads) > 0
        if together < min(first(whole), second(whole)) - UNCOUPLED and above[0] != above[-1]:
            factors[s] = of_first(scipy.optimize.brentq(too_much, loads[0], loads[-1])) / c
    return np.interp(position, list(factors), list(factors.values())) if factors else np.ones(position.size)


def _coupled_loads(contact: ToothContact, force: float) -> CoupledLoads:
    slices, loads = contact.slice_loads(np.array([force]), np.zeros(1))
    approach, axial = slices.closest.approach, (slices.low + slices.high) / 2
    share = loads.force[0] / (approach @ loads.force[0])
    arm = axial - (approach * share) @ axial
    # with the width of slices: a contact on a single one bears no moment
    spread = (approach * share) @ (arm**2 + (slices.high - slices.low) ** 2 / 12)
    return CoupledLoads(slices.low, slices.high, share, share * arm / spread)


def _coupling(
    single: SinglePair, a: float, axial: float, s: float, distance: int, behind: CoupledLoads, ahead: CoupledLoads
) -> list[float]:
    """Couplings of `KINDS` of a tooth pair at s with that by a distance further ahead."""
    place = MeshPosition(single.model.pair, a, axial, s, candidates=range(distance + 1))
    contact = ToothContact(place, single.bodies[0], single.bodies[1], single.slices)
    number = np.repeat([0, distance], [behind.low.size, ahead.low.size])
    low, high = np.concatenate([behind.low, ahead.low]), np.concatenate([behind.high, ahead.high])
    slices = ContactSlices(place, number, low, high, mesh=contact.slicing.mesh)
    pinion, wheel = place.pair.pinion, single.bodies
    numbers = range(distance + 1)
    bodies = compiled_compliance(wheel[0], 0.0, numbers), compiled_compliance(wheel[1], 0.0, range(-distance, 1))
    beside_closest = loaded_distance(slices, COUPLED_LOAD * single.forces[-1] / place.pair.b)
    compliance = compliance_at(slices, DEPTH * pinion.m_n, beside_closest[:, None], bodies, contact.face)
    n, share = behind.low.size, contact.face.share
    return [
        share * float(getattr(behind, first) @ compliance[:n, n:] @ getattr(ahead, second)) for first, second in KINDS
    ]


class Increments(NamedTuple):
    """Changes of te [m] and of the moment of the load [N m], and the variant (z,) of each tooth.

    values       (2, n_variant, n_a, n_misalignment, n_axial, n_load, n_position) at loads (n_load,) [N]
    flanks       modifications of the teeth with a variant
    """

    variant_of: np.ndarray
    loads: np.ndarray
    position: np.ndarray
    values: np.ndarray
    flanks: list


@dataclass(frozen=True)
class IncrementSolver:
    """What increments are solved with: tooth pairs without them, and those already solved, by their positions."""

    nominal: SinglePair
    parts: np.ndarray
    executor: Executor | None
    without: dict

    @property
    def loads(self) -> np.ndarray:
        return self.nominal.forces[-1] * np.append(0.0, INCREMENT_LOADS)

    @property
    def position(self) -> np.ndarray:
        first, last = self.parts[0], self.parts[-1]
        return first + np.arange(ceil((last - first) * INCREMENT_STEPS) + 1) / INCREMENT_STEPS

    def of(self, flanks: Sequence, what: str) -> np.ndarray:
        """(2, ...) changes by further modifications of both teeth, as in `Increments`.

        They are solved at positions that suit the kinks of these teeth, and interpolated at evenly spaced ones.
        """
        model, parts = self.nominal.model, self.parts
        with_teeth = _with_flanks(model.pair, *flanks)
        of_teeth = parts_of_path(with_teeth, float(model.offsets["a"].min()))
        of_teeth = np.concatenate([parts[:1], of_teeth[1:-1], parts[-1:]])
        if of_teeth.size != parts.size:
            at = knots(of_teeth, KINKED_KNOTS)
        elif model.pair.beta_b:
            at = knots(of_teeth, FEW_KNOTS)
        else:
            at = knots_close_to_kinks(of_teeth, FEW_KNOTS, KINKED_KNOTS)
        single = replace(self.nominal, forces=self.loads)
        if at.tobytes() not in self.without:
            self.without[at.tobytes()] = self._states(single, at, "tooth pairs without those of single teeth")
        solved = self._states(replace(single, model=replace(model, pair=with_teeth)), at, what)
        change = np.moveaxis(solved - self.without[at.tobytes()], -1, 0)
        return np.moveaxis(over_parts(at, change, of_teeth, self.position), 0, -1)

    def _states(self, single: SinglePair, at: np.ndarray, what: str) -> np.ndarray:
        """(2, n_a, n_misalignment, n_axial, n_load, n_position) te [m] and moment of the load [N m]."""
        te, _, centroid = _solved(single, at, self.executor, what)
        moment = centroid * single.forces.reshape(-1, 1, 1, 1, 1)
        return np.moveaxis(np.array([te, moment]), 1, -2)


def _increments(solver: IncrementSolver, pair: GearPair, number: int) -> Increments:
    """Increments of the teeth of pinion (0) or wheel (1) that have more than a pitch deviation."""
    gear = _gears(pair)[number]
    teeth = [of_single_tooth(gear.drive_flank, tooth, gear.z) for tooth in range(abs(gear.z))]
    alike = alike_on_all_teeth(gear.drive_flank)
    variants = list(dict.fromkeys(flank for flank in teeth if flank != alike))
    variant_of = np.array([variants.index(flank) if flank in variants else -1 for flank in teeth])
    bare = [gear.drive_flank for gear in _gears(solver.nominal.model.pair)]
    values = []
    for i, flank in enumerate(variants):
        flanks = [flank if n == number else bare[n] for n in range(2)]
        values.append(solver.of(flanks, f"{GEARS[number]}, tooth {list(variant_of).index(i)}"))
    return Increments(variant_of, solver.loads, solver.position, _stacked(solver, values), variants)


def _stacked(solver: IncrementSolver, values: list[np.ndarray]) -> np.ndarray:
    """(2, n_variant, ...) changes of some variants, of none too."""
    counts = [solver.nominal.model.offsets[name].size for name in ("a", "misalignment", "axial")]
    none = np.zeros((2, 0, *counts, solver.loads.size, solver.position.size))
    return np.concatenate([none, *(x[:, None] for x in values)], axis=1)


def _meeting(solver: IncrementSolver, pair: GearPair, increments: list[Increments]) -> tuple[np.ndarray, np.ndarray]:
    """What tooth pairs of which both teeth have increments have beside their sum, and its number (n_1, n_2)."""
    pinion, wheel = increments
    number = np.full((len(pinion.flanks), len(wheel.flanks)), -1)
    values: list[np.ndarray] = []
    apart = gcd(pair.pinion.z, abs(pair.wheel.z))
    # tooth i of the pinion meets tooth j of the wheel where i + j is a multiple of the common divisor
    meeting = [
        (i, j)
        for i, j in np.ndindex(*number.shape)
        if np.any(
            (np.flatnonzero(pinion.variant_of == i)[:, None] + np.flatnonzero(wheel.variant_of == j)) % apart == 0
        )
    ]
    for n, (i, j) in enumerate(_standing_out(meeting, solver, increments)):
        both = solver.of((pinion.flanks[i], wheel.flanks[j]), f"increments {i} and {j} of both gears")
        values.append(both - pinion.values[:, i] - wheel.values[:, j])
        number[i, j] = n
    return number, _stacked(solver, values)


def _standing_out(
    meeting: list[tuple[int, int]], solver: IncrementSolver, increments: list[Increments]
) -> list[tuple[int, int]]:
    """The tooth pairs that meet; of more than 64 those whose increments depend on the load more than all others.

    A deviation that turns the tooth alike under all loads adds to any other. The part of both teeth that depends on
    the load is that of the tooth where it is less.
    """
    if len(meeting) <= MOST_MEETING:
        return meeting
    on_path = (solver.position >= solver.parts[1]) & (solver.position <= solver.parts[-2])
    of_gears = [np.ptp(x.values[0][..., on_path], axis=-2).reshape(len(x.flanks), -1).max(axis=1) for x in increments]
    dependent = np.array([min(of_gears[0][i], of_gears[1][j]) for i, j in meeting])
    order = np.argsort(-dependent, kind="stable")[: MOST_MEETING + 1]
    falls = dependent[order[:-1]] / np.maximum(dependent[order[1:]], 1e-12)
    count = int(falls.argmax()) + 1 if falls.max() > STANDS_OUT else 0
    return [meeting[k] for k in order[:count]]


def _labelled(pair, nominal, axes, parts, position, states, coupling, increments, meeting) -> xr.Dataset:
    dims = [TORQUE, "a", "misalignment", "axial", POSITION]
    r_b = pair.pinion.r_b
    kept = [name for name in dims if name in (TORQUE, POSITION, *axes)]
    units = {TE: "m", STIFFNESS: "N/m", CENTROID: "m"}
    coords = {TORQUE: nominal.forces * r_b, POSITION: position}
    coords |= {name: nominal.model.offsets[name] for name in axes}
    data = xr.Dataset(
        {
            name: xr.DataArray(values, dims=dims).isel({x: 0 for x in dims if x not in kept})
            for name, values in zip(units, states, strict=True)
        },
        coords,
    )
    at, values = coupling
    data["coupling"] = (DISTANCE, "coupled_position"), values[0]
    data["moment_coupling"] = ("moment_of", DISTANCE, "coupled_position"), values[1:]
    data = data.assign_coords({DISTANCE: np.arange(1, values.shape[1] + 1), "coupled_position": at})
    data = data.assign_coords({"moment_of": ["behind", "ahead", "both"]})
    fixed = {x: 0 for x in ("a", "misalignment", "axial") if x not in axes}

    def changes(variant: str, values: np.ndarray) -> xr.DataArray:
        dims_of = variant, "a", "misalignment", "axial", INCREMENT_TORQUE, "increment_position"
        return xr.DataArray(values, dims=dims_of).isel(fixed)

    data["meeting_of"] = ("pinion_variant", "wheel_variant"), meeting[0]
    for what, values, unit in zip(("increment", "moment"), meeting[1], ("m", "N m"), strict=True):
        data[f"meeting_{what}"] = changes("meeting", values)
        units[f"meeting_{what}"] = unit
    for name, gear, of_gear in zip(GEARS, _gears(pair), increments, strict=True):
        data[f"{name}_pitch"] = f"{name}_tooth", _pitch(gear)
        data[f"{name}_variant_of"] = f"{name}_tooth", of_gear.variant_of
        for what, values in zip(("increment", "moment"), of_gear.values, strict=True):
            data[f"{name}_{what}"] = changes(f"{name}_variant", values)
        units |= {f"{name}_pitch": "m", f"{name}_increment": "m", f"{name}_moment": "N m"}
        data = data.assign_coords({INCREMENT_TORQUE: of_gear.loads * r_b, "increment_position": of_gear.position})
    for name, unit in ({"coupling": "m/N"} | units).items():
        data[name].attrs["units"] = unit
    data.attrs |= {"title": "tooth pairs", "resolution": exact(nominal.model.resolution), "parts": parts}
    data.attrs |= pair_attributes(pair) | {"a_working": float(nominal.model.offsets["a"][0])}
    return data
