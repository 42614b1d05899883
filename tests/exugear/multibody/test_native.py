"""Contacts that Exudyn calls without Python: same results and messages as by way of Python, and no memory leak.

On Linux x86-64 the direct call must work with the pinned versions: nothing here is skipped there.
"""

import gc
import os
import pickle
import platform
import re
import sys
import weakref

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np
import pytest
from bearing_boxes import box_of
from numba import njit
from paper_gears import paper_pair
from scenes import INERTIA, smooth_box, smooth_map

import exugear
from exugear.multibody import direct_call
from fem.units import um

PAIR = paper_pair()
PLANAR = exugear.plan(box_of())
SCENES = {
    "spin": (smooth_box(), None),
    "planar": (box_of(), PLANAR),
    "spatial": (box_of(), PLANAR.with_bodies()),
}
SYSTEM = sys.platform, platform.machine(), platform.python_implementation()
needs_native = pytest.mark.skipif(SYSTEM != ("linux", "x86_64", "CPython"), reason="portable path only")


@needs_native
def test_exudyn_and_python_call_the_same_compiled_code():
    kernel = njit(lambda address, t, *x: (t - x[0],))
    assert direct_call.entry_of(kernel, 1, 1)
    assert kernel(0, 3.0, 1.0, 2.0) == (2.0,)
    assert len(kernel.overloads) == 1


def turning(kernel) -> exu.MainSystem:
    """A body whose torque a kernel gives, called directly."""

    def by_python(mbs, t, item, q, q_t):
        return kernel(0, t, *q, *q_t)

    mbs = exu.SystemContainer().AddSystem()
    node = mbs.AddNode(eii.Node1D(referenceCoordinates=[0]))
    mbs.AddObject(eii.ObjectRotationalMass1D(inertia=INERTIA, nodeNumber=node))
    function = direct_call.native_user_function(by_python, kernel, (0,), 1)
    mbs.AddObject(eii.ObjectGenericODE2(nodeNumbers=[node], forceUserFunction=function))
    mbs.Assemble()
    return mbs


@needs_native
def test_a_kernel_is_compiled_when_exudyn_first_calls_it():
    kernel = njit(lambda address, t, *x: (-1.0,))
    mbs = turning(kernel)
    assert not kernel.overloads
    mbs.SolveDynamic(settings_of(100))
    assert mbs.systemData.GetODE2Coordinates_t() == pytest.approx([-1e-3 / INERTIA], rel=1e-12)
    assert len(kernel.overloads) == 1


@needs_native
def test_a_kernel_that_cannot_be_compiled_stops_the_solver_with_the_reason(capfd):
    mbs = turning(njit(lambda address, t, *x: (x.no_such_field,)))
    with pytest.raises(RuntimeError, match="TypingError"):
        mbs.SolveDynamic(settings_of(100))
    assert "no_such_field" in capfd.readouterr().err


@pytest.fixture
def both_paths(monkeypatch):
    """Results of a function by way of Python and by the direct call."""

    def call(function, *arguments):
        results = []
        for portable in ("1", ""):
            monkeypatch.setenv("EXUGEAR_PORTABLE", portable)
            results.append(function(*arguments))
        return results

    return call


def spinning(law, friction=None):
    """Two gears free to spin, in contact at 10 um."""
    mbs = exu.SystemContainer().AddSystem()
    nodes = [mbs.AddNode(eii.Node1D(referenceCoordinates=[0])) for _ in range(2)]
    bodies = [mbs.AddObject(eii.ObjectRotationalMass1D(inertia=INERTIA, nodeNumber=node)) for node in nodes]
    contact = mbs.CreateGearContact(itemNumbers=bodies, pair=PAIR, force=law, friction=friction)
    mbs.Assemble()
    mbs.systemData.SetODE2Coordinates([10 * um / PAIR.pinion.r_b, 0], exu.ConfigurationType.Initial)
    return mbs, contact


def settings_of(steps: int, h: float = 1e-5) -> exu.SimulationSettings:
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    settings.timeIntegration.endTime, settings.timeIntegration.numberOfSteps = steps * h, steps
    return settings


