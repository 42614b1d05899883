"""Phase of every mesh in the reference configuration, where all driving flanks touch.

The tooth position of a gear is the angle from x to the middle of a tooth, in the gear's sense of rotation and as share
of a pitch; as the gears turn, tooth positions and phases grow alike. At phase 0 the driving flanks touch at the pitch
point in mid-plane: there the middle of the pinion's tooth lies half a tooth thickness behind the line of centres, and
the middle of the wheel's tooth half a tooth thickness ahead of it, both on the working pitch circles. The phase of a
mesh is the tooth position of either gear minus the tooth position of that gear at phase 0; a gear with two mates thus
couples the phases of its meshes. Gears with a single mate are mounted so that the driving flanks touch. Tooth positions
are those in the mid-plane of each gear: where the mid-planes of a helical pair differ, the helix turns the wheel.

Laws over several pitches tell the teeth apart: `exugear.gearbox.tooth_numbers` says which ones meet.

Planets are taken where they stand in the reference configuration; as their carrier turns, phases stay. A ring has the
pitch point on the same side as its mate, and z < 0: its tooth position grows as it turns with the pinion. It is counted
from the flank that touches: a ring meshes with planets alone, and its tooth thickness shifts all of them alike.

Planets whose teeth are thinner than those of the first one touch sun and ring one after the other: a gap remains.

The gears of a stepped planet are fixed to each other: the phase with the ring follows from that with the sun. A half
tooth that is thicker by dh pitches, on the flank that faces the sense s, holds the planet back by s dh 2 pi / z.
"""

from collections.abc import Callable, Mapping, Sequence
from math import cos, pi
from typing import NamedTuple

import numpy as np

from exugear.gearbox.gear_train import Path, Traversal, fitting_angles, fitting_remedy, traverse
from exugear.gearbox.stage import Stage
from exugear.gearbox.static_offsets import is_beside, stage_offsets
from exugear.gearbox.tooth_numbers import mounted, phase_of_law
from fem.gear.gear import Gear
from fem.pair.pair import GearPair
from fem.pair.placement import meshing_angles
from fem.support.validation import require

#: Share of a pitch within which the teeth of a loop fit.
FITS = 1e-6


class AtPhaseZero(NamedTuple):
    """Tooth positions of pinion and wheel, each in its mid-plane, at phase 0 of their mesh."""

    pinion: float
    wheel: float

    @property
    def wheel_advance(self) -> float:
        """Tooth position of the wheel minus that of the pinion, at any phase."""
        return self.wheel - self.pinion


class SteppedPlanet(NamedTuple):
    """The stages of a stepped planet with sun and ring, by their numbers.

    ring_phase   function of the direction of the sun's stage and of its phase: phase with the ring
    """

    sun: int
    ring: int
    ring_phase: Callable[[int, float], float]


class Phasing(NamedTuple):
    """Phase of every stage in the pitches of its law, and the gap [m] of its driving flanks where they should touch.

    Planets with thinner teeth than the first one have a gap, those with thicker ones a gap < 0, in the last of their
    meshes.
    """

    phases: tuple[float, ...]
    gaps: tuple[float, ...]


def phasing(
    stages: Sequence[Stage],
    directions: Sequence[int],
    positions: Mapping[str, tuple[float, float]],
    stepped: Sequence[SteppedPlanet] = (),
) -> Phasing:
    """Phases and gaps of all stages; ValueError where teeth of a loop of gears do not fit, or given phases disagree.

    directions   sense in which the pinion of each stage drives, +1 or -1
    positions    x, y [m] of each shaft
    stepped      first stepped planets of sets
    """
    at_zero = [_at_phase_zero(stage, direction, positions) for stage, direction in zip(stages, directions, strict=True)]
    edges = [stage.ends for stage in stages]
    known, gaps = dict[int, float](), dict[int, float]()
    given = {i: stage.phase for i, stage in enumerate(stages) if stage.phase is not None}
    while rest := [i for i in range(len(stages)) if i not in known]:
        train = traverse(edges, edges[rest[0]][0])
        known |= _phases_of_train(stages, at_zero, train, given)
        gaps |= _gaps_of_loops(stages, directions, at_zero, train)
        for planet in stepped:
            if planet.sun in known and planet.ring not in given:
                order = (
                    f"phases of ring {stages[planet.ring].slow.name!r} follow from its other planets, those of stepped"
                )
                require(
                    planet.ring not in known, f"{order} ones from their sun; list the set of the stepped ones first"
                )
                given[planet.ring] = planet.ring_phase(directions[planet.sun], known[planet.sun]) % 1.0
    gaps |= _gaps_of_steps(stages, directions, positions)
    in_order = range(len(stages))
    return Phasing(tuple(known[i] for i in in_order), tuple(gaps.get(i, 0.0) for i in in_order))


