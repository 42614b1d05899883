"""What the model of a planetary set holds and what it leaves out, in words for the plan."""

from collections.abc import Mapping

from exugear.gearbox.gearbox import Gearbox
from exugear.planning.coordinates import Coordinates
from exugear.planning.ring_words import words_of_ring


def stages_of_sets(gearbox: Gearbox) -> dict[str, tuple[str, ...]]:
    """Labels of the stages on each carrier, by its name."""
    by_carrier: dict[str, tuple[str, ...]] = {}
    for label, stage in zip(gearbox.labels, gearbox.stages, strict=True):
        if stage.carrier:
            by_carrier[stage.carrier.name] = (*by_carrier.get(stage.carrier.name, ()), label)
    return by_carrier


def words_of_sets(gearbox: Gearbox, kinds: Mapping[str, Coordinates]) -> dict[str, str]:
    """What is modelled of each set and what is skipped, with the reason, by the name of its carrier.

    kinds   coordinates of each shaft
    """
    words = {}
    for carrier in stages_of_sets(gearbox):
        on_carrier = [stage for stage in gearbox.stages if stage.carrier and stage.carrier.name == carrier]
        shafts = dict.fromkeys(shaft.name for stage in on_carrier for shaft in stage.shafts)
        planets = [name for name in shafts if name in gearbox.planets]
        members = [name for name in shafts if name not in gearbox.planets]
        words[carrier] = "; ".join([
            _words_of_planets(planets, kinds),
            _words_of_members(members, kinds),
            *_words_of_phases(gearbox, carrier),
            *[words_of_ring(of_set) for of_set in gearbox.sets if of_set.carrier.name == carrier],
            "skipped: bending of the carrier",
        ])  # fmt: skip
    return words


def _words_of_planets(planets: list[str], kinds: Mapping[str, Coordinates]) -> str:
    number = f"{len(planets)} planets"
    if all(kinds[name] is Coordinates.SPIN for name in planets):
        return f"{number} on ideal pins (no pin= given): skipped is how pins yield and share the load"
    if all(kinds[name] is Coordinates.PLANAR for name in planets):
        return f"{number} on elastic pins move in the plane: skipped are tilt and axial motion, which nothing excites"
    return f"{number} on elastic pins move and tilt in space"


def _words_of_members(members: list[str], kinds: Mapping[str, Coordinates]) -> str:
    ideal = [name for name in members if kinds[name] is Coordinates.SPIN]
    floating = [name for name in members if name not in ideal]
    texts = [f"{', '.join(floating)} on bearings move sideways"] if floating else []
    if ideal:
        texts.append(f"{', '.join(ideal)} on ideal axes (no bearings given): skipped is how they move sideways")
    return ", ".join(texts)


def _words_of_phases(gearbox: Gearbox, carrier: str) -> list[str]:
    """Meshing sequence of a set that was given as data."""
    return [of_set.words[0] for of_set in gearbox.sets if of_set.carrier.name == carrier]
