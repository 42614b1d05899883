"""Exudyn's threads, threads of Python that share a model, and contacts that never close."""

import warnings
from concurrent.futures import ThreadPoolExecutor

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np
import pytest
from paper_gears import paper_gear, paper_pair
from planetary_boxes import planetary_box
from scenes import INERTIA, linear_law, smooth_box

import exugear
from fem.units import mm, um

PAIR, BASE = paper_pair(), paper_pair().pinion.r_b
#: Exudyn's threads matter from 20 objects on.
BYSTANDERS = 30
RING = exugear.RingPair(paper_gear(), z=-120, a=-84 * mm)


def spinning_pair(mbs, pair=PAIR, bystanders: int = 0, torque: float = 0.0, **contact) -> list[int]:
    """Nodes of two gears on springs, in contact at 10 um, beside masses on springs, under a torque on the pinion."""
    ground = mbs.AddNode(eii.NodePointGround())
    nodes = [mbs.AddNode(eii.Node1D(referenceCoordinates=[0])) for _ in range(2 + bystanders)]
    bodies = [mbs.AddObject(eii.ObjectRotationalMass1D(inertia=INERTIA, nodeNumber=node)) for node in nodes]
    for node in nodes:
        markers = [mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=n, coordinate=0)) for n in (ground, node)]
        mbs.AddObject(eii.CoordinateSpringDamper(markerNumbers=markers, stiffness=1e4))
        if node == nodes[0]:
            mbs.AddLoad(eii.LoadCoordinate(markerNumber=markers[1], load=torque))
    mbs.CreateGearContact(itemNumbers=bodies[:2], pair=pair, force=linear_law(), **contact)
    mbs.Assemble()
    mbs.systemData.SetODE2Coordinates([10 * um / BASE] + [0.0] * (1 + bystanders), exu.ConfigurationType.Initial)
    return nodes


def settings_of(steps: int = 100) -> exu.SimulationSettings:
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    settings.timeIntegration.endTime, settings.timeIntegration.numberOfSteps = steps * 1e-5, steps
    return settings


SOLVES = {
    "implicit": lambda mbs, settings: mbs.SolveDynamic(settings),
    "explicit": lambda mbs, settings: mbs.SolveDynamic(settings, solverType=exu.DynamicSolverType.RK44),
    "static": lambda mbs, settings: mbs.SolveStatic(settings),
    "by hand": lambda mbs, settings: exu.MainSolverImplicitSecondOrder().InitializeSolver(mbs, settings),
}


@pytest.mark.usefixtures("way")
@pytest.mark.parametrize("solve", SOLVES.values(), ids=SOLVES)
def test_threads_that_double_forces_are_refused(mbs, solve):
    """In any kind of solve, and before Python's user functions can wait for each other."""
    spinning_pair(mbs, bystanders=BYSTANDERS, torque=20.0)
    settings = settings_of()
    settings.parallel.numberOfThreads = 2
    with pytest.raises(RuntimeError, match=r"twice with 2 threads.*multithreadedLowerLimitResiduals = 1000000000, or"):
        solve(mbs, settings)


@pytest.mark.usefixtures("way")
@pytest.mark.parametrize("name", ["implicit", "explicit", "static"])
def test_with_the_remedy_threads_do_not_matter(mbs, name):
    spinning_pair(mbs, bystanders=BYSTANDERS, torque=20.0)
    reached = []
    for threads in (1, 2):
        settings = settings_of()
        settings.parallel.numberOfThreads = threads
        settings.parallel.multithreadedLowerLimitResiduals = 10**9
        SOLVES[name](mbs, settings)
        reached.append(mbs.systemData.GetODE2Coordinates())
    assert np.abs(reached[0]).max() > 0
    assert np.array_equal(*reached)


