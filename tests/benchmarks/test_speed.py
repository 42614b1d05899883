"""Times with their errors beside them: pytest tests/benchmarks -m slow -n 0 --benchmark-enable.

Without --benchmark-enable every one runs once, most a fifth as long. Times mean little on a busy machine; the
yardsticks were made for that: one factorization of the gear, Exudyn's step with a spring or with bearings of its own.
"""

from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import exudyn as exu
import numpy as np
import pytest
from benchmark_growth import exudyn_spring, fourth_order_settings
from benchmark_states import KINDS, MODES, PHASES, pair_of_kind
from compliance_products import elastic_body
from scenes import INERTIA, smooth_box

import exugear
import fem
from fem.units import mm, rpm, um

pytestmark = pytest.mark.slow
STEP, STEPS = 2.4e-5, 100_000


@pytest.fixture
def share(benchmark) -> float:
    """Of the steps, phases and seconds, which are all needed for times alone."""
    return 1.0 if benchmark.enabled else 0.2


@pytest.fixture
def empty_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("EXUGEAR_CACHE", str(tmp_path))


def test_factorization_of_the_gear(benchmark, paper_pair, empty_cache):
    """Yardstick of the curve: all solutions of one gear, nothing else."""
    gear = paper_pair.pinion
    body = benchmark.pedantic(elastic_body, (gear, fem.Density().with_teeth(2, behind=1)), rounds=1)
    assert body.face.share == 0.5


@pytest.mark.parametrize(("resolution", "allowed"), [(fem.Resolution(), 0.005), (fem.Slices(), 0.02)])
def test_transmission_error_curve(benchmark, paper_pair, empty_cache, resolution, allowed):
    """30 phases, 150 and 350 N m, nothing cached; error against independent finite elements."""
    options = {"resolution": resolution, "progress": False}
    ste = benchmark.pedantic(fem.static_transmission_error, (paper_pair, [150, 350], 30), options, rounds=1)
    means = ste["te"].mean("phase").values.squeeze() / um
    error = np.abs(means / [7.617, 16.98] - 1).max()
    benchmark.extra_info["error of the mean"] = error
    assert error < allowed


def test_states_in_slice_mode(benchmark, paper_pair, share):
    angles, opening, axial = np.linspace(-2, 2, 5) * 1e-4, np.linspace(0, 0.2, 5) * mm, np.linspace(-1, 1, 3) * mm
    offsets = fem.Offsets(a=paper_pair.a + opening, misalignment=angles, axial=axial)
    options = {"offsets": offsets, "resolution": fem.Slices(), "progress": False}
    torques, phases = np.linspace(20, 400, 8), round(share * 30)
    ste = benchmark.pedantic(fem.static_transmission_error, (paper_pair, torques, phases), options, rounds=1)
    benchmark.extra_info["states"] = int(ste["te"].size)
    assert ste["te"].size == 8 * phases * 5 * 5 * 3


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("kind", KINDS)
def test_state_of_a_map(benchmark, kind, mode, share):
    """A whole map with the compliances in the cache; its time over its states stands in the extra information."""
    pair, (torque, resolution) = pair_of_kind(*KINDS[kind]), MODES[mode]
    options = {"resolution": resolution, "progress": False}
    calls = {"rounds": 3, "warmup_rounds": 1}
    ste = benchmark.pedantic(fem.static_transmission_error, (pair, torque, round(share * PHASES)), options, **calls)
    if benchmark.stats:
        benchmark.extra_info["ms a state"] = benchmark.stats["median"] / ste["te"].size * 1e3
    assert (ste["te"] > 0).all()


def test_spring_of_exudyn(benchmark, share):
    """Yardstick of the run-ups: as many steps of two masses, one of them driven, on a spring that is built in."""
    _container, mbs = exudyn_spring(INERTIA)
    settings = fourth_order_settings(STEP, round(share * STEPS))
    assert benchmark.pedantic(mbs.SolveDynamic, (settings,), rounds=3, warmup_rounds=1)


def test_bearings_of_exudyn(benchmark, share):
    """Yardstick of the run-ups on bearings: two turning bodies in space, each on two springs of Exudyn, no gears."""
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    inertia = exu.rigidBodyUtilities.RigidBodyInertia(mass=3.1, inertiaTensor=np.diag([5e-3, 5e-3, INERTIA]))
    spring = {"stiffness": [5e8, 5e8, 1e8], "damping": [1e3, 1e3, 200]}
    for x in (0.0, 0.15):
        motion = {"initialAngularVelocity": [0, 0, 1000 * rpm], "nodeType": exu.NodeType.RotationRxyz}
        body = mbs.CreateRigidBody(referencePosition=[x, 0, 0], inertia=inertia, **motion)
        for z in (-30 * mm, 30 * mm):
            ends = {"itemNumbers": [mbs.CreateGround(), body], "localPosition0": [x, 0, z], "localPosition1": [0, 0, z]}
            mbs.CreateCartesianSpringDamper(**ends, **spring)
    mbs.Assemble()
    settings = fourth_order_settings(STEP, round(share * STEPS))
    assert benchmark.pedantic(mbs.SolveDynamic, (settings,), rounds=3, warmup_rounds=1)


def bearings() -> dict:
    return {0.0: exugear.Bearing(5e8, 1e8, damping_time=2e-6), 60 * mm: exugear.Bearing(5e8, damping_time=2e-6)}


@pytest.mark.parametrize("scene", ["spin", "planar", "space"])
def test_run_up(benchmark, scene):
    """As many steps of the pair; error of the rms of the DTE against a quarter of the step, the largest of windows."""
    box = smooth_box() if scene == "spin" else smooth_box(parts=bearings())
    plan = exugear.plan(box).with_bodies() if scene == "space" else exugear.plan(box)
    conditions = {"speed": (1000 * rpm, 1200 * rpm), "duration": STEP * STEPS, "load": 150.0, "progress": False}

    def windows(step: float) -> np.ndarray:
        run = exugear.run_up(exugear.build(box, plan=plan), step=step, **conditions)
        benchmark.extra_info.setdefault("iterations a step", run.data.attrs["newton_iterations"])
        return np.array([part.std() for part in np.array_split(run.data["dte"].values[0], 10)])

    rough = benchmark.pedantic(windows, (STEP,), rounds=3, warmup_rounds=1)
    error = np.abs(rough / windows(STEP / 4) - 1).max()
    benchmark.extra_info["error of the rms"] = error
    assert error < 1e-3


@pytest.mark.parametrize("processes", [1, 2])
@pytest.mark.parametrize("scene", ["spin", "planar"])
def test_run_up_in_parts(benchmark, scene, processes, share):
    """70 s on one and on two processes; on two, the largest difference of the states at the seams."""
    model = exugear.build(smooth_box() if scene == "spin" else smooth_box(parts=bearings()))
    options = {"speed": (0, 3500 * rpm), "duration": 70.0 * share, "load": 150.0, "progress": False}
    with ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as pool:
        options |= {"executor": pool} if processes > 1 else {}
        run = benchmark.pedantic(exugear.run_up, (model,), options, rounds=1, warmup_rounds=1)
    if processes > 1:
        benchmark.extra_info["seam error"] = error = float(run.data["seam_error"].max())
        assert error < 1e-6
    assert np.isfinite(run.data["dte"]).all()
