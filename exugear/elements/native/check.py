"""A throw-away system solved both ways: run in a process of its own before the compiled callback is used.

It imports as little as it can, because somebody waits for it.
"""

import re

import exudyn as exu
import exudyn.itemInterface as eii
from numba import njit

from exugear.elements.native.callback import forged

GAIN = 100


def spring(gain, two, three, t, q_1, q_2, v_1, v_2):
    """A kernel: torques of a stiffening spring that breaks."""
    if not q_1 - q_2 < 0.1:
        raise ValueError(q_1 - q_2)
    torque = gain * (q_1 - q_2) * (1.0 + 9.0 * (q_1 - q_2)) + v_1 - v_2 - t
    return -torque, torque


def solved(function, speed: float) -> tuple[list[float], str]:
    """Coordinates that two spinning bodies reach in a dynamic and in a static solve, and what stopped them."""
    mbs = exu.SystemContainer().AddSystem()
    nodes = [mbs.AddNode(eii.Node1D(referenceCoordinates=[0])) for _ in range(2)]
    for node in nodes:
        mbs.AddObject(eii.ObjectRotationalMass1D(inertia=1e-3, nodeNumber=node))
    torques = mbs.AddObject(eii.ObjectGenericODE2(nodeNumbers=nodes, forceUserFunction=function))
    if mbs.GetObject(torques)["forceUserFunction"]["function"] is not function:
        raise SystemExit("Exudyn does not keep the function that it calls")
    ground = mbs.AddNode(eii.NodePointGround())
    places = [mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=node, coordinate=0)) for node in (ground, nodes[0])]
    mbs.AddObject(eii.CoordinateSpringDamper(markerNumbers=places, stiffness=10.0))
    mbs.Assemble()
    mbs.systemData.SetODE2Coordinates_t([speed, 0.0], exu.ConfigurationType.Initial)
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    settings.timeIntegration.endTime, settings.timeIntegration.numberOfSteps = 0.1, 100
    reached: list[float] = []
    try:
        for solve in (mbs.SolveDynamic, mbs.SolveStatic):
            solve(settings)
            reached += list(mbs.systemData.GetODE2Coordinates())
    except Exception as error:
        return reached, "".join(re.findall(r"broken at \S+ rad", str(error))) or str(error)
    return reached, ""


def trial() -> None:
    """End the process with a message where the two ways differ."""
    exu.config.printToConsole = False
    calls = []

    def portable(mbs, t, item, q, q_t):
        calls.append(t)
        try:
            return spring(GAIN, 0, 0, t, *q, *q_t)
        except ValueError as error:
            raise RuntimeError(f"broken at {error.args[0]:.12g} rad") from None

    state = None, 0.0, 0, [0.02, 0.0], [0.0, 0.0]
    function = forged(portable, njit(spring), (GAIN, 0, 0), 2)
    slow, broken, direct = solved(portable, 1.0), solved(portable, 20.0), portable(*state)
    calls.clear()
    for _ in range(3):
        agree(slow, solved(function, 1.0))
    if calls or len(slow[0]) != 4:
        raise SystemExit("the kernel was called by way of Python, or the solve failed")
    agree(broken, solved(function, 20.0))
    if not broken[1].startswith("broken at") or function(*state) != direct:
        raise SystemExit("a spring that should break did not, or Python's own call differs")


def agree(one, other) -> None:
    """The same coordinates and the same reason for a stop."""
    differences = [abs(x - y) for x, y in zip(one[0], other[0], strict=True)]
    if max(differences, default=0.0) > 1e-12 or one[1] != other[1]:
        raise SystemExit(f"{one} became {other}")
