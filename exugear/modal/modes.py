"""Vibration modes under load: natural frequencies, damping, shapes, strain energy and excitation by the meshes."""

from collections.abc import Mapping
from math import pi
from typing import Any

import numpy as np
import xarray as xr

from exugear.gearbox.constant_loads import given_loads
from exugear.modal.linear_system import LinearSystem, linear_assembly, linear_gearbox
from exugear.modal.mode_shapes import (
    bending_lines,
    kinds_of_modes,
    parts_of_shafts,
    shapes_by_coordinate,
    shapes_by_shaft,
)
from exugear.modal.operating_point import in_loaded_equilibrium
from exugear.multibody.exudyn_objects import MainSystem
from exugear.multibody.model import Model, require_model
from exugear.multibody.turns import in_turn
from exugear.operation.train_motion import HIGHEST_SPEED
from exugear.planning.eigenmodes import Eigenmodes, eigenmodes
from fem.support.arguments import checked, keywords_after_first
from fem.support.user_warning import warn_user
from fem.support.validation import require

HELD, FREE = "held", "free"


@keywords_after_first()
@checked
@in_turn
def modes(
    model: Model | MainSystem,
    *,
    speed: float = 0.0,
    load: float | None = None,
    loads: Mapping[str, float] | None = None,
    phase: float | None = None,
    drive: str = HELD,
) -> xr.Dataset:
    """Vibration modes of a gearbox under a load, or of a hand-built system with gear contacts in its equilibrium.

    model   `exugear.Model`, or an assembled Exudyn system. The system must stand in equilibrium under its loads:
            mbs.SolveStatic(..., updateInitialValues=True). Its constraints, loads and initial velocities, by which
            bodies have gyroscopic terms, are the user's; do not pass speed, load, loads and drive with it
    speed   of the driving shaft [rad/s], for the gyroscopic terms of shafts on bearings
    load    torque on the driven shaft against its motion at positive speed [N m]
    loads   instead, of a gearbox with several outputs: name of a shaft -> torque against its motion [N m]; other shafts
            are free
    phase   share of a pitch by which every mesh is moved on from the phase in which it was built; None: the mean of the
            tangent stiffness over the mesh cycle, of a law over several pitches over these, at the mesh force of the
            equilibrium
    drive   "held": the driving shaft, or the rotor behind its coupling, is fixed, as a run prescribes its speed;
            "free": it may turn

    Meshes, bearings and springs have their tangent stiffness under the load. Returns a Dataset over `mode`:

    frequency       natural frequencies without damping [Hz], rising; 0 of a motion as a rigid body
    damping_ratio   share of the critical damping, to the first order, by the damping of meshes, bearings, couplings and
                    springs; at speed also by the drag of shafts; friction of teeth does not count
    shape           real part of the shapes, by shaft and coordinate (x, y, z, tilt_x, tilt_y, spin), rotors behind
                    couplings among the shafts (rotor_of names theirs); in a hand-built system by coordinate. Its modal
                    mass is 1 kg; the component with the most kinetic energy is real and > 0
    shape_imaginary imaginary part, of gyroscopic modes and of those of nearly equal frequencies that damping couples:
                    component = Re((shape + i shape_imaginary) exp(i omega t))
    energy_share    of the strain energy, in every mesh, bearing, coupling and spring; 0 for rigid-body motions. The
                    share of a mesh may be slightly negative, as its force destabilizes (geometric stiffness)
    participation   generalized excitation p of each mode by a unit transmission error of each mesh, k row . shape
                    [kg^0.5/s^2], with imaginary part. An error of amplitude e at the frequency of a mode gives it the
                    amplitude |p| e / (2 damping_ratio omega^2) times its shape
    kind            of a gearbox with planetary sets, by what moves beside the planets: "rotational" where sun, ring and
                    carrier turn or move along their axes, "translational" where they move in the plane or tilt,
                    "planet" where they stand, "ring" where the rim of an elastic ring moves most, else "mixed"
    line            of elastic shafts, displacement of their axes along x and y over `line_point`, whose shafts and
                    axial positions are line_shaft and line_axial; likewise line_imaginary
    mesh_stiffness  k, and mesh_force under the load, by stage: both are 0 where a mesh is idle, its teeth open. The
                    attribute idle_stages names such stages

    Planets on elastic pins are seen in the frame of their carrier, with its gyroscopic and centrifugal terms at speed.

    Sources: G. Genta, Dynamics of rotating systems (2005), for gyroscopic modes; A. Kahraman, Planetary gear train
    dynamics, J. Mech. Des. 116 (1994), for the error as a displacement in series with the mesh spring; J. Lin and R. G.
    Parker, J. Vib. Acoust. 121 (1999), for the kinds of modes of a set, T. Eritenel and R. G. Parker, J. Sound Vib. 325
    (2009), of one in space. The state of the system is restored afterwards.

    Raises ValueError without a load, where no mesh carries load, and for loads beyond the maps.
    """
    check_arguments(phase, drive)
    require(0 <= speed < HIGHEST_SPEED, f"speed must lie in [0, {HIGHEST_SPEED:g}) rad/s, got {speed:g}")
    if isinstance(model, Model):
        torques = given_loads(model.gearbox, load, loads)
        with in_loaded_equilibrium(model, torques, drive) as in_equilibrium:
            system = linear_gearbox(in_equilibrium, [speed], phase)
        solved = modes_of(system)
        shape, further = shapes_by_shaft(model, solved.shapes), parts_of_shafts(model) | kinds_of_modes(model, solved)
        further |= bending_lines(model, solved.shapes)
        attributes = load_attributes(load, torques) | {"speed": speed, "drive": drive}
    else:
        _check_hand_built(model, load, loads, speed, drive)
        system = linear_assembly(model, phase)
        solved = modes_of(system)
        shape, further, attributes = shapes_by_coordinate(model, solved.shapes), {}, {}
    data = _dataset(system, solved, shape).assign(further)
    return data.assign_attrs(attributes, phase="mean" if phase is None else phase, idle_stages=system.idle_stages)


