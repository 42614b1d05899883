"""The gear contact in Exudyn: one ObjectGenericODE2 on the nodes of both gears, one user function, one kernel call."""

from dataclasses import dataclass, field
from math import hypot
from pathlib import Path
from typing import Any
from zlib import crc32

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np
from exudyn.misc.extensionRegistry import extends, install
from numba import carray, types
from numba.extending import intrinsic

import exugear.force
import exugear.kinematics
from exugear.force import HEADER, SIZE, MeshForce, beyond_map, compiled, kept
from exugear.kinematics import FRAME, reference_line, rotational_frame, rotational_mesh, spatial_frame, spatial_mesh
from fem.gear import GearPair, require
from fem.units import mm

INTERVAL, SAMPLES, ADDRESS = range(3)
#: For derivatives by coordinates [m, rad] and velocities [m/s, rad/s]. Exudyn's own differences move an angle by 1e-7
#: of itself, which after a thousand revolutions is more than any mesh deflects.
NUDGE, NUDGE_T = 1e-9, 1e-3


def _at(typingctx, address):
    """The doubles at an address: an int argument costs Python a tenth of an array argument."""
    pointer = types.CPointer(types.float64)

    def codegen(context, builder, signature, arguments):
        return builder.inttoptr(arguments[0], context.get_value_type(pointer))

    return pointer(address), codegen


at: Any = intrinsic(_at)


@compiled
def table(law):
    """The law's array, whose size stands in its header."""
    return carray(at(law), int(carray(at(law), HEADER)[SIZE]))


@compiled
def write(record, t, deflection, force):
    """Store the sample where t is one; Newton's last call of a step, the converged one, stays."""
    r = carray(at(record), 3)
    if r[SAMPLES] == 0.0 or t < 0.0:
        return
    x = t / r[INTERVAL] + 1e-3
    k = int(x)
    if x - k < 2e-3 and k < r[SAMPLES]:
        samples = carray(at(np.int64(r[ADDRESS])), (int(r[SAMPLES]), 2))
        samples[k, 0], samples[k, 1] = deflection, force


def entry_points(stamp: int):
    """Kernels that Exudyn's user function calls; those kept on disk for another stamp are compiled anew."""

    @kept
    def rotational(law, frame, record, t, q_1, q_2, v_1, v_2):
        _ = stamp
        deflection, force, forces = rotational_mesh(table(law), carray(at(frame), FRAME), q_1, q_2, v_1, v_2)
        write(record, t, deflection, force)
        return forces

    @kept
    def spatial(law, frame, record, t, x, y, z, a, b, c, X, Y, Z, A, B, C, u, v, w, d, e, f, U, V, W, D, E, F):
        _ = stamp
        q_1, q_2, v_1, v_2 = (x, y, z, a, b, c), (X, Y, Z, A, B, C), (u, v, w, d, e, f), (U, V, W, D, E, F)
        deflection, force, one, other = spatial_mesh(table(law), carray(at(frame), FRAME), q_1, q_2, v_1, v_2)
        write(record, t, deflection, force)
        return one + other

    return rotational, spatial


SOURCES = (Path(str(module.__file__)).read_bytes() for module in (exugear.force, exugear.kinematics))
rotational_forces, spatial_forces = entry_points(crc32(b"".join(SOURCES)))


@dataclass(frozen=True, eq=False)
class Recorder:
    """Deflection and force of one contact, written from inside the kernel at no cost.

    `start` it before a solve; then `deflection` [m] and `force` [N] hold the samples at t = 0, interval, ...
    """

    header: np.ndarray = field(default_factory=lambda: np.zeros(3), init=False, repr=False)
    samples: list[np.ndarray] = field(default_factory=list, init=False, repr=False)

    def start(self, interval: float, number: int) -> None:
        """Make room for number samples, NaN until written; interval [s] must be a whole multiple of the step."""
        require(interval > 0, f"interval must be > 0 s, got {interval}")
        require(number >= 1, f"number of samples must be at least 1, got {number}")
        self.samples[:] = [np.full((number, 2), np.nan)]
        self.header[:] = interval, number, self.samples[0].ctypes.data

    @property
    def deflection(self) -> np.ndarray:
        """(number,) dynamic transmission error [m]."""
        return self._column(0)

    @property
    def force(self) -> np.ndarray:
        """(number,) mesh force [N], < 0 on the other flank."""
        return self._column(1)

    def _column(self, i: int) -> np.ndarray:
        require(bool(self.samples), "the recorder holds nothing yet; start it before the solve")
        return self.samples[0][:, i]


