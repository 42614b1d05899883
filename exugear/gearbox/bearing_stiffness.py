"""Stiffness matrices of bearings about a pole, and the radial table of nonlinear ones."""

import numpy as np

from exugear.gearbox.bearing import Bearing, about_pole

#: Displacement beyond the clearance at which the table ends [m].
REACH = 1.0


def radial_table(bearing: Bearing) -> tuple[np.ndarray, np.ndarray]:
    """Radial displacements (n,) [m] and forces (n,) [N] of a nonlinear bearing, linear in between."""
    if bearing.table is not None:
        return np.array(bearing.table[0]), np.array(bearing.table[1])
    return np.array([0.0, bearing.clearance, bearing.clearance + REACH]), np.array([0.0, 0.0, bearing.radial * REACH])


def radial_stiffness(bearing: Bearing, r: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Slope and secant [N/m] of a nonlinear bearing at radial displacements (n,) [m]: its stiffness along, across."""
    radii, forces = radial_table(bearing)
    slopes = np.diff(forces) / np.diff(radii)
    slope = slopes[np.clip(np.searchsorted(radii, r) - 1, 0, slopes.size - 1)]
    return slope, np.where(r > 0, np.interp(r, radii, forces) / np.maximum(r, np.finfo(float).tiny), slope)


def radial_secant(bearing: Bearing, force: float) -> float:
    """Secant stiffness [N/m] of a nonlinear bearing under a radial force > 0 [N] that its table reaches."""
    displacement, table = radial_table(bearing)
    contact = np.flatnonzero(table == 0)[-1]
    return force / float(np.interp(force, table[contact:], displacement[contact:]))


def linear_part(bearing: Bearing, lever: float) -> np.ndarray:
    """(6, 6) stiffness about a pole at a distance lever [m], without the radial part of a nonlinear bearing."""
    if bearing.linear:
        return bearing.at(lever)
    return about_pole(np.diag([0.0, 0.0, bearing.axial, bearing.tilt, bearing.tilt, 0.0]), lever)


def radial_part(k: float, lever: float) -> np.ndarray:
    """(6, 6) stiffness about a pole at a distance lever [m], of a radial spring k [N/m]."""
    return about_pole(np.diag([k, k, 0.0, 0.0, 0.0, 0.0]), lever)
