"""The energy law of a rolling bearing, compiled: U of the displacement (x, y, z, a, b) of its shaft.

U is the sum over all elements of an energy of the two coordinates of their contacts (`exugear.rolling_bearings.rows`).
A ball stores 0.4 K d^2.5 at the approach d = hypot(r, a) - A, a lamina of a roller (9/19) K d^(19/9). The force on the
shaft is -dU/dq, the stiffness d2U/dq2; both are exact, and U is convex.

Where the cage rolls it turns by a share of the spin of the shaft, and U depends on that, too: the state is turned into
the cage's frame, the forces back, and -dU/dspin is a torque on the shaft, so that energy is conserved. Damping acts by
the rates of the shaft alone.
"""

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from exugear.mesh_force.kernel_records import (
    array_behind,
    behind,
    floats_behind,
    record_of,
    record_type,
    start_of_field,
)
from exugear.rolling_bearings.roller_table import roller_table
from exugear.rolling_bearings.rows import BallRow, RollerRow, Row
from fem.support.numba_cache import kept, unchecked

#: Head of the law of a bearing: axial distance from the centre of mass [m], damping over stiffness [s], stiffness of
#: ribs along the axis [N/m], number of rows; behind it lie the rows.
LAW = record_type(("lever", "f8"), ("damping", "f8"), ("guidance", "f8"), ("rows", "i8"))
#: A row: number of elements; position from the bearing's centre [m]; direction; turn of the cage per turn of the shaft,
#: 0 where it stands; contact origin [m, rad] and map of xi, z and tau; stiffness; A of balls [m]; number of laminae, 0
#: for balls; starts [bytes from the row] of the cosines and sines of the elements (2, number), of positions and twice
#: the drops of the laminae (2, laminae) [m], and of the table of rollers, 0 without; number of its columns; approaches
#: between which it holds [m]; approach of its first row [m], points per metre and per radian, largest tilt [rad]
#: (`exugear.rolling_bearings.roller_table`).
ROW = record_type(
    *(("number", "i8"), ("axial", "f8"), ("direction", "f8"), ("cage", "f8")),
    *(("origin", "f8", 2), ("map", "f8", (2, 3))),
    *(("stiffness", "f8"), ("A", "f8"), ("laminae", "i8"), ("elements", "i8"), ("slices", "i8")),
    *(("table", "i8"), ("columns", "i8")),
    *((name, "f8") for name in ("first", "last", "origin_of_table", "per_metre", "per_radian", "steep")),
)
#: Displacement beyond which an iteration has diverged [m].
FAR = 0.1
#: Sums over elements in any order, all in one function: 9 balls take 44 ns instead of 115, 14 rollers 375 ns.
inlined = partial(unchecked, forceinline=True, fastmath={"contract", "reassoc", "nsz"})
LAW_SIZE, ROW_SIZE = LAW.itemsize, ROW.itemsize
row_behind = behind(ROW)


class LawRecord(NamedTuple):
    """The law of a bearing for kernels: a record with its head, `LAW`, its rows and the arrays of these."""

    record: np.record


def law_record(
    rows: Sequence[Row], guidance: float, lever: float = 0.0, damping: float = 0.0, tables: bool = False
) -> LawRecord:
    """The record of the rows of a bearing, a lever [m] above the centre of mass, with damping over stiffness [s].

    guidance   stiffness of ribs along the axis [N/m]
    tables     whether rollers have tables instead of laminae
    """
    entries, behind_rows = np.zeros(len(rows), ROW), []
    for i, (entry, row) in enumerate(zip(entries, rows, strict=True)):
        arrays = {"elements": np.array([np.cos(row.angles), np.sin(row.angles)])}
        entry["number"], entry["axial"], entry["direction"] = row.Z, row.axial, row.direction
        entry["origin"], entry["map"] = row.origin, row.map
        entry["stiffness"], entry["cage"] = row.stiffness, row.cage_ratio
        if isinstance(row, BallRow):
            entry["A"] = row.A
        elif isinstance(row, RollerRow):
            arrays["slices"] = np.array([row.slices, 2 * row.profile])
            entry["laminae"] = row.laminae
            if tables:
                table = roller_table(row)
                arrays["table"], entry["columns"] = table.coefficients, table.coefficients.shape[1]
                entry["first"], entry["last"], entry["steep"] = table.first, table.last, table.steep
                entry["origin_of_table"] = table.origin
                entry["per_metre"], entry["per_radian"] = 1 / table.approach_step, 1 / table.tilt_step
        behind_rows += [(i, name, array) for name, array in arrays.items()]
    fields = [(f"{name} {i}", "f8", array.shape) for i, name, array in behind_rows]
    kind = record_type(("head", LAW), ("rows", ROW, (len(entries),)), *fields)
    for i, name, _ in behind_rows:
        entries[name][i] = start_of_field(kind, f"{name} {i}") - LAW_SIZE - ROW_SIZE * i
    head = record_of(LAW, lever=lever, damping=damping, guidance=guidance, rows=len(entries))
    values = {f"{name} {i}": array for i, name, array in behind_rows}
    return LawRecord(record_of(kind, head=head, rows=entries, **values))


