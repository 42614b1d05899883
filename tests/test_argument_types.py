"""Public functions and classes refuse arguments of a wrong kind in words, before any work starts.

All names in `__all__` of both packages and of their public modules are called with a wrong value of one argument, while
all others are valid. A refusal is a ValueError or TypeError from a `raise` of these packages whose message holds the
name of the argument; an exception of a library, or of Python if an attribute is missing, is none.
"""

import importlib
import inspect
import linecache
import re
import sys
import traceback
from collections.abc import Iterator
from contextlib import suppress
from functools import partial
from inspect import Parameter
from math import nan
from pathlib import Path
from types import FunctionType
from typing import Any

import pytest
import xarray as xr
from valid_arguments import RING, by_name, instances, valid

import exugear
import fem
from fem.support.arguments import checked

HOME = Path(fem.__file__).parents[1]
MODULES = (
    *("fem", "fem.nonlinear", "fem.dynamic", "fem.explicit", "fem.stress", "fem.iso6336"),
    *("exugear", "exugear.plots", "exugear.spectrum", "exugear.graphics"),
)
#: Arguments and classes that only solvers make: the extent of a flank, and fields of stress.
ONLY_INSIDE = {"face"}, {"fem.stress.Field", "fem.ReducedHousing"}
WRONG: dict[str, Any] = {
    "None": None,
    "object": object(),
    "string": "abc",
    "strings": ["a", "b"],
    "dict": {"a": 1.0},
    "huge": 10**400,
    "nan": nan,
    "dataset": xr.Dataset({"x": ("y", [1.0, 2.0])}),
    "ring": RING,
}
#: Arguments by name for which one of those values is valid.
TAKEN = {
    **dict.fromkeys(("name", "title", "label", "message", "unit", "meaning", "fileName"), "string"),
    **dict.fromkeys(
        (
            "colour",
            "colours",
            "path",
            "MeshForce.coast_unlike",
            "BuiltPlan.contact",
            "units",
            "long_name",
        ),
        "string",
    ),
    **dict.fromkeys(("fem.static_transmission_error.phases", "map_cost.phases"), "None"),
    **dict.fromkeys(
        (
            "SpeedReached.shaft",
            "Apart.stage",
            "RollingBearing.kind",
            "RollingBearing.estimate",
            "Plan.housing",
            "BuiltPlan.housing",
        ),
        "string",
    ),
    **dict.fromkeys(("Plan.linear", "BuiltPlan.linear"), "strings"),
    **dict.fromkeys(("save.data", "Run.data", "FlankCorrections.table", "BuiltPlan.mesh_resonances"), "dataset"),
    **dict.fromkeys(
        (
            "Model.bodies",
            "Model.spins",
            "Model.rotor_spins",
            "BuiltPlan.largest_torques",
            "Model.end_markers",
            "MeshForce.fixed_offsets",
            "EnergyBalance.losses",
            "LoadCase.torques",
            "FlankCorrections.corrections",
            "FlankCorrections.pairs",
            "Plan.steps",
            "BuiltPlan.steps",
        ),
        "dict",
    ),
    **dict.fromkeys(("store", "landscape.first", "landscape.second"), "string"),
    **dict.fromkeys(("SweepStopped.data", "OptimalFlanks.evaluated"), "dataset"),
    **dict.fromkeys([f"OptimalFlanks.{name}" for name in ("values", "goals", "unmodified", "finer")], "dict"),
    "OptimalFlanks.objective": "nan",
    **dict.fromkeys(("Run.wall_time", "Quantity.value", "level.rms", "plot_run_up.resonances"), "nan"),
    **dict.fromkeys((f"Envelope.{name}" for name in ("abscissa", "low", "high", "rms")), "nan"),
    **dict.fromkeys((f"Peaks.{name}" for name in ("abscissa", "height")), "nan"),
    **dict.fromkeys(("CreateGearContact.pair", "CreateGearFriction.pair"), "ring"),
    **dict.fromkeys(("loss.pair", "table.pair", "power_law.pair", "check_pair.pair"), "ring"),
}
#: Patterns of the names of arguments in messages, if they differ; "a" is also an article.
CALLED = {"ste": "ste|map", "mesh": "mesh|map", "runs": "runs?", "phase": "phases?", "a": "a must"}
#: Functions that start the work: a refusal must come before them.
WORK = (
    *(
        "fem.ste.map_solver.sweep",
        "fem.stress.flank_loads.tooth_contacts",
        "fem.reference.nonlinear.static_problem",
        "fem.reference.dynamic.equations_of_motion",
    ),
    *(
        "fem.reference.deformable_gear.clamped_pair",
        "exugear.multibody.equilibrium.solve_initial_equilibrium",
        "exugear.multibody.gear_contact.user_functions",
    ),
)


