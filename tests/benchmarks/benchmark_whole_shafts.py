"""Runs with elastic shafts at the plan's choice beside all coordinates of their finite elements, and beside rigid ones.

    python tests/benchmarks/benchmark_whole_shafts.py 8

The reference shares with the run only the beam's matrices and the pure contact: no reduction, no mass scaling, no
Exudyn. All free-free modes of the finite elements, with the damping of the shaft, are integrated exactly for forces
that are linear over a step of 2 us; bearings and contact are forces at the nodes, solved for within each step. Between
the lowest 24 shapes of each plane gyroscopic moments act. Two pairs: 120 x 50 mm and 300 x 40 mm.

By how much twice the step and half the elements move the reference is told beside, in all windows and in each where the
plan's choice is beyond 1 % (DTE) or 2 % (bearing forces). On 300 x 40 mm these are the window with the jump of a
nonlinear resonance at 3281 rpm, where teeth begin to part, and those from 3400 rpm on: there a sum combination
resonance of the mesh and a mode of 333 Hz grows exponentially, and with it any difference. Both converge to the
reference with shorter steps and more modes. In windows of 0.25 s, of which the last ends at 3415 rpm, the growth has
hardly begun; pass 0.1 as second argument to see it.
"""

import sys
import time
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
import scipy

sys.path.insert(0, str(Path(__file__).parents[1] / "cases"))

from elastic_boxes import elastic_box

import exugear
import exugear.gearbox.shaft
from exugear.contact.contact import contact_in_space
from fem.support.numba_cache import compiled
from fem.units import mm, rpm

BOXES = {"120 x 50": {}, "300 x 40": {"gears": (130 * mm,), "length": 300 * mm, "d": 40 * mm}}
SPEED, LOAD, STEP, WINDOW, SETTLED = (100 * rpm, 3500 * rpm), 150.0, 2e-6, 0.25, 0.3
#: Errors beyond which a window is told [%]: of the DTE, of bearing forces.
TOLD = 1.0, 2.0
#: Rounding of times [s].
ROUNDING = 1e-9
#: Shapes of a plane between which gyroscopic moments act.
GYROSCOPIC = 24
#: Time in which the load of the reference rises [s].
RAMP = 0.02


class Whole(NamedTuple):
    """A shaft by its modes (n,): x bending, y bending, tension, torsion; mass 1.

    omega, damping   of the modes: angular frequency [rad/s], 2 zeta omega
    ports            (m, n) motion of the ports by the modes: x, y, z, tilts, spin of the gear, then 3 of each bearing
    springs, dampers (m,) of the ports, 0 of the gear
    polar            (k, k) of the lowest shapes of a plane
    planes           (2, k) numbers of these shapes
    imposed          (n,) acceleration of the modes per angular acceleration of an imposed end; 0 where it is free
    torque           (n,) of the modes per torque on the end
    """

    omega: np.ndarray
    damping: np.ndarray
    ports: np.ndarray
    springs: np.ndarray
    dampers: np.ndarray
    polar: np.ndarray
    planes: np.ndarray
    imposed: np.ndarray
    torque: np.ndarray


def whole(shaft: exugear.Shaft, *, held: bool) -> Whole:
    """All coordinates of a shaft; held: the angle of its end is imposed, torsion then counts from that angle."""
    beam, (station,) = shaft.beam, shaft.stations
    bending, shapes = scipy.linalg.eigh(beam.bending_stiffness, beam.bending_mass)
    tension, stretched = scipy.linalg.eigh(beam.tension_stiffness, beam.tension_mass)
    nodes, end = np.arange(beam.axial.size), beam.node(shaft.end_position)
    free = np.delete(nodes, end) if held else nodes
    part = np.ix_(free, free)
    torsion, turned = scipy.linalg.eigh(beam.torsion_stiffness[part], beam.torsion_mass[part])
    twisted = np.zeros((nodes.size, torsion.size))
    twisted[free] = turned
    sizes = [bending.size, bending.size, tension.size, torsion.size]
    starts = np.cumsum([0, *sizes])
    squares = np.concatenate([bending, bending, tension, torsion])
    squares[np.abs(squares) < 1e-6 * squares.max() * 1e-3] = 0.0
    omega = np.sqrt(np.maximum(squares, 0.0))
    motions = np.zeros((nodes.size, 6, squares.size))
    for i, (moved, tilted, tilt_sign) in enumerate(((0, 4, 1.0), (1, 3, -1.0))):
        part_of_plane = slice(starts[i], starts[i + 1])
        motions[:, moved, part_of_plane] = shapes[0::2]
        motions[:, tilted, part_of_plane] = tilt_sign * shapes[1::2]
    motions[:, 2, starts[2] : starts[3]] = stretched
    motions[:, 5, starts[3] :] = twisted
    bearings = [(beam.node(axial), bearing) for axial, bearing in shaft.bearings.items()]
    ports = np.vstack([motions[beam.node(station)], *(motions[node][:3] for node, _ in bearings)])
    springs = np.concatenate([np.zeros(6), *(np.diag(bearing.stiffness)[:3] for _, bearing in bearings)])
    times = np.concatenate([np.zeros(6), *([bearing.damping_time] * 3 for _, bearing in bearings)])
    low = shapes[:, :GYROSCOPIC]
    imposed, torque = np.zeros(squares.size), np.zeros(squares.size)
    if held:
        imposed[starts[3] :] = -twisted.T @ beam.torsion_mass.sum(axis=1)
    else:
        torque[starts[3] :] = twisted[end]
    planes = starts[:2, None] + np.arange(low.shape[1])
    damping = 2 * shaft.damping_ratio * omega
    return Whole(omega, damping, ports, springs, times * springs, low.T @ beam.polar @ low, planes, imposed, torque)