@inlined
def ball_energy(row, r, a):
    """(energy [J], slopes by r and a [N], curvatures rr, ra, aa [N/m]) of a ball; zeros where it does not touch."""
    s = np.sqrt(r * r + a * a)
    d = s - row.A
    if d <= 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    root = np.sqrt(d)
    force, radial, axial = row.stiffness * d * root, r / s, a / s
    along, across = 1.5 * row.stiffness * root, force / s
    excess = along - across
    curvatures = across + excess * radial * radial, excess * radial * axial, across + excess * axial * axial
    return 0.4 * d * force, force * radial, force * axial, curvatures[0], curvatures[1], curvatures[2]


@unchecked
def roller_energy(row, approach, tilt):
    """(energy [J], slopes by approach and tilt [N, N m], curvatures) of a roller; zeros where it does not touch."""
    u = slope = moment = dd = dt = tt = 0.0
    slices = array_behind(row, row.slices, (2, row.laminae))
    for k in range(row.laminae):
        x = slices[0, k]
        d = approach - tilt * x - slices[1, k]
        if d > 0.0:
            stiffness = d ** (1.0 / 9.0)
            force = d * stiffness
            u, slope, moment = u + d * force, slope + force, moment - x * force
            dd, dt, tt = dd + stiffness, dt - x * stiffness, tt + x * x * stiffness
    k, t = row.stiffness, row.stiffness * (10.0 / 9.0)
    return 9.0 / 19.0 * k * u, k * slope, k * moment, t * dd, t * dt, t * tt


@inlined
def cubic(x):
    """Weights of four coefficients of a uniform cubic spline at a share x of an interval, with two derivatives."""
    y = 1.0 - x
    from_x, from_y = (4.0 + x * x * (3.0 * x - 6.0)) / 6.0, (4.0 + y * y * (3.0 * y - 6.0)) / 6.0
    values = y * y * y / 6.0, from_x, from_y, x * x * x / 6.0
    slopes = -0.5 * y * y, x * (1.5 * x - 2.0), y * (2.0 - 1.5 * y), 0.5 * x * x
    return values, slopes, (y, 3.0 * x - 2.0, 3.0 * y - 2.0, x)


@inlined
def dot(weights, x):
    """Sum of four values by their weights."""
    return weights[0] * x[0] + weights[1] * x[1] + weights[2] * x[2] + weights[3] * x[3]


@inlined
def weighted_rows(table, k, n, weights):
    """Sums of four coefficients by their weights in four rows of a table of n columns, from its number k on."""
    return (
        dot(weights, (table[k], table[k + 1], table[k + 2], table[k + 3])),
        dot(weights, (table[k + n], table[k + n + 1], table[k + n + 2], table[k + n + 3])),
        dot(weights, (table[k + 2 * n], table[k + 2 * n + 1], table[k + 2 * n + 2], table[k + 2 * n + 3])),
        dot(weights, (table[k + 3 * n], table[k + 3 * n + 1], table[k + 3 * n + 2], table[k + 3 * n + 3])),
    )


