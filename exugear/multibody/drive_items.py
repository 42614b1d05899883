"""Drive and load as items of Exudyn: constraints and a load that a system has from when its user asks for it.

In a run contacts evaluate imposed speeds and apply the load. There the items would only cost: an inactive constraint
keeps its multiplier as an unknown, and a load of 0 is evaluated. A run on spins takes 1.4 times its time with them, and
1.2 times where they stand on the ground (`tests/benchmarks/benchmark_drive.py`). Exudyn's user needs them: a system
that he solves or linearizes himself, or to which he adds items, must be held and loaded.

So a system is built without them. Asking for the system, or for the number of one of them, adds them with the
parameters that they have by then; so does a run whose speeds the constraints must impose
(`exugear.multibody.drive_and_load`). From there on they stay, in all runs. A static solve of a system without them has
such constraints only for as long as it takes.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import exudyn.itemInterface as eii

from exugear.multibody.exudyn_objects import assemble_in_state, quiet
from exugear.multibody.turns import turn_with

#: Functions of the offset of a constraint, and of its rate; all parameters of a constraint and of the load that change.
OFFSETS = "offsetUserFunction", "offsetUserFunction_t"
CONSTRAINT = *OFFSETS, "offset", "markerNumbers", "activeConnector", "Vshow"
LOAD = "load", "loadUserFunction", "markerNumber"


@dataclass(eq=False)
class DriveItems:
    """The constraints that impose the speeds of a built system, and the load on its driven shaft.

    mbs           the system
    ground        marker on a coordinate that stands
    aside         marker on a second such coordinate, for items that act on nothing
    ends          markers on the spins that the constraints hold, that of the driving shaft first
    driven        marker on the spin that the load acts on
    constraints   parameters of each constraint while it is not in the system
    torque        parameters of the load while it is not in the system
    numbers       object numbers of the constraints, in the order of the ends; empty while they are not in the system
    load          number of the load; None while it is not in the system
    busy          whether exugear solves the system: it stays as it is meanwhile
    """

    mbs: Any
    ground: int
    aside: int
    ends: Sequence[int]
    driven: int
    constraints: list[dict[str, Any]] = field(init=False)
    torque: dict[str, Any] = field(init=False)
    numbers: tuple[int, ...] = ()
    load: int | None = None
    busy: bool = False

    def __post_init__(self):
        at_rest = dict.fromkeys(OFFSETS, 0) | {"offset": 0.0, "activeConnector": True, "Vshow": True}
        self.constraints = [at_rest | {"markerNumbers": [self.ground, end]} for end in self.ends]
        self.torque = {"load": 0.0, "loadUserFunction": 0, "markerNumber": self.driven}

    @property
    def added(self) -> bool:
        """Whether the items are in the system, where they stay."""
        return self.load is not None

    @property
    def loads(self) -> tuple[int, ...]:
        """Number of the load; empty while it is not in the system."""
        return () if self.load is None else (self.load,)

    def ask(self, *, for_numbers: bool = True) -> "DriveItems":
        """The items, which the system has from now on; another thread that solves the system ends before.

        for_numbers   whether there must be items: RuntimeError where this thread solves the system
        """
        if not self.added:
            with turn_with(self.mbs):
                unknown = "the system has no drive and load while it is solved; ask for model.mbs, drive or load before"
                if for_numbers and self.busy:
                    raise RuntimeError(unknown)
                if not self.busy:
                    self.add()
        return self

    def add(self) -> None:
        """Add the items, to stay; the system keeps its state."""
        if self.added:
            return
        self.numbers = self._add_constraints()
        self.load = self.mbs.AddLoad(eii.LoadCoordinate(name="load", markerNumber=self.driven))
        for name, value in self.torque.items():
            self.mbs.SetLoadParameter(self.load, name, value)
        with quiet():
            assemble_in_state(self.mbs)

    def _add_constraints(self) -> tuple[int, ...]:
        """Add the constraints, that of the driving shaft last; returns their numbers."""
        numbers = []
        for i, parameters in reversed([*enumerate(self.constraints, start=1)]):
            name = "drive" if i == 1 else f"drive {i}"
            number = self.mbs.AddObject(eii.CoordinateConstraint(name=name, markerNumbers=parameters["markerNumbers"]))
            numbers.append(number)
            for parameter, value in parameters.items():
                self.mbs.SetObjectParameter(number, parameter, value)
        return tuple(reversed(numbers))

    @contextmanager
    def holding(self) -> Iterator[None]:
        """Let the constraints be in the system for a while where it has none; it keeps its state."""
        if self.added:
            yield
            return
        self.numbers = self._add_constraints()
        try:
            assemble_in_state(self.mbs)
            yield
        finally:
            for number in sorted(self.numbers, key=int, reverse=True):
                self.mbs.DeleteObject(number, deleteDependentItems=False, suppressWarnings=True)
            self.numbers = ()
            assemble_in_state(self.mbs)

    def set_constraint(self, i: int, parameters: Mapping[str, Any]) -> None:
        """Set parameters of the constraint with this number among the ends."""
        if not self.added:
            self.constraints[i] |= parameters
        for name, value in parameters.items() if self.numbers else ():
            self.mbs.SetObjectParameter(self.numbers[i], name, value)

    def set_aside(self) -> None:
        """Let the items stand on the ground, where they act on nothing and cost a step least."""
        for i in range(len(self.ends)):
            self.set_constraint(i, {"markerNumbers": [self.ground, self.aside], "activeConnector": False})
        self.set_load({"markerNumber": self.aside})

    def set_load(self, parameters: Mapping[str, Any]) -> None:
        """Set parameters of the load."""
        if not self.added:
            self.torque |= parameters
            return
        for name, value in parameters.items():
            self.mbs.SetLoadParameter(self.load, name, value)

    def parameters(self) -> tuple[list[dict[str, Any]], dict[str, Any]]:
        """Present parameters of each constraint and of the load."""
        if not self.added:
            return [dict(constraint) for constraint in self.constraints], dict(self.torque)
        constraints = [{name: self.mbs.GetObjectParameter(i, name) for name in CONSTRAINT} for i in self.numbers]
        load = self.mbs.GetLoad(self.load)
        return constraints, {name: load[name] for name in LOAD}

    def set_parameters(self, parameters: tuple[list[dict[str, Any]], dict[str, Any]]) -> None:
        """Set what `parameters` has returned."""
        for i, constraint in enumerate(parameters[0]):
            self.set_constraint(i, constraint)
        self.set_load(parameters[1])