class Started(BaseException):
    """Work has started."""


def methods(kind: type) -> list[str]:
    """Names that a class defines, or inherits from another class of these packages."""
    ours = [base for base in kind.__mro__ if base.__module__.split(".")[0] in ("fem", "exugear")]
    return sorted({name for base in ours for name in vars(base)})


def public() -> Iterator[tuple[str, Any]]:
    """(name, function, class or method) of all that is public."""
    for home in MODULES:
        module = eval(home, {"fem": fem, "exugear": exugear})
        for name in module.__all__:
            value, path = getattr(module, name), f"{home}.{name}"
            if inspect.isfunction(value) or inspect.isclass(value):
                yield path, value
            for method in methods(value) if inspect.isclass(value) else ():
                static = inspect.getattr_static(value, method)
                if not method.startswith("_") and isinstance(static, FunctionType | classmethod):
                    yield f"{path}.{method}", getattr(value, method)


def named(value) -> dict[str, Parameter]:
    """Named arguments except self."""
    parts = inspect.signature(value).parameters.items()
    return {name: part for name, part in parts if name != "self" and part.kind is not Parameter.VAR_KEYWORD}


def listed() -> dict[str, Any]:
    """Public functions and classes whose arguments users pass."""
    faces, fields = ONLY_INSIDE
    taking = {path: value for path, value in public() if named(value) and path not in fields}
    return {path: value for path, value in taking.items() if not faces & set(named(value))}


LISTED = listed()


def bound(path: str):
    """The function or class, or the method of a valid instance."""
    owner = path.split(".")[-2]
    value = LISTED[path]
    is_method = owner in instances() and not inspect.ismethod(value)
    return partial(value, instances()[owner]) if is_method else value


def arguments(path: str) -> dict[str, Any]:
    """Valid arguments by name, without those that are None by default."""
    values = {name: valid(path, name) for name in named(LISTED[path])}
    return {name: value for name, value in values.items() if value is not None}


def wrong(path: str, name: str) -> dict[str, Any]:
    """Values that the argument must not take."""
    default = named(LISTED[path])[name].default
    ends = [f"{'.'.join(path.split('.')[i:])}.{name}" for i in range(path.count(".") + 1)]
    taken = {TAKEN[end] for end in (name, *ends) if end in TAKEN} | ({"None"} if default is None else set())
    return {kind: value for kind, value in WRONG.items() if kind not in taken}


def objection(call, name: str) -> str | None:
    """Why a call does not refuse an argument as it should, or None if it does."""
    try:
        call()
    except Exception as error:
        *_, last = traceback.walk_tb(error.__traceback__)
        file = Path(last[0].f_code.co_filename)
        ours = any(file.is_relative_to(HOME / package) for package in ("fem", "exugear"))
        line = linecache.getline(str(file), last[1]).strip()
        is_named = re.search(rf"\b({CALLED.get(name, name)})\b", str(error))
        if type(error) in (ValueError, TypeError) and ours and line.startswith("raise") and is_named:
            return None
        return f"{type(error).__name__}: {str(error)[:150]} ({file.name}: {line[:60]})"
    except Started:
        return "work has started"
    return "taken"


@pytest.fixture(scope="module", autouse=True)
def no_work():
    instances(), by_name()

    def started(*args, **options):
        raise Started

    with pytest.MonkeyPatch.context() as patch:
        for path in WORK:
            home, name = path.rsplit(".", 1)
            function = getattr(importlib.import_module(home), name)
            for module in [x for x in sys.modules.values() if getattr(x, "__dict__", {}).get(name) is function]:
                patch.setattr(module, name, started)
        yield


@pytest.mark.parametrize("path", LISTED)
def test_wrong_kinds_are_refused_in_words(path):
    call, valid_arguments = bound(path), arguments(path)
    objections = {}
    for name in named(LISTED[path]):
        for kind, value in wrong(path, name).items():
            objections[name, kind] = objection(partial(call, **valid_arguments | {name: value}), name)
    assert {case: words for case, words in objections.items() if words} == {}