def recursion(shaft: Whole, h: float) -> np.ndarray:
    """(8, n) of q' = a q + b v + c f + d f', v' = e q + g v + i f + j f' over a step [s] with a linear force."""
    rows = np.zeros((8, shaft.omega.size))
    for k, (omega, damping) in enumerate(zip(shaft.omega, shaft.damping, strict=True)):
        matrix = np.zeros((4, 4))
        matrix[0, 1], matrix[1], matrix[2, 3] = 1.0, [-(omega**2), -damping, 1.0, 0.0], 1.0
        to = scipy.linalg.expm(matrix * h)
        rows[:, k] = [
            *to[0, :2],
            to[0, 2] - to[0, 3] / h,
            to[0, 3] / h,
            *to[1, :2],
            to[1, 2] - to[1, 3] / h,
            to[1, 3] / h,
        ]
    return rows


@compiled
def gyroscopic(f, v, polar, planes, speed):
    """Add gyroscopic moments to the modal forces."""
    k = polar.shape[0]
    for i in range(k):
        on_x, on_y = 0.0, 0.0
        for j in range(k):
            on_x -= polar[i, j] * v[planes[1, j]]
            on_y += polar[i, j] * v[planes[0, j]]
        f[planes[0, i]] += speed * on_x
        f[planes[1, i]] += speed * on_y


@compiled
def advanced(q, v, f, to, ports, at, rate):
    """Modes (n,) at the end of a step without the forces at its end, and motion of the ports (m,)."""
    at[:], rate[:] = 0.0, 0.0
    for k in range(q.size):
        x = to[0, k] * q[k] + to[1, k] * v[k] + to[2, k] * f[k]
        y = to[4, k] * q[k] + to[5, k] * v[k] + to[6, k] * f[k]
        q[k], v[k] = x, y
        for m in range(at.size):
            at[m] += ports[m, k] * x
            rate[m] += ports[m, k] * y


@compiled
def body_motion(at, lever, spin):
    """Coordinates (6) of a rigid body whose centre of mass lies at a distance from the gear (6)."""
    return at[0] + lever * at[4], at[1] - lever * at[3], at[2], at[3], at[4], at[5] + spin