def call_of(mbs, contact: int):
    """The user function of a contact, and whether Exudyn calls it directly."""
    function = mbs.GetObject(contact)["forceUserFunction"]["function"]
    return function, type(function).__name__ == "builtin_function_or_method"


@needs_native
def test_contacts_are_called_without_python(monkeypatch):
    """With these versions of Exudyn, numba, llvmlite and numpy; plan and run state it."""
    monkeypatch.delenv("EXUGEAR_PORTABLE", raising=False)
    assert direct_call.obstacle() == ""
    model = exugear.build(smooth_box())
    assert "contact: called without Python" in str(model.plan)
    run = exugear.run_up(model, speed=100.0, duration=1e-3, load=100.0, progress=False)
    assert "contact: called without Python" in run.data.attrs["plan"]


@needs_native
@pytest.mark.parametrize("scene", SCENES)
def test_the_same_numbers_where_contact_is_lost(both_paths, scene, measured):
    box, plan = SCENES[scene]

    def solve():
        model = exugear.build(box, plan=plan)
        load = lambda t: 20 - 150 * np.sin(2 * np.pi * 50 * t)  # noqa: E731
        run = exugear.run_up(model, speed=(100.0, 120.0), duration=0.02, load=load, progress=False)
        return run.data["dte"].values, run.data["mesh_force"].values, call_of(model.mbs, model.meshes[0].contact)[1]

    (dte, force, is_direct), (dte_direct, force_direct, is_direct_now) = both_paths(solve)
    assert (is_direct, is_direct_now) == (False, True)
    assert (force == 0).any()
    assert (force > 1000).any()
    measured("contacts called without Python", np.abs(dte - dte_direct).max() / np.abs(dte).max(), 1e-12)
    assert np.abs(force - force_direct).max() <= 1e-12 * np.abs(force).max()


@needs_native
def test_the_same_numbers_with_friction_and_in_statics(both_paths, law):
    def solve():
        mbs, _ = spinning(law, exugear.MeshFriction.of_pair(PAIR, 0.06))
        mbs.systemData.SetODE2Coordinates_t([30.0, -30.0], exu.ConfigurationType.Initial)
        mbs.SolveDynamic(settings_of(200))
        fixed = mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(eii.NodePointGround()), coordinate=0))
        for node in (0, 1):
            marker = mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=node, coordinate=0))
            mbs.AddObject(eii.CoordinateSpringDamper(markerNumbers=[fixed, marker], stiffness=1e4))
        dynamic = mbs.systemData.GetODE2Coordinates()
        mbs.Assemble()
        mbs.systemData.SetODE2Coordinates([20 * um / PAIR.pinion.r_b, 0], exu.ConfigurationType.Initial)
        mbs.SolveStatic(settings_of(1))
        return np.r_[dynamic, mbs.systemData.GetODE2Coordinates()]

    portable, direct = both_paths(solve)
    assert np.abs(portable[:2]).min() > 0.01
    assert portable == pytest.approx(direct, rel=1e-12)


@needs_native
@pytest.mark.parametrize("scene", SCENES)
def test_the_same_message_where_a_run_leaves_the_map(both_paths, scene):
    box, plan = SCENES[scene]

    def solve():
        model = exugear.build(box, plan=plan)
        with pytest.raises(RuntimeError) as caught:
            load = lambda t: 150 + 4e5 * t  # noqa: E731
            exugear.run_up(model, speed=100.0, duration=0.1, load=load, step=2e-5, progress=False)
        return str(caught.value)

    portable, direct = both_paths(solve)
    assert portable == direct
    assert re.search(r"^at t = .*: deflection .* lies beyond the map", portable)