@pytest.mark.parametrize("path", LISTED)
def test_the_other_arguments_are_valid(path):
    """A call without a wrong argument returns, or reaches the work that it is for."""
    with suppress(Started):
        bound(path)(**arguments(path))


def unguarded(pair):
    return pair.pinion


def from_a_library(torque):
    return xr.Dataset({"torque": ("torque", torque)})


def nameless(torque):
    raise ValueError(f"must be a number, got {torque}")


def careless(torque):
    return torque


def slow(torque):
    return fem.static_transmission_error(valid("", "pair"), 1.0, progress=False)


@checked
def guarded(pair: fem.GearPair, *, torque: float | None = None, parts: tuple[fem.Gear, ...] = (), **options: float):
    return pair


@pytest.mark.parametrize(
    ("function", "name", "words"),
    [
        (unguarded, "pair", "AttributeError"),
        (from_a_library, "torque", "Error"),
        (nameless, "torque", "must be a number"),
        (careless, "torque", "taken"),
        (slow, "torque", "work has started"),
    ],
)
def test_a_missing_refusal_is_an_objection(function, name, words):
    assert words in str(objection(partial(function, **{name: object()}), name))


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"pair": None}, "pair must be a fem.GearPair, got None"),
        ({"pair": RING}, r"pair must be a fem.GearPair, got RingPair\("),
        ({"torque": "1"}, "torque must be a real number or None, got '1'"),
        ({"torque": 10**400}, "torque must be a real number or None, got a number beyond those of floats"),
        ({"torque": WRONG["dataset"]}, "torque must be a real number or None, got an xarray.Dataset"),
        ({"parts": [1.0]}, "parts must be a list, each a fem.Gear, got"),
        ({"further": "1"}, "further must be one real number in SI units, got '1'"),
    ],
)
def test_words_of_refusals(changed, words):
    pair = valid("", "pair")
    assert guarded(pair, torque=1, parts=[pair.pinion], further=2) is guarded(pair) is pair
    with pytest.raises(ValueError, match=words):
        guarded(**{"pair": pair} | changed)


def test_refusals_that_users_reported():
    ring, model, data = RING, valid("", "model"), xr.Dataset()
    for call, words in (
        (lambda: fem.static_transmission_error(ring, 100.0), "pair must be a fem.GearPair"),
        (lambda: fem.iso6336.mesh_stiffness(ring), "pair must be a fem.GearPair"),
        (lambda: exugear.draw(model.mbs), "model must be an exugear.Model"),
        (lambda: exugear.plots.plot_run_up(data), "run must be an exugear.Run or its data"),
        (lambda: fem.GearPair(None, valid("", "gear")), "pinion must be a fem.Gear, got None"),
        (
            lambda: fem.static_transmission_error(valid("", "pair"), 10**400),
            "torque must hold real numbers",
        ),
        (lambda: exugear.CreateGearContact(model.mbs), "pair must be a fem.GearPair"),
        (lambda: exugear.CreateGearFriction(model.mbs, pair=ring, force=valid("", "force")), "friction must be"),
        (lambda: fem.UpTo(10**5000), "torque must be one real number in SI units"),
    ):
        with pytest.raises(ValueError, match=words):
            call()


@pytest.mark.parametrize("value", [None, "100", 10**400, nan], ids=["None", "string", "huge", "nan"])
def test_functions_of_time_that_give_no_numbers(value):
    options = {"speed": 50.0, "load": 100.0, "duration": 0.01, "progress": False}
    for name in ("speed", "load"):
        with pytest.raises(ValueError, match=rf"{name}\(t\) must be"):
            exugear.run_up(valid("", "model"), **options | {name: lambda t: value})


@pytest.mark.parametrize(
    "value", [None, "abc", [1e-6, "abc"], 10**400, nan], ids=["None", "string", "mixed", "huge", "nan"]
)
def test_laws_are_asked_for_numbers(value):
    law = valid("", "force")
    for name in ("phase", "deflection", "rate"):
        with pytest.raises(ValueError, match=f"{name} must"):
            law(**{"phase": 0.1, "deflection": 1e-6, "rate": 0.0} | {name: value})
    with pytest.raises(ValueError, match="misalignment must"):
        law.at(misalignment=None)
