"""Goals of a design of flanks, and their values for a pair: static measures by `fem`, vibration by steady states."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr

from exugear.study.vibration import vibration_measures
from fem.contact.resolution import Resolution, Slices
from fem.pair.offsets import ANGLES, Offsets, check_offsets
from fem.pair.pair import GearPair
from fem.stress.flank_measures import MEASURES, flank_measures
from fem.support.arguments import checked
from fem.support.representation import quantity, short
from fem.support.validation import increasing, numbers, require, require_finite, set_fields, text_of

#: Measures of the vibration over a range of speed: units and meaning.
DYNAMIC = {
    "dte": ("m", "largest rms of the DTE over the speed"),
    "bearing_force": ("N", "largest rms of the vibration of a bearing force over the speed"),
}
OVER: dict[str, Callable] = {"max": np.max, "sum": np.sum}
NO_OFFSETS = Offsets()
#: Units in which goals are printed.
PRINTED = {"m": "um", "Pa": "GPa"}


@short(torque="N m")
@checked
@dataclass(frozen=True)
class Goal:
    """A measure of a pair that a design of its flanks makes small, under load cases and offsets.

    measure     of `fem.flank_measures`: "peak_to_peak", "harmonics", "hertz_pressure", "peak_pressure", "root_stress",
                "K_H_beta", ...; or over a range of speed by `exugear.steady_states`: "dte", the largest rms of the DTE
                [m], "bearing_force", the largest rms of the vibration of any bearing force [N]
    torque      pinion torques > 0, increasing: load cases [N m]; of "dte" and "bearing_force" loads of the driven shaft
    weight      of the measure in the objective [1 / unit of the measure]; a number for each load case, or for all; < 0
                makes the measure large, say a contact ratio
    offsets     of the wheel, which may have several values
    over        "max" or "sum" over load cases, offsets, gears
    harmonic    of the mesh, of "harmonics"
    speed       lowest and highest speed of the driving shaft [rad/s], of "dte" and "bearing_force"

    Raises ValueError for bad input.
    """

    measure: str
    torque: Any
    weight: Any = 1.0
    offsets: Offsets = NO_OFFSETS
    over: str = "max"
    harmonic: int = 1
    speed: Any = None

    def __post_init__(self):
        known = self.measure in MEASURES or self.measure in DYNAMIC
        require(known, f"measure must be one of {', '.join((*MEASURES, *DYNAMIC))}, got {text_of(self.measure)}")
        torque = increasing("torque", np.atleast_1d(numbers("torque", self.torque)))
        require(bool(torque[0] > 0), f"torque must be > 0 N m, a load case each, got {text_of(self.torque)}")
        weight = numbers("weight", self.weight)
        require_finite("weight", weight)
        require(
            bool(np.any(weight)), f"weight must not be 0 throughout, got {text_of(self.weight)}; leave the goal out"
        )
        fits = weight.shape in ((), (1,), torque.shape)
        require(fits, f"weight must be a number, or one for each of {torque.size} torques, got {text_of(self.weight)}")
        check_offsets("offsets", self.offsets)
        require(self.over in OVER, f"over must be one of {list(OVER)}, got {text_of(self.over)}")
        require(1 <= self.harmonic <= 20, f"harmonic must lie in [1, 20], got {self.harmonic}")
        needs = self.measure in DYNAMIC
        speed = numbers("speed", () if self.speed is None else self.speed)
        given = f"speed must be (lowest, highest) of {self.measure!r} in rad/s, got {text_of(self.speed)}"
        require(not needs or (speed.shape == (2,) and bool(0 <= speed[0] < speed[1])), given)
        require(
            needs or self.speed is None, f"speed must be None of {self.measure!r}, which is static, got {self.speed}"
        )
        values = np.broadcast_to(weight, torque.shape)
        set_fields(self, torque=tuple(torque.tolist()), weight=tuple(values.tolist()))
        set_fields(self, speed=tuple(speed.tolist()) if needs else None)

    @property
    def label(self) -> str:
        """Measure and load cases in words."""
        name = f"harmonic {self.harmonic}" if self.measure == "harmonics" else self.measure
        loads = ", ".join(f"{torque:g}" for torque in self.torque)
        text = f"{name} at {loads} N m"
        return text if self.offsets == NO_OFFSETS else f"{text}, {self.offsets}"

    @property
    def unit(self) -> str:
        """Unit of the measure."""
        return (MEASURES | DYNAMIC)[self.measure][0]


def in_words(goal: Goal, value: float) -> str:
    """A value of the measure of a goal in its unit."""
    return quantity(value, PRINTED.get(goal.unit, goal.unit if goal.unit != "1" else ""))


def weighed(goal: Goal, values: np.ndarray) -> float:
    """Part of the objective by values (n_torque, ...) of the measure of a goal."""
    weights = np.reshape(goal.weight, (-1,) + (1,) * (values.ndim - 1))
    return float(OVER[goal.over](weights * values))


@dataclass(frozen=True)
class Evaluation:
    """How the goals of a pair are evaluated: resolution, phases, and the gearbox in which it vibrates."""

    goals: tuple[Goal, ...]
    combine: str
    phases: int
    resolution: Resolution | Slices
    gearbox: Callable | None

    def of_pair(self, pair: GearPair, shift: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray]:
        """Largest value and part of the objective of each goal (n_goal,); shift of the offsets by tolerances."""
        static = self._static(pair, shift)
        values = [static[i] if i in static else self._vibration(goal, pair, shift) for i, goal in enumerate(self.goals)]
        parts = [weighed(goal, x) for goal, x in zip(self.goals, values, strict=True)]
        return np.array([float(np.max(x)) for x in values]), np.array(parts)

    def objective(self, parts: np.ndarray) -> np.ndarray:
        """(...) objective of parts (..., n_goal)."""
        return OVER[self.combine](parts, axis=-1)

    def _static(self, pair: GearPair, shift: Mapping[str, float]) -> dict[int, np.ndarray]:
        """Values (n_torque, ...) of the static goals by their numbers; those at the same offsets share contacts."""
        values: dict[int, np.ndarray] = {}
        static = [i for i, goal in enumerate(self.goals) if goal.measure in MEASURES]
        for offsets in dict.fromkeys(self.goals[i].offsets for i in static):
            numbers = [i for i in static if self.goals[i].offsets == offsets]
            torques = np.unique([torque for i in numbers for torque in self.goals[i].torque])
            names = list(dict.fromkeys(self.goals[i].measure for i in numbers))
            most = max(self.goals[i].harmonic for i in numbers)
            data = flank_measures(
                pair, torques, names, self.phases, offsets=shifted(offsets, pair, shift), harmonics=most,
                resolution=self.resolution, progress=False,
            )  # fmt: skip
            for i in numbers:
                values[i] = _cases_of(data, self.goals[i])
        return values

    def _vibration(self, goal: Goal, pair: GearPair, shift: Mapping[str, float]) -> np.ndarray:
        """(n_torque, ...) values of a dynamic goal."""
        if self.gearbox is None:
            raise ValueError(f"gearbox must be given for {goal.measure!r}, a function of the STE map")
        data = vibration_measures(
            pair,
            speed=goal.speed,
            load=goal.torque,
            gearbox=self.gearbox,
            offsets=shifted(goal.offsets, pair, shift),
            phases=self.phases,
            resolution=self.resolution,
        )
        require(goal.measure in data, "gearbox must have shafts on bearings for a bearing_force, they only spin")
        return data[goal.measure].transpose("load", ...).values


def _cases_of(data: xr.Dataset, goal: Goal) -> np.ndarray:
    """Values (n_torque, ...) of a goal among those of all load cases."""
    values = data[goal.measure].sel(torque=list(goal.torque))
    if goal.measure == "harmonics":
        values = values.sel(harmonic=goal.harmonic)
    return values.transpose("torque", ...).values


def shifted(offsets: Offsets, pair: GearPair, shift: Mapping[str, float]) -> Offsets:
    """Offsets, displaced by deviations of some of them."""
    moved = {name: getattr(offsets, name) for name in shift}
    if "a" in moved and moved["a"] is None:
        moved["a"] = pair.a
    new = {name: tuple(np.add(moved[name], by).tolist()) if np.ndim(moved[name]) else moved[name] + by
           for name, by in shift.items()}  # fmt: skip
    return replace(offsets, **new)


#: Names of tolerances that shift the offsets.
SHIFTS = ("a", "axial", *ANGLES)


def check_goals(name: str, value: Any) -> None:
    """ValueError unless the value is a goal, or holds several."""
    goals = [value] if isinstance(value, Goal) else value
    listed = isinstance(goals, Sequence) and len(goals) > 0 and all(isinstance(goal, Goal) for goal in goals)
    require(listed, f"{name} must be an exugear.Goal, or a list of them, got {text_of(value)}")