def _at_phase_zero(stage: Stage, direction: int, positions: Mapping[str, tuple[float, float]]) -> AtPhaseZero:
    pair, axial = stage.pair, stage_offsets(stage, positions, direction)["axial"]
    if not isinstance(pair, GearPair) or pair.wheel.z < 0:
        r_w = pair.pinion.r_b / cos(pair.alpha_wt)
        half_a_tooth = pair.pinion.z * pair.pinion.thickness(r_w) / (4 * pi * r_w)
        at_line = direction * stage.angle / (2 * pi)
        return AtPhaseZero(pair.pinion.z * at_line - half_a_tooth, -pair.wheel.z * at_line)
    pinion, wheel = meshing_angles(pair, stage.angle, direction, axial=axial)
    return AtPhaseZero(
        direction * stage.pair.pinion.z * pinion / (2 * pi), -direction * stage.pair.wheel.z * wheel / (2 * pi)
    )


def _phases_of_train(
    stages: Sequence[Stage],
    at_zero: Sequence[AtPhaseZero],
    train: Traversal,
    given: Mapping[int, float],
) -> dict[int, float]:
    """Phases of the stages whose gears mesh with one another."""
    positions = dict.fromkeys(train.paths, 0.0)
    for i, sense in train.tree:
        reached, new = stages[i].ends[::sense]
        positions[new] = positions[reached] + sense * at_zero[i].wheel_advance
    numbers = sorted([*(i for i, _ in train.tree), *train.closing])
    relative = {i: positions[stages[i].ends[0]] - at_zero[i].pinion for i in numbers}
    shift = _shift(stages, relative, {i: phase for i, phase in given.items() if i in relative})
    if all(stages[i].force.pitches == 1 for i in numbers):
        return {i: phase_of_law(stages[i].pair, 1, x + shift, x + shift) for i, x in relative.items()}
    return _phases_of_teeth(stages, at_zero, train, given, shift)


def _phases_of_teeth(
    stages: Sequence[Stage],
    at_zero: Sequence[AtPhaseZero],
    train: Traversal,
    given: Mapping[int, float],
    first: float,
) -> dict[int, float]:
    """Phases of the stages of a train by the numbers of the teeth that meet; first: tooth position of its first gear.

    A phase that is given for a stage counts with its whole pitches.
    """
    positions = {next(node for node, path in train.paths.items() if not path): first}
    for i, sense in train.tree:
        reached, new = stages[i].ends[::sense]
        zero_reached, zero_new = at_zero[i][::sense]
        by_mate = positions[reached] - zero_reached
        positions[new] = zero_new + (given[i] if i in given else mounted(by_mate, stages[i].pair))
    phases_of_stages = {}
    for i in sorted([*(i for i, _ in train.tree), *train.closing]):
        stage, ends = stages[i], zip(stages[i].ends, at_zero[i], strict=True)
        by_teeth = [given[i]] * 2 if i in given else [positions[end] - zero for end, zero in ends]
        try:
            phases_of_stages[i] = phase_of_law(stage.pair, stage.force.pitches, *by_teeth)
        except ValueError as error:
            raise ValueError(f"stage {stage.name}: {error}") from None
    return phases_of_stages


def _shift(stages: Sequence[Stage], relative: Mapping[int, float], given: Mapping[int, float]) -> float:
    """Shift of the phases of a train to a given phase; without one, to phase 0 in the first stage."""
    first = next(iter(given or relative))
    shift = given.get(first, 0.0) - relative[first]
    for i, phase in given.items():
        left = f"the gears that it shares with stage {stages[first].name} leave {(relative[i] + shift) % 1.0:.8g}"
        fit = f"got {phase:.8g}; leave it out, or leave out the phase of the other stage"
        require(abs(wrapped(relative[i] + shift - phase)) < FITS, f"phase of stage {stages[i].name}: {left}, {fit}")
    return shift