@needs_native
def test_the_user_function_lives_as_long_as_exudyn_holds_it(monkeypatch):
    monkeypatch.delenv("EXUGEAR_PORTABLE", raising=False)
    passing = exugear.MeshForce.from_ste(smooth_map())
    mbs, contact = spinning(passing)
    function, is_direct = call_of(mbs, contact)
    assert is_direct
    alive = weakref.ref(function.__module__.portable)
    mbs.variables.clear()
    del passing, function
    gc.collect()
    assert alive() is not None
    mbs.SolveDynamic(settings_of(100))
    assert np.isfinite(mbs.systemData.GetODE2Coordinates()).all()
    mbs.Reset()
    gc.collect()
    assert alive() is None


@needs_native
def test_a_direct_user_function_can_be_called_from_python(law, monkeypatch):
    monkeypatch.delenv("EXUGEAR_PORTABLE", raising=False)
    mbs, contact = spinning(law)
    function, _ = call_of(mbs, contact)
    assert "gear_contact" in repr(function)
    forces = function(mbs, 0.0, contact, [1e-4, 0.0], [0.0, 0.0])
    assert forces[0] == pytest.approx(-law(0.0, 1e-4 * PAIR.pinion.r_b) * PAIR.pinion.r_b)
    with pytest.raises(RuntimeError, match="lies far beyond the map"):
        function(mbs, 0.0, contact, [0.1, 0.0], [0.0, 0.0])
    with pytest.raises(TypeError):
        pickle.dumps(function)
    sensor = mbs.CreateGearSensor(contact, storeInternal=True)
    mbs.Assemble()
    mbs.systemData.SetODE2Coordinates([10 * um / PAIR.pinion.r_b, 0], exu.ConfigurationType.Initial)
    mbs.SolveDynamic(settings_of(10))
    assert mbs.GetSensorStoredData(sensor)[0, 1] == pytest.approx(10 * um)


def memory() -> int:
    """Of this process [bytes]."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


@needs_native
def test_a_million_calls_leave_no_memory_behind(law, monkeypatch):
    monkeypatch.delenv("EXUGEAR_PORTABLE", raising=False)
    mbs, _ = spinning(law)
    mbs.SolveDynamic(settings_of(1000))
    growths = []
    for _ in range(3):
        before = memory()
        mbs.SolveDynamic(settings_of(200_000, 1e-6))
        growths.append(memory() - before)
    assert min(growths) < 1.6e6, "each solve has left something behind"


@pytest.fixture
def unchecked(monkeypatch, tmp_path):
    """As in a new process whose cache is empty."""
    monkeypatch.delenv("EXUGEAR_PORTABLE", raising=False)
    monkeypatch.setenv("EXUGEAR_CACHE", str(tmp_path))
    direct_call._obstacle.cache_clear()
    yield
    direct_call._obstacle.cache_clear()


@needs_native
@pytest.mark.parametrize(
    ("script", "end"),
    [("import os; os.abort()", "-6: no message"), ("raise SystemExit('records differ')", "1: records differ")],
)
def test_a_failed_check_leaves_the_portable_path_and_the_plan_says_so(
    unchecked, law, monkeypatch, tmp_path, script, end
):
    monkeypatch.setattr(direct_call, "SCRIPT", script)
    assert not call_of(*spinning(law))[1]
    assert len(list(tmp_path.iterdir())) == 1
    plan = exugear.build(smooth_box()).plan
    assert f"contact: by way of Python (its check ended with {end})" in str(plan)


def test_other_platforms_take_the_portable_path_and_the_plan_states_it(unchecked, law, monkeypatch):
    monkeypatch.setattr("platform.machine", lambda: "arm64")
    assert not call_of(*spinning(law))[1]
    assert "by way of Python (only linux x86_64 CPython can do without, this is" in direct_call.call_path()


def test_an_exudyn_without_help_is_called_by_way_of_python(unchecked, law, monkeypatch):
    monkeypatch.delattr("exudyn.Help")
    assert not call_of(*spinning(law))[1]
    assert direct_call.call_path().startswith("by way of Python (")


def test_the_portable_path_can_be_requested(law, monkeypatch):
    monkeypatch.setenv("EXUGEAR_PORTABLE", "1")
    assert not call_of(*spinning(law))[1]
    assert direct_call.call_path() == "by way of Python (EXUGEAR_PORTABLE requests it)"
