"""How the teeth stand in the reference configuration, where all driving flanks touch: the phase of every mesh.

Clock of a gear: place of one of its teeth's middles from x, in the gear's sense of rotation, as share of a pitch; as
all gears turn, clocks and phases grow alike. At phase 0 the driving flanks touch at the pitch point in mid-plane: there
the pinion's tooth has its middle half a tooth behind the line of centres, the wheel's half a tooth ahead of it (half of
its thickness on the working pitch circle). So a mesh's phase is the clock of either gear minus what it is at phase 0,
and a gear with two mates hands the phase on. Gears without further mates are clocked so that the driving flanks touch.
"""

from collections.abc import Mapping, Sequence
from math import pi

import numpy as np

from exugear.gearbox.gear_train import Walk, fitting_angles, fitting_remedy, walk
from exugear.gearbox.stage import Stage
from fem.pair.placement import meshing_angles
from fem.support.validation import require

#: Shares of a pitch within which the teeth of a loop fit.
FITS = 1e-6


def phases(stages: Sequence[Stage], turns: Mapping[str, int]) -> tuple[float, ...]:
    """Phase of every stage; ValueError where gears that mesh in a loop, or given phases, leave no common one."""
    edges = [stage.ends for stage in stages]
    found: dict[int, float] = {}
    while rest := [i for i in range(len(stages)) if i not in found]:
        reached = walk(edges, edges[rest[0]][0])
        found |= _group(stages, turns, reached)
    return tuple(found[i] % 1.0 % 1.0 for i in range(len(stages)))


def _group(stages: Sequence[Stage], turns: Mapping[str, int], reached: Walk) -> dict[int, float]:
    """Phases of the stages whose gears hang together."""
    clocks = dict.fromkeys(reached.ways, 0.0)
    for i, onward in reached.tree:
        pinion, wheel = stages[i].ends
        if onward:
            clocks[wheel] = clocks[pinion] + step(stages[i], turns)
        else:
            clocks[pinion] = clocks[wheel] - step(stages[i], turns)
    _check_loops(stages, turns, reached)
    numbers = sorted([*(i for i, _ in reached.tree), *reached.closing])
    own = {i: clocks[stages[i].ends[0]] - clocks_at_zero(stages[i], turns)[0] for i in numbers}
    shift = _shift(stages, own)
    return {i: value + shift for i, value in own.items()}


def _shift(stages: Sequence[Stage], own: Mapping[int, float]) -> float:
    """By which the phases of a group reach the given one; 0 for its first stage where none is given."""
    given = {i: phase for i in own if (phase := stages[i].phase) is not None}
    first = next(iter(given or own))
    shift = given.get(first, 0.0) - own[first]
    for i, phase in given.items():
        left = f"the gears that it shares with stage {stages[first].name} leave {(own[i] + shift) % 1.0:.8g}"
        fit = f"got {phase:.8g}; leave it out, or that of the other stage"
        require(abs(wrapped(own[i] + shift - phase)) < FITS, f"phase of stage {stages[i].name}: {left}, {fit}")
    return shift


def clocks_at_zero(stage: Stage, turns: Mapping[str, int]) -> tuple[float, float]:
    """Clocks of pinion and wheel at phase 0."""
    direction = turns[stage.fast.name]
    pinion, wheel = meshing_angles(stage.pair, stage.angle, direction)
    return direction * stage.pair.pinion.z * pinion / (2 * pi), -direction * stage.pair.wheel.z * wheel / (2 * pi)


def step(stage: Stage, turns: Mapping[str, int]) -> float:
    """Clock of the wheel minus that of the pinion, at any phase."""
    pinion, wheel = clocks_at_zero(stage, turns)
    return wheel - pinion


def wrapped(share: float) -> float:
    """The same share of a pitch in [-0.5, 0.5]."""
    return share - round(share)


def _check_loops(stages: Sequence[Stage], turns: Mapping[str, int], reached: Walk) -> None:
    """The assembly condition: once round a loop of gears the teeth must fit again."""
    for i in reached.closing:
        loop = reached.loop(i, stages[i].ends)
        steps = np.array([sense * step(stages[j], turns) for j, sense in loop])
        miss = wrapped(steps.sum())
        if abs(miss) < FITS:
            continue
        slopes = np.array([-sense * turns[stages[j].fast.name] * _teeth(stages[j]) / (2 * pi) for j, sense in loop])
        given = np.array([stages[j].angle for j, _ in loop])

        def condition(angle, slopes=slopes, given=given, miss=miss):
            return miss + slopes @ (angle - given), slopes

        angles = fitting_remedy(stages, fitting_angles(stages, loop, condition))
        names = ", ".join(stages[j].name for j, _ in loop)
        ways = f"{angles}; or give one shaft a gear of its own for each mesh, which can be clocked"
        raise ValueError(f"teeth of the loop {names} miss each other by {miss:.4g} of a pitch (assembly); {ways}")


def _teeth(stage: Stage) -> int:
    return stage.pair.pinion.z + stage.pair.wheel.z