def load_attributes(load: float | None, loads: Mapping[str, float]) -> dict[str, Any]:
    """Attributes of data under a load on the driven shaft, or under loads of shafts by their names."""
    return {"load": float(load)} if load is not None else {"loads": [*loads.values()], "loaded_shafts": [*loads]}


def check_arguments(phase: float | None, drive: str) -> None:
    """ValueError for a phase or a drive that makes no sense."""
    require(drive in (HELD, FREE), f'drive must be "held" or "free", got {drive!r}')
    require(abs(phase or 0.0) <= 1, f"phase must lie in [-1, 1], a share of a pitch, got {phase}")


def _check_hand_built(mbs, load: float | None, loads, speed: float, drive: str) -> None:
    for name, value in (("load", load), ("loads", loads)):
        require(value is None, f"{name} must be None for a hand-built system, got {value}; its own loads count")
    turning = "set the initial velocities of the system, which count"
    require(speed == 0, f"speed must be 0 for a hand-built system, got {speed:g}; {turning}")
    constraints = "its own constraints hold it; deactivate that of the drive"
    require(drive == HELD, f'drive must be "held" for a hand-built system, got {drive!r}; {constraints}')
    require(bool(mbs.systemIsConsistent), "model must be assembled; call mbs.Assemble()")


@keywords_after_first()
@checked
@in_turn
def eigenfrequencies(
    model: Model, *, load: float | None = None, loads: Mapping[str, float] | None = None
) -> np.ndarray:
    """Eigenfrequencies [Hz] (n,) of the undamped gearbox at rest under a load, rising.

    load    torque on the driven shaft against its motion at positive speed [N m]
    loads   instead, of a gearbox with several outputs: name of a shaft -> torque against its motion [N m]

    They are those of `modes` with its drive held, at the phases in which the gearbox was built (`modes` takes the mean
    stiffness over the mesh cycle unless it is given a phase). A warning names the stages whose meshes are idle: open
    teeth are no spring. The state of the system is restored afterwards.

    Exudyn's mbs.ComputeODE2Eigenvalues() linearizes about the present state of the system. Straight after `build` the
    teeth just touch: they are stiff in compression only, and its frequencies are far too low.

    Raises ValueError for a load of 0, under which the teeth just touch, and for loads beyond the maps.
    """
    require_model(model)
    with in_loaded_equilibrium(model, given_loads(model.gearbox, load, loads)) as in_equilibrium:
        system = linear_gearbox(in_equilibrium, [0.0], phase=0.0)
    if system.idle_stages:
        idle = f"meshes {system.idle_stages} carry no load, their open teeth are no spring"
        warn_user(f"{idle}; load all outputs, loads={{shaft: torque}}, if they shall count")
    return modes_of(system).omega / (2 * pi)


def modes_of(system: LinearSystem, number: int = 0) -> Eigenmodes:
    """Modes of a system at one of its speeds, by its number; their shapes over all coordinates."""
    total = system.stiffness if system.centrifugal is None else system.stiffness + system.centrifugal[number]
    mass, stiffness, damping = (system.reduced(x) for x in (system.mass, total, system.damping[number]))
    solved = eigenmodes(mass, stiffness, damping, system.rigid)
    return solved._replace(shapes=system.motions @ solved.shapes)


def energy_shares(system: LinearSystem, solved: Eigenmodes) -> np.ndarray:
    """(n_mode, n_element) shares of the strain energy of each mode; 0 for rigid-body motions."""
    shapes = solved.shapes
    energies = [np.einsum("ij,ij->j", shapes.conj(), e.stiffness @ shapes).real for e in system.elements]
    total = np.sum(energies, axis=0)
    return np.where((solved.omega > 0) & (total > 0), energies / np.where(total > 0, total, 1.0), 0.0).T


def _dataset(system: LinearSystem, solved: Eigenmodes, shape: xr.DataArray) -> xr.Dataset:
    """The labelled result."""
    k = system.mesh_stiffness
    participation = (solved.shapes.T @ system.rows.T) * k
    normalized = {"long_name": "shape of modal mass 1", "units": "kg^-0.5, of angles rad m^-1 kg^-0.5"}
    share = {"long_name": "share of the strain energy", "units": "1"}
    excitation = {"long_name": "generalized excitation by a unit transmission error", "units": "kg^0.5/s^2"}
    by_mode, by_stage = ("mode", "stage"), ("stage",)
    variables = {
        "frequency": ("mode", solved.omega / (2 * pi), {"long_name": "natural frequency", "units": "Hz"}),
        "damping_ratio": ("mode", solved.damping_ratio, {"long_name": "damping ratio", "units": "1"}),
        "shape": shape.real.assign_attrs(normalized),
        "shape_imaginary": shape.imag.assign_attrs(normalized),
        "energy_share": (("mode", "element"), energy_shares(system, solved), share),
        "participation": (by_mode, participation.real, excitation),
        "participation_imaginary": (by_mode, participation.imag, excitation),
        "mesh_stiffness": (by_stage, k, {"long_name": "tangent mesh stiffness", "units": "N/m"}),
        "mesh_force": (by_stage, system.mesh_force, {"long_name": "mesh force", "units": "N"}),
    }
    coords = {
        "mode": np.arange(1, solved.omega.size + 1),
        "stage": system.stages,
        "element": [element.name for element in system.elements],
        "element_kind": ("element", [element.kind for element in system.elements]),
    }
    return xr.Dataset(variables, coords)
