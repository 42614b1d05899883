"""What a run takes of a housing: its static stiffness, or coordinates of its own, and how many modes among these.

The forces by which seats hold moving shafts are compared with those of the whole housing over frequencies up to
`HIGHEST`, in units of the bearings' stiffness: the rms of the difference over all pairs of loaded coordinates and
frequencies, over that of the forces. The first reduction is taken whose error is small.
"""

from collections.abc import Mapping
from math import pi

import numpy as np

from exugear.gearbox.elastic_housing import ElasticHousing, HousingOnBearings, seat_bearings
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.housing import bearing_on, seat_label, seat_number
from exugear.planning.coordinates import Coordinates
from fem.support.validation import require

#: Lowest and highest frequency [Hz], their number, and the damping ratio of the housing in the comparison.
LOWEST, HIGHEST, FREQUENCIES, DAMPING = 100.0, 4000.0, 200, 0.02
#: Error up to which a reduction is taken.
SMALL = 0.01


def chosen_housing(
    gearbox: Gearbox, shafts: Mapping[str, Coordinates], modes: int | None
) -> tuple[ElasticHousing | None, str]:
    """Coordinates of the housing in a run, None where static stiffness suffices, and the choice in words.

    modes   number chosen by the user; ValueError where the housing has not so many below the cap
    """
    if gearbox.housing is None:
        require(modes is None, "housing_modes need a housing: pass Gearbox(..., housing=exugear.Housing(...))")
        return None, ""
    on_bearings = housing_on_bearings(gearbox, shafts)
    most_modes = on_bearings.most_modes
    if modes is not None:
        without = "; a housing without mass= has none" if gearbox.housing.mass is None else ""
        within = f"housing_modes must lie in [0, {most_modes}], those below 15 kHz{without}; got {modes}"
        require(0 <= modes <= most_modes, within)
    if not on_bearings.loaded.size:
        return None, f"no shaft moves on its seats, and it has no influence{_on_ground(gearbox)}"
    if modes is not None:
        reduced = on_bearings.reduced(modes)
        return reduced, f"chosen by the user: {words_of_housing(gearbox, shafts, reduced)}"
    static_error = error_of(on_bearings, None)
    if static_error < SMALL and not nonlinear_seats(gearbox, shafts):
        massless = gearbox.housing.mass is None
        error = "" if massless else f", beside its modes an error of {static_error:.2g} of their forces"
        vibrating = "" if massless else "; exugear.plan(gearbox, housing_modes=n) lets it vibrate"
        number = _number_of_moving_seats(gearbox, shafts)
        between = f"static stiffness between {number} seats, whose bearings yield with them"
        return None, f"{between}{error}{vibrating}{_on_ground(gearbox)}"
    for modes_taken in range(most_modes + 1):
        reduced = on_bearings.reduced(modes_taken)
        if error_of(on_bearings, reduced) < SMALL:
            break
    return reduced, words_of_housing(gearbox, shafts, reduced)


def words_of_housing(gearbox: Gearbox, shafts: Mapping[str, Coordinates], reduced: ElasticHousing) -> str:
    """The coordinates of a housing in words, with their error."""
    on_bearings, housing = housing_on_bearings(gearbox, shafts), reduced.housing
    static_error, error = error_of(on_bearings, None), error_of(on_bearings, reduced)
    highest = f" up to {reduced.highest:.4g} Hz" if reduced.modes else ""
    number = f"{reduced.modes} modes{highest} and {reduced.size - reduced.modes} static shapes"
    accuracy = f"error {error:.2g} of the forces of its seats beside all {len(housing.stiffness)} coordinates"
    without_modes = f"static stiffness alone {static_error:.2g}"
    nonlinear = nonlinear_seats(gearbox, shafts)
    reason = f"; coordinates, as the bearings {', '.join(nonlinear)} on its seats are not linear" if nonlinear else ""
    if housing.mass is None:
        accuracy = "it has no mass, and no vibrations of its own"
        without_modes = "its shapes count by their compliance below 15 kHz"
    undamped = not housing.damping_ratio and not housing.damping_time and reduced.modes
    bounded = "; UNDAMPED, its resonances are bounded by the bearings' damping alone: damping_ratio=0.02"
    damping = bounded if undamped else ""
    return f"{number} ({accuracy}, {without_modes}){reason}{damping}{_on_ground(gearbox)}"


def housing_on_bearings(gearbox: Gearbox, shafts: Mapping[str, Coordinates]) -> HousingOnBearings:
    """The housing on the bearings of the shafts that move on its seats; LookupError without a housing."""
    if gearbox.housing is None:
        raise LookupError("the gearbox has no housing")
    moving = [name for name, kind in shafts.items() if kind.on_bearings]
    return HousingOnBearings(gearbox.housing, seat_bearings(gearbox.housing, gearbox.shafts, moving))


def error_of(on_bearings: HousingOnBearings, reduced: ElasticHousing | None) -> float:
    """Error of the forces of the seats by reduced coordinates, None: by static stiffness; 0 without mass."""
    if on_bearings.housing.mass is None:
        return 0.0
    omega = 2 * pi * np.geomspace(LOWEST, HIGHEST, FREQUENCIES)
    exact = on_bearings.support(omega, DAMPING)
    reached = on_bearings.static_support() if reduced is None else on_bearings.support(omega, DAMPING, reduced)
    return float(np.sqrt((np.abs(reached - exact) ** 2).mean() / (np.abs(exact) ** 2).mean()))


def nonlinear_seats(gearbox: Gearbox, shafts: Mapping[str, Coordinates]) -> list[str]:
    """Labels of the seats whose bearings are not linear, of shafts that move on them."""
    by_name = {shaft.name: shaft for shaft in gearbox.shafts}
    seats = [seat for seat in gearbox.housing.seats if shafts[seat[0]].on_bearings] if gearbox.housing else []
    return [seat_label(seat) for seat in seats if not bearing_on(by_name, seat).linear]


def _number_of_moving_seats(gearbox: Gearbox, shafts: Mapping[str, Coordinates]) -> int:
    return sum(shafts[name].on_bearings for name, _ in gearbox.housing.seats) if gearbox.housing else 0


def _on_ground(gearbox: Gearbox) -> str:
    """The bearings beside the seats in words."""
    ground = [
        seat_label((shaft.name, axial))
        for shaft in gearbox.shafts
        for axial in shaft.bearings
        if seat_number(gearbox.housing, shaft.name, axial) is None and shaft.name not in gearbox.planets
    ]
    return f"; bearings {', '.join(ground)} stand on ground" if ground else ""