@inlined
def tabulated_energy(row, approach, tilt):
    """`roller_energy` by the table of the row."""
    side = 1.0 if tilt >= 0.0 else -1.0
    at, along, n = (approach - row.origin_of_table) * row.per_metre, side * tilt * row.per_radian, row.columns
    i, j = int(at), int(along)
    values, slopes, curvatures = cubic(at - i)
    v, s, c = cubic(along - j)
    table, k = floats_behind(row, row.table), (i - 1) * n + j
    of_v, of_s, of_c = weighted_rows(table, k, n, v), weighted_rows(table, k, n, s), weighted_rows(table, k, n, c)
    u, d, dd = dot(values, of_v), dot(slopes, of_v), dot(curvatures, of_v)
    t, dt, tt = dot(values, of_s), dot(slopes, of_s), dot(values, of_c)
    a, b = row.per_metre, side * row.per_radian
    return u, d * a, t * b, dd * a * a, dt * a * b, tt * b * b


@inlined
def element_energy(row, p, q):
    """Energy, slopes and curvatures of an element by the two coordinates of its contact."""
    if row.laminae == 0:
        return ball_energy(row, p, q)
    if row.table != 0 and abs(q) < row.steep:
        if p < row.first:
            return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        if p < row.last:
            return tabulated_energy(row, p, q)
    return roller_energy(row, p, q)


@inlined
def row_motion(row, lever, turn, x, y, z, a, b):
    """Motion at a row by that of the centre of mass, or the same of rates; mirrored where the direction is -1.

    turn   cosine and sine of the angle of the cage, in whose frame the motion is given
    """
    lever, side, (c, s) = lever + row.axial, row.direction, turn
    x, y = x + lever * b, y - lever * a
    return c * x + s * y, c * y - s * x, side * z, side * (c * a + s * b), side * (c * b - s * a)


@inlined
def cage_turn(row, spin):
    """Cosine and sine of the angle of the cage of a row at a spin of the shaft."""
    if row.cage == 0.0:
        return 1.0, 0.0
    angle = row.cage * spin
    return np.cos(angle), np.sin(angle)


@inlined
def reaction(law, q, q_t, spin):
    """Forces and moments (5) [N, N m] on the shaft at displacements q and rates q_t (5) of its centre of mass.

    Behind them the torque on the spin [N m] that turns rolling elements through the loaded zone: 0 where cages stand.
    """
    fx, fy, fa, fb, torque = 0.0, 0.0, 0.0, 0.0, 0.0
    fz = -law.guidance * (q[2] + law.damping * q_t[2])
    for i in range(law.rows):
        row = row_behind(law, LAW_SIZE + ROW_SIZE * i)
        m, elements, turn = row.map, array_behind(row, row.elements, (2, row.number)), cage_turn(row, spin)
        x, y, z, a, b = row_motion(row, law.lever, turn, q[0], q[1], q[2], q[3], q[4])
        u, v, w, a_t, b_t = row_motion(row, law.lever, turn, q_t[0], q_t[1], q_t[2], q_t[3], q_t[4])
        p_0, p_c, p_s = row.origin[0] + m[0, 1] * z, m[0, 0] * x - m[0, 2] * b, m[0, 0] * y + m[0, 2] * a
        q_0, q_c, q_s = row.origin[1] + m[1, 1] * z, -m[1, 2] * b, m[1, 2] * a
        v_0, v_c, v_s = m[0, 1] * w, m[0, 0] * u - m[0, 2] * b_t, m[0, 0] * v + m[0, 2] * a_t
        w_0, w_c, w_s = m[1, 1] * w, -m[1, 2] * b_t, m[1, 2] * a_t
        sum_p = sum_pc = sum_ps = sum_q = sum_qc = sum_qs = by_turn = 0.0
        for j in range(row.number):
            c, s = elements[0, j], elements[1, j]
            _, g, h, pp, pq, qq = element_energy(row, p_0 + p_c * c + p_s * s, q_0 + q_c * c + q_s * s)
            by_turn += g * (p_s * c - p_c * s) + h * (q_s * c - q_c * s)
            p_t, q_t_j = v_0 + v_c * c + v_s * s, w_0 + w_c * c + w_s * s
            g += law.damping * (pp * p_t + pq * q_t_j)
            h += law.damping * (pq * p_t + qq * q_t_j)
            sum_p, sum_pc, sum_ps = sum_p + g, sum_pc + g * c, sum_ps + g * s
            sum_q, sum_qc, sum_qs = sum_q + h, sum_qc + h * c, sum_qs + h * s
        side, lever, (c, s) = row.direction, law.lever + row.axial, turn
        px, py = m[0, 0] * (c * sum_pc - s * sum_ps), m[0, 0] * (s * sum_pc + c * sum_ps)
        along_b, along_a = m[0, 2] * sum_pc + m[1, 2] * sum_qc, m[0, 2] * sum_ps + m[1, 2] * sum_qs
        fx, fy, fz = fx - px, fy - py, fz - side * (m[0, 1] * sum_p + m[1, 1] * sum_q)
        fa = fa - side * (c * along_a + s * along_b) + lever * py
        fb = fb + side * (c * along_b - s * along_a) - lever * px
        torque -= row.cage * by_turn
    return fx, fy, fz, fa, fb, torque