def CreateGearContact(
    mbs,
    name: str = "",
    itemNumbers=(None, None),
    pair: GearPair = None,  # type: ignore[assignment]
    force: MeshForce = None,  # type: ignore[assignment]
    localPositions=((0, 0, 0), (0, 0, 0)),
    phase: float = 0.0,
    direction: int = 1,
    recorder: Recorder | None = None,
):
    """Contact of a gear pair between two bodies that turn about z; also mbs.CreateGearContact.

    itemNumbers      pinion and wheel: two rigid bodies on Rxyz nodes, or two ObjectRotationalMass1D (positive about +z)
    pair, force      `fem.GearPair` and `MeshForce`
    localPositions   gear centres on the bodies' z axes [m]
    phase            phase [1] in the reference configuration, where the driving flanks just touch (deflection 0)
    direction        +1: the pinion drives counter-clockwise (positive deflection); -1: clockwise
    recorder         `Recorder` of the deflection and the force

    Returns the number of the ObjectGenericODE2. Raises ValueError for bodies that cannot carry a gear, and a reference
    distance that is not the pair's. A solve that leaves the map's range stops and says so.
    """
    require(isinstance(pair, GearPair), f"pair must be a fem.GearPair, got {type(pair).__name__}")
    require(isinstance(force, MeshForce), f"force must be an exugear.MeshForce, got {type(force).__name__}")
    require(direction in (1, -1), f"direction must be +1 or -1, got {direction}")
    require(np.isfinite(phase), f"phase must be finite, a share of a pitch, got {phase}")
    require(len(itemNumbers) == 2, f"itemNumbers must be [pinion, wheel], got {itemNumbers}")
    nodes = [node_of(mbs, item) for item in itemNumbers]
    frame = frame_of(mbs, nodes, pair, localPositions, phase=phase, direction=direction)
    kernel = rotational_forces if str(mbs.GetNode(nodes[0])["nodeType"]) == "1D" else spatial_forces
    contact, jacobian = user_functions(kernel, force.law, frame, recorder or Recorder())
    item = eii.ObjectGenericODE2(name=name, nodeNumbers=nodes, forceUserFunction=contact, jacobianUserFunction=jacobian)
    item.visualization["show"] = False
    return mbs.AddObject(item)


def frame_of(mbs, nodes, pair: GearPair, positions, *, phase: float, direction: int) -> np.ndarray:
    """What the kernels know of the gears on two nodes; ValueError where the nodes and the pair do not fit."""
    kinds = [str(mbs.GetNode(node)["nodeType"]) for node in nodes]
    alike = f"itemNumbers need the same kind of node, got {kinds}; make both spatial or both rotational"
    require(kinds[0] == kinds[1], alike)
    if kinds[0] == "1D":
        return rotational_frame(pair, phase, direction)
    axial = [axial_of(position) for position in positions]
    reference = [list(mbs.GetNode(node)["referenceCoordinates"]) for node in nodes]
    check_distance(pair, reference_line(axial, reference))
    return spatial_frame(pair, phase, direction, axial, reference)


def node_of(mbs, item):
    """The node that carries the body's coordinates; ValueError where a gear cannot live on it."""
    require(item is not None, "itemNumbers must name two bodies, got None; pass [pinion, wheel]")
    body = mbs.GetObject(item)
    require("nodeNumber" in body, f"itemNumbers must be bodies with one node, got {body['objectType']}")
    kind = str(mbs.GetNode(body["nodeNumber"])["nodeType"])
    rotational = kind == "1D" and "Rotational" in str(body["objectType"])
    remedy = "use nodeType=exu.NodeType.RotationRxyz in CreateRigidBody, or ObjectRotationalMass1D on Node1D"
    require(rotational or "Rxyz" in kind, f"gears cannot live on a {kind} ({body['objectType']}); {remedy}")
    return body["nodeNumber"]


def axial_of(position) -> float:
    x, y, z = position
    require(x == 0 and y == 0, f"localPositions must lie on the body's z axis, got {position}; move the body instead")
    return float(z)


def check_distance(pair: GearPair, line: np.ndarray) -> None:
    distance, shift = hypot(line[0], line[1]), line[2]
    agree = abs(distance - pair.a) < 1e-6 * pair.a
    remedy = f"the pair's a = {pair.a / mm:.6g} mm; move the bodies or change a"
    require(agree, f"reference distance of the gear centres, {distance / mm:.6g} mm, must be {remedy}")
    apart = f"gear centres are {shift / mm:g} mm apart along z (face width {pair.b / mm:g} mm)"
    require(abs(shift) < pair.b, f"{apart}; move the bodies or localPositions")


def user_functions(kernel, law: np.ndarray, frame: np.ndarray, recorder: Recorder):
    """Force and Jacobian that Exudyn calls; the force owns the arrays whose addresses it hands over."""
    nobody = np.zeros_like(recorder.header)
    one, two, three, none = (x.ctypes.data for x in (law, frame, recorder.header, nobody))

    def gear_contact(mbs, t, item, q, q_t):
        try:
            return kernel(one, two, three, t, *q, *q_t)
        except ValueError as error:
            raise RuntimeError(beyond_map(*error.args)) from None

    def gear_jacobian(mbs, t, item, q, q_t, factor, factor_t):
        n, state = len(q), np.array([*q, *q_t])
        jacobian = np.zeros((n, n))
        for i in range(2 * n):
            nudge = np.zeros(2 * n)
            nudge[i] = NUDGE if i < n else NUDGE_T
            try:
                ahead, behind = (np.array(kernel(one, two, none, t, *x)) for x in (state + nudge, state - nudge))
            except ValueError as error:
                raise RuntimeError(beyond_map(*error.args)) from None
            jacobian[:, i % n] -= (factor if i < n else factor_t) * (ahead - behind) / (2 * nudge[i])
        return jacobian

    gear_contact.arrays = (law, frame, recorder, nobody)  # type: ignore[attr-defined]
    return gear_contact, gear_jacobian


extends(exu.MainSystem, "CreateGearContact")(CreateGearContact)
install()