@compiled
def integrated(law, frame, fast, slow, to, inverse, levers, drive, load, number, every, h, samples):
    """Integrate; samples (n, 1 + 3 n_bearing of both shafts): deflection, bearing forces.

    inverse   (2, 2, m, m): motion and rates of the ports at the end of a step by forces on them then
    """
    shafts = (fast, slow)
    m = fast.ports.shape[0]
    q = (np.zeros(fast.omega.size), np.zeros(slow.omega.size))
    v = (np.zeros(fast.omega.size), np.zeros(slow.omega.size))
    f = (np.zeros(fast.omega.size), np.zeros(slow.omega.size))
    at, rate = np.zeros((2, m)), np.zeros((2, m))
    free, free_rate, p, before = np.zeros((2, m)), np.zeros((2, m)), np.zeros((2, m)), np.zeros((2, m))
    old = np.zeros((2, m))
    for k in range(slow.omega.size):
        v[1][k] = drive[2] * slow.imposed[k]
    for step in range(number):
        t = (step + 1) * h
        spin, speed = drive[0] * t + 0.5 * drive[1] * t * t, drive[0] + drive[1] * t
        for s in range(2):
            advanced(q[s], v[s], f[s], to[s], shafts[s].ports, free[s], free_rate[s])
            f[s][:] = shafts[s].torque * (load * min(t / RAMP, 1.0))
        f[0][:] += fast.imposed * drive[1]
        gyroscopic(f[0], v[0], fast.polar, fast.planes, speed)
        gyroscopic(f[1], v[1], slow.polar, slow.planes, rate[1, 5])
        for s in range(2):
            for k in range(q[s].size):
                q[s][k] += to[s][3, k] * f[s][k]
                v[s][k] += to[s][7, k] * f[s][k]
                for i in range(m):
                    free[s, i] += shafts[s].ports[i, k] * to[s][3, k] * f[s][k]
                    free_rate[s, i] += shafts[s].ports[i, k] * to[s][7, k] * f[s][k]
        for s in range(2):
            for i in range(m):
                before[s, i] = p[s, i]
                p[s, i] = 2.0 * p[s, i] - old[s, i]
                old[s, i] = before[s, i]
        for _ in range(30):
            change = 0.0
            for s in range(2):
                # bearings: forces and motion at the end of the step together, the gear's forces as they are
                for i in range(m):
                    at[s, i], rate[s, i] = free[s, i], free_rate[s, i]
                    for j in range(6):
                        at[s, i] += inverse[s, 0, i, j] * p[s, j]
                        rate[s, i] += inverse[s, 1, i, j] * p[s, j]
                for i in range(6, m):
                    total = 0.0
                    for j in range(6, m):
                        total += inverse[s, 2, i, j] * (
                            shafts[s].springs[j] * at[s, j] + shafts[s].dampers[j] * rate[s, j]
                        )
                    p[s, i] = -total
                for i in range(m):
                    for j in range(6, m):
                        at[s, i] += inverse[s, 0, i, j] * p[s, j]
                        rate[s, i] += inverse[s, 1, i, j] * p[s, j]
            q_1, q_2 = body_motion(at[0], levers[0], spin), body_motion(at[1], levers[1], 0.0)
            v_1, v_2 = body_motion(rate[0], levers[0], speed), body_motion(rate[1], levers[1], 0.0)
            contact = contact_in_space(law, frame, q_1, q_2, v_1, v_2)
            for s in range(2):
                row = contact.pinion if s == 0 else contact.wheel
                wrench = (row[0], row[1], row[2], row[3] - levers[s] * row[1], row[4] + levers[s] * row[0], row[5])
                for i in range(6):
                    change = max(change, abs(wrench[i] - p[s, i]))
                    p[s, i] = wrench[i]
            if change < 1e-6:
                break
        for s in range(2):
            for k in range(q[s].size):
                pushed = 0.0
                for i in range(m):
                    pushed += shafts[s].ports[i, k] * p[s, i]
                q[s][k] += to[s][3, k] * pushed
                v[s][k] += to[s][7, k] * pushed
                f[s][k] += pushed
        if (step + 1) % every == 0:
            k = (step + 1) // every - 1
            samples[k, 0] = contact.motion.advance - contact.motion.opening
            for s in range(2):
                for i in range(m - 6):
                    samples[k, 1 + s * (m - 6) + i] = p[s, 6 + i]


