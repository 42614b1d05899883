"""Check of the direct call: a small system is solved by either call path, in a separate process that may crash.

It imports no more than it needs, because the user waits for it.
"""

import re

import exudyn as exu
import exudyn.itemInterface as eii
from numba import njit

from exugear.multibody.direct_call import native_user_function

STIFFNESS, LARGEST_TWIST = 100, 0.1


def spring(stiffness, law, record, t, q_1, q_2, v_1, v_2):
    """A kernel: torques of a stiffening spring that breaks; law and record stand for the addresses of a contact."""
    if not q_1 - q_2 < LARGEST_TWIST:
        raise ValueError(q_1 - q_2)
    torque = stiffness * (q_1 - q_2) * (1.0 + 9.0 * (q_1 - q_2)) + v_1 - v_2 - t
    return -torque, torque


def solved(function, speed: float) -> tuple[list[float], str]:
    """Coordinates of two spinning bodies after a dynamic and a static solve, and the message where a solve stops."""
    mbs = exu.SystemContainer().AddSystem()
    nodes = [mbs.AddNode(eii.Node1D(referenceCoordinates=[0])) for _ in range(2)]
    for node in nodes:
        mbs.AddObject(eii.ObjectRotationalMass1D(inertia=1e-3, nodeNumber=node))
    torques = mbs.AddObject(eii.ObjectGenericODE2(nodeNumbers=nodes, forceUserFunction=function))
    if mbs.GetObject(torques)["forceUserFunction"]["function"] is not function:
        raise SystemExit("Exudyn does not keep the function that it calls")
    ground = mbs.AddNode(eii.NodePointGround())
    markers = [mbs.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=node, coordinate=0)) for node in (ground, nodes[0])]
    mbs.AddObject(eii.CoordinateSpringDamper(markerNumbers=markers, stiffness=10.0))
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


def check() -> None:
    """End the process with a message where the results of the two call paths differ."""
    exu.config.printToConsole = False
    calls = []

    def portable(mbs, t, item, q, q_t):
        calls.append(t)
        try:
            return spring(STIFFNESS, 0, 0, t, *q, *q_t)
        except ValueError as error:
            raise RuntimeError(f"broken at {error.args[0]:.12g} rad") from None

    state = None, 0.0, 0, [0.02, 0.0], [0.0, 0.0]
    direct = native_user_function(portable, njit(spring), (STIFFNESS, 0, 0), 2)
    expected, broken, torques = solved(portable, 1.0), solved(portable, 20.0), portable(*state)
    calls.clear()
    for _ in range(3):
        require_equal(expected, solved(direct, 1.0))
    if calls or len(expected[0]) != 4:
        raise SystemExit("the kernel was called by way of Python, or the solve failed")
    require_equal(broken, solved(direct, 20.0))
    if not broken[1].startswith("broken at") or direct(*state) != torques:
        raise SystemExit("a spring that should break did not, or the call from Python gives other torques")


def require_equal(expected, actual) -> None:
    """SystemExit unless coordinates and messages are equal."""
    differences = [abs(x - y) for x, y in zip(expected[0], actual[0], strict=True)]
    if max(differences, default=0.0) > 1e-12 or expected[1] != actual[1]:
        raise SystemExit(f"by way of Python {expected}, directly {actual}")
