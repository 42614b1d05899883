"""How many elastic coordinates a shaft needs, by linear responses to the transmission error beside finite elements.

The transmission error of a mesh, with the harmonics of its map, excites two shafts on their bearings; the other meshes
are open. Responses are the dynamic transmission error and the forces of the bearings, over mesh frequencies up to
`HIGHEST`. Both shafts are beams of finite elements; one is then reduced, rigid, or to its static shapes with more and
more modes. The first reduction is taken whose errors are small. Bearings have their tangent stiffness, the mean of both
directions; gyroscopic moments are left out.

These errors are those of the choice. What a user reads of a run errs by both shafts of a mesh and by the step, and its
windows lie at equal distances of speed, so that the high ones, which are worse, count more. Such errors the plan prints
for each mesh. They are linear, too: where a resonance jumps or is unstable small errors grow. In runs to 3500 rpm
(tests/benchmarks/benchmark_whole_shafts.py) 90 % of the windows were within 0.29 % (DTE) and 0.54 % (bearing forces) on
120 x 50 mm, and 0.27 % and 0.86 % on 300 x 40 mm, where 0.43, 0.73, 0.42 and 0.78 % were told.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from math import inf, pi
from typing import NamedTuple

import numpy as np
import scipy

from exugear.contact.reference_configuration import spatial_row
from exugear.gearbox.elastic_shaft import CAP, PLANES, RIGID, ElasticShaft, elastic_shaft, rigid_motion, rigid_shaft
from exugear.gearbox.gearbox import Gearbox
from exugear.gearbox.mesh_damping import mean_stiffness
from exugear.gearbox.modes_in_steps import factors_in_steps, rate_in_steps, square_in_steps
from exugear.gearbox.shaft import Shaft
from exugear.gearbox.stage import Stage
from exugear.planning.coordinates import Coordinates
from exugear.planning.map_axes import mesh_frame, static_offsets
from fem.support.validation import require

#: Lowest and highest mesh frequency [Hz], number of mesh frequencies, and of harmonics of the transmission error.
LOWEST, HIGHEST, FREQUENCIES, HARMONICS = 100.0, 4000.0, 240, 5
#: Number of mesh frequencies, at equal distances, by which the errors of a mesh are told.
FREQUENCIES_IN_RUN = 800
#: Number of windows of the mesh frequency in which responses are compared by their rms.
WINDOWS = 40
#: Damping of the modes in the comparison, as share of the critical one: that of a shaft without its mesh and bearings.
DAMPING = 0.01
#: What the errors in the printed plan cover.
COVERED = (
    f"{HARMONICS} harmonics of the mesh up to {HIGHEST:g} Hz at {100 * DAMPING:g} % damping, linear, without "
    "gyroscopic moments, this shaft alone"
)
#: Largest errors of the dynamic transmission error and of bearing forces, in 90 % of the windows and in all. Those of
#: both shafts of a mesh add up, and those of the step.
DTE_ERROR, BEARING_ERROR, SHARE = (0.003, 0.006), (0.004, 0.009), 90
#: What the errors of a mesh cover, in steps of a run.
COVERED_IN_RUN = (
    f"both shafts together, steps of {{:.3g}} s, linear, {SHARE} % of the windows of a run-up to a mesh frequency of "
    f"{HIGHEST:g} Hz"
)
#: Share of the largest bearing force up to which a bearing does not count.
IDLE = 0.01
#: Excess over the least one up to which a reduction with fewer coordinates is as good.
NEARLY = 1.1
#: Largest number of bending modes in each plane, and of modes of torsion, that is tried.
MOST_MODES, MOST_TORSION = 8, 3
#: Largest errors by the step of a run, as above, at a tolerance of 1e-3; ratio of two steps that are tried, and the
#: longest and the shortest of them [s].
DTE_ERROR_BY_STEP, BEARING_ERROR_BY_STEP = (0.003, 0.005), (0.005, 0.01)
STEP_RATIO, LONGEST, SHORTEST = 1.05, 4e-5, 4e-6
#: Phases at which the transmission error is sampled, at a share of the largest force of the map.
PHASES, LOADED = 32, 0.5


class Errors(NamedTuple):
    """Relative errors of the dynamic transmission error and of bearing forces, in 90 % of the windows and in all."""

    dte: tuple[float, float]
    bearing: tuple[float, float]

    @property
    def excess(self) -> float:
        """The largest of the errors over what a run may neglect."""
        allowed = *DTE_ERROR, *BEARING_ERROR
        return max(error / least for error, least in zip((*self.dte, *self.bearing), allowed, strict=True))

    @property
    def small(self) -> bool:
        """Whether a run may neglect them."""
        return self.excess < 1

    def __str__(self) -> str:
        dte, forces = (f"{_percent(near)} (at most {_percent(far)})" for near, far in self)
        return f"{dte} in the DTE" + (f", {forces} in bearing forces" if self.bearing[1] else "")


def _percent(error: float) -> str:
    """An error to two digits, without an exponent."""
    return f"{float(f'{100 * error:.2g}'):g} %"


class Response(NamedTuple):
    """Responses to a unit mesh force over frequencies: motion along the line of action, and forces of the bearings.

    receptance   (n,) [m/N]
    bearings     (n_bearing, 3, n) along x, y, z
    """

    receptance: np.ndarray
    bearings: np.ndarray


@dataclass(frozen=True, eq=False)
class MeshOfShaft:
    """A shaft with the mesh that excites it.

    axial   position of its gear [m]
    row     (6,) slopes of the deflection by the coordinates of the gear's body
    end     torsional stiffness by which the end of the shaft is held [N m/rad]: inf where its speed is imposed, 0 free
    """

    shaft: Shaft
    axial: float
    row: np.ndarray
    end: float


@dataclass(frozen=True, eq=False)
class Excitation:
    """A mesh that excites a shaft, which is to be reduced, and its mate.

    shaft       the shaft
    mate        receptance of the other shaft, by its finite elements (n,)
    mesh        (n,) stiffness of the mesh, with its damping as imaginary part [N/m]
    harmonics   (n_harmonic,) amplitudes of the transmission error in any unit
    omega       (n,) angular frequencies: of each mesh frequency, all harmonics
    """

    shaft: MeshOfShaft
    mate: np.ndarray
    mesh: np.ndarray
    harmonics: np.ndarray
    omega: np.ndarray

    @cached_property
    def of_beam(self) -> np.ndarray:
        """`levels` by finite elements."""
        return self.levels(beam_response(self.shaft, self.omega))

    def errors(self, reduced: ElasticShaft) -> Errors:
        """Errors of a reduction of the shaft beside its finite elements."""
        return _errors(self._reduced(reduced), self.of_beam)

    def errors_by_step(self, reduced: ElasticShaft, step: float) -> Errors:
        """Errors of a reduction in steps [s] of the fourth-order rule, beside the same without them."""
        return _errors(self._reduced(reduced, step), self._reduced(reduced))

    def _reduced(self, reduced: ElasticShaft, step: float | None = None) -> np.ndarray:
        """`levels` by a reduction; step: of a run [s]."""
        return self.levels(reduced_response(self.shaft, reduced, self.omega, step))

    def levels(self, response: Response) -> np.ndarray:
        """(1 + n_bearing, n_window) rms of the dynamic transmission error and of the bearing forces in windows."""
        receptance = response.receptance + self.mate
        force = self.mesh / (1 + self.mesh * receptance)
        squares = [np.abs(receptance * force) ** 2, *(np.abs(response.bearings * force) ** 2).sum(axis=1)]
        weighted = np.reshape(squares, (len(squares), -1, HARMONICS)) @ self.harmonics**2
        return np.sqrt(weighted.reshape(len(squares), WINDOWS, -1).mean(axis=2))


def _errors(reached: np.ndarray, exact: np.ndarray) -> Errors:
    """Errors of levels (1 + n_bearing, n_window) beside exact ones."""
    relative = np.abs(reached / np.where(exact > 0, exact, 1.0) - 1)
    largest = exact[1:].max(axis=1)
    loaded = np.append(relative[1:][largest > IDLE * largest.max(initial=0.0)], 0.0)
    return Errors(*((float(np.percentile(x, SHARE)), float(x.max())) for x in (relative[0], loaded)))


def step_of(excitations: Sequence[Excitation], reduced: ElasticShaft) -> float:
    """The longest step [s] in which transmission error and bearing forces of an elastic shaft are accurate."""
    step = LONGEST
    while step > SHORTEST and any(
        not _small_by_step(excitation.errors_by_step(reduced, step)) for excitation in excitations
    ):
        step /= STEP_RATIO
    return step


def _small_by_step(errors: Errors) -> bool:
    allowed = *DTE_ERROR_BY_STEP, *BEARING_ERROR_BY_STEP
    return all(error < least for error, least in zip((*errors.dte, *errors.bearing), allowed, strict=True))


class Flexibility(NamedTuple):
    """By the names of shafts: elastic shafts, reasons for their coordinates or for none, longest steps of a run [s].

    Among the reasons are the errors in a run, by the labels of stages.
    """

    elastic: dict[str, ElasticShaft]
    reasons: dict[str, str]
    steps: dict[str, float]


def flexibility(gearbox: Gearbox, shafts: Mapping[str, Coordinates]) -> Flexibility:
    """The elastic shafts of a gearbox, with the coordinates and the steps that they need."""
    elastic, reasons, steps = Flexibility({}, {}, {})
    for shaft in gearbox.shafts:
        if not shaft.sections:
            continue
        if any(stage.carrier for stage in gearbox.stages if shaft in stage.shafts):
            reasons[shaft.name] = "twists towards its end, but is rigid otherwise, as shafts of planetary sets are"
            continue
        chosen, reasons[shaft.name], step = _chosen(gearbox, shaft, shafts)
        if chosen:
            elastic[shaft.name], steps[shaft.name] = chosen, step
    for label, stage in zip(gearbox.labels, gearbox.stages, strict=True):
        if stage.fast.name in elastic or stage.slow.name in elastic:
            step = min(steps.values())
            errors = _errors_in_run(gearbox, stage, shafts, elastic, step)
            reasons[label] = f"errors of runs beside finite elements ({COVERED_IN_RUN.format(step)}) {errors}"
    return Flexibility(elastic, reasons, steps)


def _errors_in_run(
    gearbox: Gearbox,
    stage: Stage,
    shafts: Mapping[str, Coordinates],
    elastic: Mapping[str, ElasticShaft],
    step: float,
) -> Errors:
    """Errors of both shafts of a mesh together, in steps [s], in windows of equal width as a steady run-up has them."""
    frequencies = np.linspace(LOWEST, HIGHEST, FREQUENCIES_IN_RUN)
    exact = [_excitation(gearbox, stage, shaft, shafts, frequencies) for shaft in (stage.fast, stage.slow)]
    responses = []
    for excitation in exact:
        side, omega = excitation.shaft, excitation.omega
        reduced = elastic.get(side.shaft.name) or (rigid_shaft(side.shaft) if side.shaft.sections else None)
        responses.append(reduced_response(side, reduced, omega, step) if reduced else rigid_response(side, omega))
    errors = [
        _errors(replace(excitation, mate=mate.receptance).levels(response), excitation.of_beam)
        for excitation, response, mate in zip(exact, responses, responses[::-1], strict=True)
        if excitation.shaft.shaft.sections
    ]
    return Errors(*map(tuple, np.max(errors, axis=0).tolist()))


def _chosen(
    gearbox: Gearbox, shaft: Shaft, shafts: Mapping[str, Coordinates]
) -> tuple[ElasticShaft | None, str, float]:
    """The reduction of a shaft that suffices, with its errors in words and the step [s] of a run.

    None for a shaft that only twists to its end.
    """
    stages = [stage for stage in gearbox.stages if shaft in stage.shafts]
    frequencies = np.geomspace(LOWEST, HIGHEST, FREQUENCIES)
    excitations = [_excitation(gearbox, stage, shaft, shafts, frequencies) for stage in stages]
    held = np.isinf(excitations[0].shaft.end)
    axial, spatial = any(stage.pair.beta_b for stage in stages), shafts[shaft.name].on_bearings

    def errors_of(reduced: ElasticShaft) -> Errors:
        errors = np.max([excitation.errors(reduced) for excitation in excitations], axis=0)
        return Errors(*map(tuple, errors.tolist()))

    rigid = errors_of(rigid_shaft(shaft))
    several = len(shaft.stations) > 1
    if rigid.small and not several and not shaft.is_loaded and _end_turns_slowly(shaft):
        return None, f"rigid but for the twist towards its end: errors beside finite elements {rigid}", LONGEST
    if spatial:
        _check_loads_known(shaft)
    bending = range(MOST_MODES + 1) if spatial else [0]
    pairs = sorted(product(bending, range(MOST_TORSION + 1)), key=lambda pair: (2 * pair[0] + pair[1], pair[1]))
    compared: list[tuple[ElasticShaft, Errors]] = []
    for pair in pairs:
        tried = elastic_shaft(shaft, *pair, spatial=spatial, axial=axial, held=held)
        compared.append((tried, errors_of(tried)))
        if compared[-1][1].small:
            break
    least = min(errors.excess for _, errors in compared)
    reduced, errors = next(tried for tried in compared if tried[1].excess <= NEARLY * least)
    larger = "" if errors.small else ", which is more than wanted"
    twist = f"{reduced.torsion.modes} modes of torsion"
    shapes = (
        f"{reduced.elastic} elastic coordinates of static shapes and {reduced.modes} bending modes a plane, {twist}"
    )
    words = shapes if spatial else f"elastic in torsion, {twist}"
    step = step_of(excitations, reduced)
    return (
        reduced,
        f"{words}: errors beside finite elements ({COVERED}) {errors}{larger}; if it were rigid {rigid}",
        step,
    )


def _end_turns_slowly(shaft: Shaft) -> bool:
    """Whether the steps of a run need no care of the free end of a shaft, whose inertia is small."""
    return shaft.twist is None or shaft.twist.torsion < CAP**2 * shaft.twist.inertia


def _check_loads_known(shaft: Shaft) -> None:
    """ValueError for drags by the load of a bearing, which is known of rigid shafts only."""
    unknown = [axial for axial, drag in shaft.drags if drag.needs_load]
    needed = f"load of the BearingDrag at {unknown} m of shaft {shaft.name!r} is not known, as the shaft is elastic"
    require(not unknown, f"{needed}; pass load=... [N]")


def _excitation(
    gearbox: Gearbox, stage: Stage, shaft: Shaft, shafts: Mapping[str, Coordinates], frequencies: np.ndarray
) -> Excitation:
    """The mesh of a stage that excites one of its shafts, at mesh frequencies [Hz]."""
    omega = 2 * pi * np.outer(frequencies, np.arange(1, HARMONICS + 1)).ravel()
    sides = dict(zip((stage.fast.name, stage.slow.name), _meshes(gearbox, stage, shafts), strict=True))
    mate = stage.slow if shaft.name == stage.fast.name else stage.fast
    mesh = mean_stiffness(stage.force, stage.pair) + 1j * omega * stage.force.damping
    of_mate = sides[mate.name]
    receptance = (beam_response if mate.sections else rigid_response)(of_mate, omega).receptance
    return Excitation(sides[shaft.name], receptance, mesh, _harmonics(gearbox, stage), omega)


def _meshes(gearbox: Gearbox, stage: Stage, kinds: Mapping[str, Coordinates]) -> list[MeshOfShaft]:
    """Pinion's and wheel's shafts with their rows; shafts without bearings only spin."""
    rows = np.split(spatial_row(mesh_frame(gearbox, stage)), 2)
    for row, shaft in zip(rows, (stage.fast, stage.slow), strict=True):
        row[: 0 if kinds[shaft.name].on_bearings else RIGID] = 0.0
    shafts = zip((stage.fast, stage.slow), stage.axial_positions, rows, strict=True)
    return [MeshOfShaft(shaft, axial, row, _held(gearbox, shaft)) for shaft, axial, row in shafts]


def _held(gearbox: Gearbox, shaft: Shaft) -> float:
    """Torsional stiffness by which the end of a shaft is held [N m/rad]: where it drives, by the first coupling."""
    if shaft.name != gearbox.driving.name:
        return 0.0
    return shaft.coupling.torsion if shaft.coupling else inf


def _harmonics(gearbox: Gearbox, stage: Stage) -> np.ndarray:
    """(HARMONICS,) amplitudes of the transmission error of a stage over its map [m]; all equal where it is constant."""
    law, static = stage.force, static_offsets(gearbox, stage)
    law = law.flank_at(1, **{name: static[name] for name in law.offsets})
    force = LOADED * float(np.min(law.force_table[..., -1]))
    te = [law.deflection_at(phase, force) for phase in np.arange(PHASES) / PHASES]
    amplitudes = np.abs(np.fft.rfft(te))[1 : HARMONICS + 1]
    return amplitudes if amplitudes.max() > 0 else np.ones(HARMONICS)


def modal_receptance(omega: np.ndarray, squares: np.ndarray, step: float | None = None) -> np.ndarray:
    """(n_mode, n) amplitude of modes of squared frequencies (n_mode,) per force, at angular frequencies (n,).

    step   of the run [s], in which modes have the masses and dampings of `modes_in_steps`; None: exact
    """
    squares = np.maximum(squares, 0.0)[:, None]
    if step is None:
        return 1 / (squares * (1 + 2j * DAMPING) - omega**2)
    mass, damping = factors_in_steps(np.sqrt(squares), step)
    rate, square = damping * rate_in_steps(omega * step), mass * square_in_steps(omega * step) / step**2
    return 1 / (squares * (1 + 2j * DAMPING * rate) - square)


def beam_response(mesh: MeshOfShaft, omega: np.ndarray) -> Response:
    """Response of the finite elements of a shaft."""
    shaft, beam, gear = mesh.shaft, mesh.shaft.beam, mesh.shaft.beam.node(mesh.axial)
    at_gear = rigid_motion(shaft.centre - mesh.axial).T @ mesh.row
    receptance, forces = np.zeros(omega.size, complex), np.zeros((len(shaft.bearings), 3, omega.size), complex)
    squares, modes = scipy.linalg.eigh(beam.supported(shaft.planar_supports), beam.bending_mass)
    resonance = modal_receptance(omega, squares)
    for plane in PLANES if mesh.row[:RIGID].any() else ():
        load = sum(sign * at_gear[component] * modes[2 * gear + i] for i, (component, sign) in enumerate(plane))
        receptance += load**2 @ resonance
        for force, (axial, support) in zip(forces, shaft.planar_supports.items(), strict=True):
            node = 2 * beam.node(axial)
            force[plane[0][0]] -= (support[0] @ modes[node : node + 2] * load) @ resonance
    supports = {axial: bearing.stiffness[2, 2] for axial, bearing in shaft.bearings.items()}
    stiffness = beam.tension_stiffness.copy()
    for axial, k in supports.items():
        stiffness[beam.node(axial), beam.node(axial)] += k
    squares, modes = scipy.linalg.eigh(stiffness, beam.tension_mass)
    resonance, load = modal_receptance(omega, squares), at_gear[2] * modes[gear]
    receptance += load**2 @ resonance
    for force, (axial, k) in zip(forces, supports.items(), strict=True):
        force[2] -= (k * modes[beam.node(axial)] * load) @ resonance
    end = beam.node(shaft.end_position)
    stiffness, free = beam.torsion_stiffness.copy(), np.arange(beam.axial.size)
    if np.isinf(mesh.end):
        free = np.delete(free, end)
    else:
        stiffness[end, end] += mesh.end
    squares, turning = scipy.linalg.eigh(stiffness[np.ix_(free, free)], beam.torsion_mass[np.ix_(free, free)])
    load = at_gear[5] * turning[free == gear][0] if gear in free else np.zeros(squares.size)
    return Response(receptance + load**2 @ modal_receptance(omega, squares), forces)


def reduced_response(
    mesh: MeshOfShaft, reduced: ElasticShaft, omega: np.ndarray, step: float | None = None
) -> Response:
    """Response of a reduced shaft, which twists towards its end; step: of a run [s]."""
    shaft, flip = mesh.shaft, np.diag([1.0, -1.0])
    rows = {axial: reduced.motion_at(axial) for axial in shaft.bearings}
    stiffness, supports = np.diag(np.r_[np.zeros(RIGID), reduced.stiffness]), {}
    for axial, planar in shaft.planar_supports.items():
        support = np.zeros((6, 6))
        support[np.ix_([0, 4], [0, 4])], support[np.ix_([1, 3], [1, 3])] = planar, flip @ planar @ flip
        support[2, 2] = shaft.bearings[axial].stiffness[2, 2]
        supports[axial] = support
        stiffness += rows[axial].T @ support @ rows[axial]
    squares, modes = scipy.linalg.eigh(stiffness, np.diag(reduced.inertia))
    resonance, load = modal_receptance(omega, squares, step), mesh.row[:RIGID] @ reduced.of_body(mesh.axial) @ modes
    forces = [-((supports[axial] @ rows[axial] @ modes)[:3] * load) @ resonance for axial in shaft.bearings]
    receptance = load**2 @ resonance + mesh.row[5] ** 2 * _turning(mesh, reduced, omega, step)
    return Response(receptance, np.array(forces).reshape(len(shaft.bearings), 3, omega.size))


def _turning(mesh: MeshOfShaft, reduced: ElasticShaft, omega: np.ndarray, step: float | None) -> np.ndarray:
    """(n,) angle of a gear per torque on it [rad/(N m)] of a reduced shaft."""
    shaft, held = mesh.shaft, np.isinf(mesh.end)
    mass, stiffness, _, free = reduced.torsion.with_end(shaft, held=held)
    end = len(shaft.stations) if shaft.twist else 0
    stiffness[free == end, free == end] += 0.0 if held else mesh.end
    squares, modes = scipy.linalg.eigh(stiffness, mass)
    load = modes[free == shaft.stations.index(mesh.axial)]
    return (load**2 @ modal_receptance(omega, squares, step)).sum(axis=0)


def rigid_response(mesh: MeshOfShaft, omega: np.ndarray) -> Response:
    """Response of a rigid shaft without sections, on its bearings or spinning only."""
    shaft, held = mesh.shaft, np.isinf(mesh.end)
    moving = [i for i in range(6) if (i < RIGID and shaft.bearings) or (i == RIGID and not held)]
    stiffness, mass = shaft.support.copy(), np.diag([shaft.mass] * 3 + [shaft.transverse] * 2 + [shaft.inertia])
    stiffness[5, 5] += mesh.end if not held else 0.0
    if not moving:
        return Response(np.zeros(omega.size, complex), np.zeros((0, 3, omega.size)))
    squares, modes = scipy.linalg.eigh(stiffness[np.ix_(moving, moving)], mass[np.ix_(moving, moving)])
    load = mesh.row[moving] @ modes
    return Response(load**2 @ modal_receptance(omega, squares), np.zeros((0, 3, omega.size)))