def reference(model: exugear.Model, duration: float, sample: float, step: float = STEP) -> np.ndarray:
    """(n, 1 + n_bearing * 3) deflection and bearing forces by the whole shafts, samples from `sample` [s] on."""
    (mesh,), box = model.meshes, model.gearbox
    fast, slow = whole(box.driving, held=True), whole(box.driven, held=False)
    directions = box.directions
    start, end = (directions[box.driving.name] * speed for speed in SPEED)
    ratio = box.driving.gears[box.driving.stations[0]].z / box.driven.gears[box.driven.stations[0]].z
    of_slow = directions[box.driven.name] * SPEED[0] * ratio
    node = np.abs(slow.omega) == 0.0
    turning = np.where(node, slow.ports[5], 0.0)
    slow = slow._replace(imposed=turning / (turning @ slow.ports[5]))
    to = tuple(recursion(x, step) for x in (fast, slow))
    m = fast.ports.shape[0]
    inverse = np.zeros((2, 3, m, m))
    for s, x in enumerate((fast, slow)):
        inverse[s, 0], inverse[s, 1] = ((x.ports * to[s][row]) @ x.ports.T for row in (3, 7))
        part = slice(6, m)
        matrix = np.eye(m - 6) + x.springs[part, None] * inverse[s, 0, part, part]
        matrix += x.dampers[part, None] * inverse[s, 1, part, part]
        inverse[s, 2, part, part] = np.linalg.inv(matrix)
    levers = np.array([x.centre - x.stations[0] for x in (box.driving, box.driven)])
    number, every = round(duration / step), round(sample / step)
    samples = np.zeros((number // every, 1 + 2 * (m - 6)))
    drive = np.array([start, (end - start) / duration, of_slow])
    load = -directions[box.driven.name] * LOAD
    table = mesh.law.table.head
    integrated(table, mesh.frame, fast, slow, to, inverse, levers, drive, load, number, every, step, samples)
    return samples


def levels(time: np.ndarray, dte: np.ndarray, forces: np.ndarray, window: float) -> np.ndarray:
    """(1 + n_bearing, n_window) standard deviations in windows of time (n,): DTE (n,), forces (n, n_bearing, 3)."""
    columns = np.column_stack([dte, forces.reshape(len(forces), -1)])
    bounds = np.searchsorted(time, np.arange(SETTLED, time[-1] + ROUNDING, window) - ROUNDING)
    variances = np.array([columns[first:last].var(axis=0) for first, last in pairwise(bounds)])
    of_bearings = variances[:, 1:].reshape(len(variances), -1, 3).sum(axis=2)
    return np.sqrt(np.column_stack([variances[:, 0], of_bearings])).T


def reference_levels(model: exugear.Model, duration: float, window: float, sample: float, step: float) -> np.ndarray:
    """`levels` by the whole shafts."""
    samples = reference(model, duration, sample, step)
    times = sample * (1 + np.arange(len(samples)))
    return levels(times, samples[:, 0], samples[:, 1:].reshape(len(samples), -1, 3), window)


def finer_box(name: str) -> exugear.Gearbox:
    """The box with elements of half the length, whose matrices its shafts keep."""
    longest = exugear.gearbox.shaft.ELEMENT
    exugear.gearbox.shaft.ELEMENT = longest / 2
    try:
        box = elastic_box(**BOXES[name])
        assert all(shaft.beam.axial.size for shaft in box.shafts)
        return box
    finally:
        exugear.gearbox.shaft.ELEMENT = longest


def differences(reached: np.ndarray, exact: np.ndarray) -> np.ndarray:
    """(2, n_window) differences of levels [%]: of the DTE, and the largest of bearing forces."""
    relative = 100 * np.abs(reached / exact - 1)
    return np.array([relative[0], relative[1:].max(axis=0)])


def in_words(reached: np.ndarray, exact: np.ndarray) -> str:
    """Median, 90 % and largest of the differences of levels."""
    relative = 100 * np.abs(reached / exact - 1)
    far = [np.percentile(x, [50, 90, 100]) for x in (relative[0], relative[1:])]
    kinds = zip(("DTE", "bearings"), far, strict=True)
    return ", ".join(f"{kind} {a:.2f} / {b:.2f} / {c:.2f} %" for kind, (a, b, c) in kinds)


def compared(name: str, duration: float, window: float) -> None:
    """Print errors of the plan's choice and of rigid shafts, those of the reference, and the times of runs."""
    box, sample = elastic_box(**BOXES[name]), 2e-5
    models = {"plan": exugear.build(box), "rigid": exugear.build(box, plan=exugear.plan(box).with_rigid_shafts())}
    of_reference = duration, window, sample
    exact = reference_levels(models["plan"], *of_reference, STEP)
    doubled = reference_levels(models["plan"], *of_reference, 2 * STEP)
    finer = reference_levels(exugear.build(finer_box(name)), *of_reference, 2 * STEP)
    print(name, "reference by twice the step: median / 90 % / all", in_words(doubled, exact), flush=True)
    print(name, "reference by half the elements:", in_words(finer, doubled), flush=True)
    for label, model in models.items():
        begin = time.process_time()
        run = exugear.run_up(model, speed=SPEED, load=LOAD, duration=duration, sample=sample, progress=False, checks=0)
        spent, data = time.process_time() - begin, run.data
        forces = data["bearing_force"].transpose("time", "bearing", "direction").values
        reached = levels(data["time"].values, data["dte"].isel(stage=0).values, forces, window)
        print(f"{name} {label}: median / 90 % / all", in_words(reached, exact), f"{spent:.1f} s", flush=True)
        if label == "plan":
            pairs = (reached, exact), (doubled, exact), (finer, doubled)
            _tell_windows(*(differences(*pair) for pair in pairs), duration, window)


def _tell_windows(errors: np.ndarray, by_step: np.ndarray, by_mesh: np.ndarray, duration: float, window: float) -> None:
    """Print the windows (2, n) beyond `TOLD`, with what moves the reference in them."""
    number = errors.shape[1]
    times = SETTLED + (np.arange(number) + 0.5) * window
    speeds = np.interp(times / duration, [0, 1], SPEED) / rpm
    for k in np.flatnonzero((errors.T > TOLD).any(axis=1)):
        kinds = zip(("DTE", "bearings"), errors[:, k], by_step[:, k], by_mesh[:, k], strict=True)
        words = (f"{kind} {a:.2f} %, reference by step {b:.2f}, by mesh {c:.2f} %" for kind, a, b, c in kinds)
        print(f"    about {speeds[k]:.0f} rpm:", "; ".join(words), flush=True)


if __name__ == "__main__":
    lasting, of_windows = (float(x) for x in (*sys.argv[1:], *("8.0", f"{WINDOW}")[len(sys.argv) - 1 :]))
    for case in BOXES:
        compared(case, lasting, of_windows)
