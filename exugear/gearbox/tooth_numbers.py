"""Which teeth meet in the reference configuration: the phases of force laws over several pitches, whose teeth differ.

At phase 0 tooth 0 of the pinion meets tooth 0 of the wheel, at phase n tooth -n of the pinion and tooth n of the wheel,
so that either gear has the phase of a mesh known up to multiples of its own number of teeth. Every gear but the first
of a train is mounted with tooth 0, or the next one behind it, at the pitch point of its first mesh.
"""

from collections.abc import Sequence
from math import floor, gcd

from exugear.gearbox.stage import Stage
from exugear.mesh_force.ring_pair import RingPair
from fem.gear.gear import Gear
from fem.pair.pair import GearPair
from fem.ste.ste_map import deviating_teeth
from fem.support.validation import require

#: Share of a pitch that is rounding.
ROUNDING = 1e-6


def mounted(phase: float, pair: GearPair | RingPair) -> float:
    """Phase in its first mesh of a gear that is mounted there, by that of its mate: in [0, 1).

    Where the numbers of teeth have a common divisor c, in [0, c): a tooth meets every c-th tooth of the mate alone.
    """
    ahead = floor(phase + ROUNDING)
    return phase - (ahead - ahead % gcd(pair.pinion.z, abs(pair.wheel.z)))


def phase_of_law(pair: GearPair | RingPair, pitches: int, by_pinion: float, by_wheel: float) -> float:
    """Phase in [0, pitches) of a law over a number of pitches, by the teeth of both gears.

    by_pinion, by_wheel   phases of the mesh by the teeth of either gear, which differ by whole pitches

    A gear whose teeth are alike, or whose number of teeth has nothing to do with the pitches, does not count. Raises
    ValueError where a law in which teeth of both gears differ has no phase at which those meet that meet here.
    """
    if pitches == 1:
        # The second remainder turns 1.0, to which small negative phases round, into 0.0.
        return by_pinion % 1.0 % 1.0
    of_pinion, of_wheel = _counted_teeth(pair, pitches)
    further = round(by_wheel - by_pinion)
    ahead = next((n for n in range(0, of_pinion * of_wheel, of_pinion) if (n - further) % of_wheel == 0), None)
    apart = f"no two teeth of the gears z = {pair.pinion.z} and {pair.wheel.z} meet in its law that meet here"
    remedy = "let the teeth of one of these gears be alike, or their numbers have no common divisor"
    require(ahead is not None, f"{apart}; {remedy}")
    return (by_pinion + ahead) % pitches % pitches  # type: ignore[operator]


def _counted_teeth(pair: GearPair | RingPair, pitches: int) -> tuple[int, int]:
    """Numbers of teeth of pinion and wheel after which the law repeats for them; 1 where the gear does not count.

    A ring whose rim bends between bolts counts. Where neither flanks nor rim tell which gear does, it is that with as
    many teeth as there are pitches.
    """
    z = pair.pinion.z, abs(pair.wheel.z)
    counts = [n > 1 for n in deviating_teeth(pair)] if isinstance(pair, GearPair) else [False, False]
    counts[1] |= bool(getattr(pair.wheel, "support", ()))
    if not any(counts):
        counts = [n == pitches for n in z]
    if not any(counts):
        counts = [n % pitches == 0 or pitches % n == 0 for n in z]
    of_pinion, of_wheel = (gcd(n, pitches) if counted else 1 for n, counted in zip(z, counts, strict=True))
    return of_pinion, of_wheel


def sides_from_behind(stages: Sequence[Stage], senses: Sequence[int]) -> list[str]:
    """Of each stage in words: a gear that an earlier mesh sees from the other side, where its flanks are others.

    senses   sense in which the pinion of each stage drives: the map is seen from where that is counter-clockwise

    An idler is pushed on its left flanks and pushes, as seen from behind, with what were its right ones.
    """
    first: dict[tuple[str, float], int] = {}
    remarks = []
    for i, stage in enumerate(stages):
        text = ""
        for end, gear in zip(stage.ends, (stage.pair.pinion, stage.pair.wheel), strict=True):
            j = first.setdefault(end, i)
            if isinstance(gear, Gear) and senses[i] != senses[j] and _differs_from_behind(gear):
                text = f"gear of {end[0]!r} is loaded on its other flanks than in {stages[j].name}, with tooth -k for "
                text += "tooth k: take a law of a gear with those flanks, counted so"
        remarks.append(text)
    return remarks


def _differs_from_behind(gear: Gear) -> bool:
    """Whether the right flanks of a gear, seen from behind, are not its left ones."""
    left, right = gear.drive_flank, gear.coast_flank
    behind = [part.taken_from(0, -1, gear.z) if hasattr(part, "taken_from") else part for part in right]
    return len(left) != len(right) or any(part not in left for part in behind)