def test_settings_of_the_integrator_carry_the_remedy(mbs):
    spinning_pair(mbs, bystanders=BYSTANDERS)
    reached = []
    for threads in (1, 2):
        settings = exugear.integrator(mbs, 1e-3, 1000.0)
        settings.parallel.numberOfThreads = threads
        mbs.SolveDynamic(settings)
        reached.append(mbs.systemData.GetODE2Coordinates())
    assert np.array_equal(*reached)


def test_threads_that_share_a_model_take_turns():
    model, printed = exugear.build(smooth_box()), exu.config.printToConsole
    options = {"duration": 0.01, "load": 150.0, "progress": False, "checks": 0}

    def verb(speed: float) -> np.ndarray:
        if speed < 105:
            return exugear.modes(model, load=speed)["frequency"].values
        return exugear.run_up(model, speed=speed, **options).data["dte"].values

    speeds = (100.0, 110.0, 120.0, 130.0)
    alone = [verb(speed) for speed in speeds]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(verb, speeds))
    assert all(map(np.array_equal, together, alone))
    assert exu.config.printToConsole == printed


@pytest.mark.parametrize("verb", ["run", "run_up", "modes", "campbell", "eigenfrequencies", "steady_states", "draw"])
def test_public_functions_of_a_model_wait_for_their_turn(monkeypatch, verb):
    """They take the turn of the system before anything else."""
    model, taken = exugear.build(smooth_box()), []

    class Turn:
        def __enter__(self):
            taken.append(verb)
            raise StopIteration

        def __exit__(self, *error):
            return None

    monkeypatch.setattr("exugear.multibody.turns.turn_with", lambda mbs: Turn() if mbs is model.mbs else None)
    given = {"load": 100.0, "speed": (50.0, 60.0), "duration": 0.01}
    needed = {"run": ["duration"], "run_up": ["load", "speed", "duration"], "campbell": ["load", "speed"]}
    needed |= {"steady_states": ["load", "speed"], "eigenfrequencies": ["load"]}
    with pytest.raises(StopIteration):
        getattr(exugear, verb)(model, **{name: given[name] for name in needed.get(verb, [])})
    assert taken == [verb]


def test_a_planet_that_carries_nothing_is_not_told_to_turn_its_direction():
    """The direction of a stage follows from the gearbox; its pin stands too far with the force."""
    model = exugear.build(planetary_box(pin_errors=[60 * um, 0.0, 0.0]))
    with pytest.warns(
        UserWarning, match="teeth of stage .* never touched, it carried no load: .* raise the load"
    ) as both:
        exugear.run_up(model, speed=10.0, load=100.0, duration=1e-4, progress=False, checks=0)
    assert len(both) == 2 and not any("direction" in str(each.message) for each in both)


def test_a_contact_that_never_closes_says_so_once(mbs):
    """In an internal gear with the default direction a pinion that pushes clockwise opens the teeth."""
    nodes = spinning_pair(mbs, RING, torque=-20.0, name="planet and ring")
    mbs.systemData.SetODE2Coordinates([-10 * um / BASE, 0.0], exu.ConfigurationType.Initial)
    remedy = "direction is [+]1, .* where the pinion pushes counter-clockwise; pass direction=-1"
    with pytest.warns(UserWarning, match=rf"gear contact \d+ \('planet and ring'\) never touched; its {remedy}"):
        mbs.SolveDynamic(settings_of())
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        mbs.SolveDynamic(settings_of())
    assert mbs.GetNodeOutput(nodes[1], exu.OutputVariableType.Coordinates) == 0


@pytest.mark.parametrize(("direction", "torque"), [(-1, -20.0), (1, 20.0)])
def test_contacts_that_close_say_nothing(mbs, direction, torque):
    nodes = spinning_pair(mbs, RING, torque=torque, direction=direction)
    mbs.systemData.SetODE2Coordinates([0.0, 0.0], exu.ConfigurationType.Initial)
    mbs.SolveDynamic(settings_of())
    assert mbs.GetNodeOutput(nodes[1], exu.OutputVariableType.Coordinates) * torque > 0