@inlined
def add_row(row, lever, q, gradient, hessian):
    """Add slopes (5) and curvatures (5, 5) of a row's energy at a displacement and spin q (6); returns the energy."""
    m, elements, energy = row.map, array_behind(row, row.elements, (2, row.number)), 0.0
    (cosine, sine), lever, side = cage_turn(row, q[5]), lever + row.axial, row.direction
    motion, slopes = np.zeros((3, 5)), np.zeros((2, 5))
    motion[1, 2] = side
    x, y, z, a, b = q[0] + lever * q[4], q[1] - lever * q[3], side * q[2], side * q[3], side * q[4]
    for j in range(row.number):
        c = cosine * elements[0, j] - sine * elements[1, j]
        s = sine * elements[0, j] + cosine * elements[1, j]
        xi, tau = x * c + y * s, a * s - b * c
        p = row.origin[0] + m[0, 0] * xi + m[0, 1] * z + m[0, 2] * tau
        r = row.origin[1] + m[1, 0] * xi + m[1, 1] * z + m[1, 2] * tau
        u, g, h, pp, pq, qq = element_energy(row, p, r)
        if u != 0.0:
            energy += u
            motion[0, 0], motion[0, 1], motion[0, 3], motion[0, 4] = c, s, -lever * s, lever * c
            motion[2, 3], motion[2, 4] = side * s, -side * c
            for k in range(5):
                for i in range(2):
                    slopes[i, k] = m[i, 0] * motion[0, k] + m[i, 1] * motion[1, k] + m[i, 2] * motion[2, k]
            for k in range(5):
                gradient[k] += g * slopes[0, k] + h * slopes[1, k]
                by_p, by_q = pp * slopes[0, k] + pq * slopes[1, k], pq * slopes[0, k] + qq * slopes[1, k]
                for n in range(5):
                    hessian[k, n] += by_p * slopes[0, n] + by_q * slopes[1, n]
    return energy


@kept
def add_law(law, lever, q, energy, gradient, hessian):
    """Add energies (n,), slopes (n, 5) and curvatures (n, 5, 5) of a law at displacements and spins q (n, 6).

    law     `LAW`
    lever   distance of the bearing above the pole [m], instead of that in the law
    """
    for i in range(len(q)):
        energy[i] += 0.5 * law.guidance * q[i, 2] ** 2
        gradient[i, 2] += law.guidance * q[i, 2]
        hessian[i, 2, 2] += law.guidance
        for k in range(law.rows):
            row = row_behind(law, LAW_SIZE + ROW_SIZE * k)
            energy[i] += add_row(row, lever, q[i], gradient[i], hessian[i])


class Response(NamedTuple):
    """Energy (n,) [J], its gradient (n, 5) [N, N m] and Hessian (n, 5, 5) of a bearing."""

    energy: np.ndarray
    gradient: np.ndarray
    hessian: np.ndarray


def response(law: LawRecord, lever: float, q: np.ndarray) -> Response:
    """The response of a law at displacements q (n, 5) [m, rad] of a pole a lever [m] below the bearing.

    q may be (n, 6) with the spin of the shaft [rad] as last column, with which rolling cages turn; else it is 0.
    """
    q = np.asarray(q, float)
    q = np.ascontiguousarray(q if q.shape[1] == 6 else np.column_stack([q, np.zeros(len(q))]))
    values = Response(np.zeros(len(q)), np.zeros((len(q), 5)), np.zeros((len(q), 5, 5)))
    add_law(law.record.head, lever, q, *values)
    return values