def wrapped(share: float) -> float:
    """A share of a pitch, reduced by whole pitches to [-0.5, 0.5]."""
    return share - round(share)


def _gaps_of_loops(
    stages: Sequence[Stage], directions: Sequence[int], at_zero: Sequence[AtPhaseZero], train: Traversal
) -> dict[int, float]:
    """Gaps [m] of the stages that close loops; ValueError unless the teeth fit along them (assembly condition).

    On a carrier teeth of other thickness than that of the first planet leave gaps, and fit nevertheless.
    """
    gaps = {}
    for i in train.closing:
        loop = train.loop(i, stages[i].ends)
        by_thickness = sum(sense * _thicker(stages, j) for j, sense in loop)
        miss = wrapped(sum(sense * at_zero[j].wheel_advance for j, sense in loop) - by_thickness)
        if abs(miss) >= FITS:
            names = ", ".join(stages[j].name for j, _ in loop)
            apart = f"the loop {names} cannot be assembled: phase error {miss:.4g} pitch"
            angles = fitting_remedy(stages, _assembling_angles(stages, directions, loop, miss))
            raise ValueError(f"{apart}; {angles}; or give one shaft a gear of its own for each mesh")
        pinion = stages[i].pair.pinion
        gaps[i] = -by_thickness * 2 * pi * pinion.r_b / pinion.z
    return gaps


def _gaps_of_steps(
    stages: Sequence[Stage], directions: Sequence[int], positions: Mapping[str, tuple[float, float]]
) -> dict[int, float]:
    """Gaps [m] of the stages in which planets mesh by another gear than in their first stage, by tooth thickness."""
    first: dict[str, tuple[int, float, int]] = {}
    gaps = {}
    for i, stage in enumerate(stages):
        for (name, axial), gear in zip(stage.ends, (stage.pair.pinion, stage.pair.wheel), strict=True):
            if stage.carrier is None or not is_beside(stage, name, positions):
                continue
            j, at_first, z_first = first.setdefault(name, (i, axial, gear.z))
            held_back = _thicker(stages, i) / gear.z - directions[i] * directions[j] * _thicker(stages, j) / z_first
            if axial != at_first and held_back:
                gaps[i] = -held_back * 2 * pi * gear.r_b
    return gaps


def _thicker(stages: Sequence[Stage], number: int) -> float:
    """Half thicknesses of the teeth of a stage less those of the first such stage on its carrier [pitches]."""
    stage = stages[number]
    alike = [x for x in stages if x.carrier and stage.carrier and x.carrier.name == stage.carrier.name]
    sizes = stage.pair.pinion.z, stage.pair.wheel.z
    first = next((x for x in alike if (x.pair.pinion.z, x.pair.wheel.z) == sizes), stage)
    return _half_thicknesses(stage) - _half_thicknesses(first)


def _half_thicknesses(stage: Stage) -> float:
    """Half tooth thicknesses of pinion and wheel on their working circles [pitches]; of a ring 0."""
    gears = [gear for gear in (stage.pair.pinion, stage.pair.wheel) if isinstance(gear, Gear) and gear.z > 0]
    radii = [gear.r_b / cos(stage.pair.alpha_wt) for gear in gears]
    return sum([gear.z * gear.thickness(r) / (4 * pi * r) for gear, r in zip(gears, radii, strict=True)])


def _assembling_angles(
    stages: Sequence[Stage], directions: Sequence[int], loop: Path, miss: float
) -> dict[int, float] | None:
    """Angles by stage with which a loop can be assembled; miss: its present phase error as share of a pitch."""
    teeth = [stages[i].pair.pinion.z + stages[i].pair.wheel.z for i, _ in loop]
    senses = [-sense * directions[i] for i, sense in loop]
    slopes = np.array(senses) * teeth / (2 * pi)
    given = np.array([stages[i].angle for i, _ in loop])
    return fitting_angles(stages, loop, lambda angles: float(miss + slopes @ (angles - given)))
