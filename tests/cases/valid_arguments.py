"""Valid arguments of all that is public, by name; small scenes, made once."""

from functools import cache
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import exudyn as exu
import exudyn.itemInterface as eii
import meshio
import numpy as np
import scipy
import xarray as xr
from coupled_sets import ravigneaux
from elastic_rings import ring_map, ring_modes
from matplotlib.figure import Figure
from paper_gears import paper_gear, paper_pair
from planetary_boxes import RING_PAIR, SUN_PAIR, planetary, planetary_box
from rexs_files import two_stages as two_stages_of_rexs
from ring_gears import COARSE, bolted, thin_ring_pair
from scenes import linear_law, smooth_box, smooth_map
from skfem import ElementQuad1, MeshHex
from skfem.io.meshio import to_meshio

import exugear
import fem
from exugear.study.flank_search import Design, FlankObjective
from exugear.study.goals import Evaluation
from fem.units import mm, um

RING = exugear.RingPair(paper_gear(), z=-120, a=-84 * mm)
LINE, TURNS = np.linspace(0.0, 1.0, 200), np.full(200, 2 * np.pi * 20)
TRIANGLE = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]) * mm, np.array([[0], [1], [2]])
CUBE = np.array([[0, 1, 1, 0, 0, 1, 1, 0], [0, 0, 1, 1, 0, 0, 1, 1], [0, 0, 0, 0, 1, 1, 1, 1]]) * mm


def shared_map() -> xr.Dataset:
    """A small map with the load shares that friction reads."""
    ste = fem.ste_map(paper_pair(), [0, 10.0, 300.0], np.arange(8) / 8, np.outer([0, 1e-6, 9e-6], np.ones(8)))
    shares = np.full((3, 8, 2), 0.5)
    return ste.assign(load_share=(("torque", "phase", "pair"), shares), pair=("pair", [0, 1]))


def map_around_a_ring() -> xr.Dataset:
    """A small map of a ring on eight bolts."""
    angles = {"ring_angle": np.arange(4) / 4 * np.pi / 4}
    te = np.multiply.outer([0, 1e-6, 9e-6], np.ones((4, 8)))
    return fem.ste_map(thin_ring_pair(bolted()), [0, 10.0, 300.0], np.arange(8) / 8, te, angles)


COARSE_SLICES = fem.Slices(COARSE.density, COARSE.slices)


@cache
def tooth_pairs() -> xr.Dataset:
    """Tooth pairs of the paper's pair."""
    return fem.tooth_pair_map(paper_pair(), 100.0, resolution=COARSE_SLICES, checks=0, progress=False)


def stresses() -> xr.Dataset:
    """What stands in the map of root stress."""
    grid, values = ("torque", "phase"), np.full((2, 8), 1e8)
    names = {"hertz_pressure": (grid, values), "peak_pressure": (grid, values), "tip_contact": (grid, 0 * values)}
    roots = {"root_stress": (("gear", *grid), np.array([values, values]))}
    return xr.Dataset(names | roots, {"gear": ["pinion", "wheel"], "torque": [1.0, 900.0], "phase": np.arange(8) / 8})


def dynamic_data(run: exugear.Run) -> tuple[xr.Dataset, xr.Dataset]:
    """Dynamic factors and stresses of a run."""
    return exugear.dynamic_factor(run, 5), exugear.dynamic_stress(run, stresses())


def load_factors() -> xr.Dataset:
    """What stands in load factors."""
    factors = {name: ("torque", [1.0, 1.2]) for name in ("K_H_beta", "K_H_alpha")}
    line_load = ("torque", "axial_position"), np.full((2, 3), 1e5)
    return xr.Dataset(factors | {"line_load": line_load}, {"torque": [1.0, 9.0], "axial_position": [-mm, 0.0, mm]})


@cache
def run_on_bearings() -> exugear.Run:
    """A short run of the paper's pair on two bearings a shaft, which records their forces."""
    ball = exugear.Bearing(radial=2e8, axial=1e8, damping_time=2e-5)
    model = exugear.build(smooth_box(parts={0 * mm: ball, 60 * mm: ball}))
    return exugear.run_up(model, speed=(50.0, 60.0), load=100.0, duration=0.02, progress=False, checks=0)


@cache
def rolling_box() -> exugear.Gearbox:
    """The paper's pair on two ball bearings a shaft."""
    ball = exugear.RollingBearing.deep_groove(Z=9, D_w=12 * mm, D_pw=60 * mm, damping_time=2e-5)
    return smooth_box(parts={0 * mm: ball, 60 * mm: ball})


@cache
def run_on_rolling_bearings() -> exugear.Run:
    """A short run on rolling bearings, with their displacements."""
    options = {"displacement": True, "progress": False, "checks": 0}
    return exugear.run_up(exugear.build(rolling_box()), speed=50.0, load=100.0, duration=0.01, **options)


@cache
def run_of_a_set() -> exugear.Run:
    """A short run of a planetary set."""
    model = exugear.build(planetary_box())
    return exugear.run_up(model, speed=50.0, load=100.0, duration=1e-3, progress=False, checks=0)


@cache
def loads_over_flanks() -> xr.Dataset:
    """A uniform load of the paper's pair over two phases, pairs and parts of the face."""
    over, values = ("torque", "phase", "pair", "axial_position"), np.ones((1, 2, 2, 2))
    path = np.linspace(-6 * mm, 6 * mm, 4).reshape(2, 2)[..., None] + np.zeros(2)
    variables = {"line_load": (over, values), "pressure": (over, values), "path": (over[1:], path.transpose(1, 0, 2))}
    axes = {"torque": [100.0], "phase": [0.0, 0.5], "pair": [-1, 0], "axial_position": [-6 * mm, 6 * mm]}
    return xr.Dataset(variables, axes, fem.ste_map(paper_pair(), [0, 1.0], [0.0], np.zeros((2, 1))).attrs)


@cache
def loaded_faces() -> xr.Dataset:
    """The load over the face of the paper's pair."""
    return exugear.load_distribution(loaded_box(), 100.0, mesh_stiffness=15e9)


@cache
def loaded_box() -> exugear.Gearbox:
    """The paper's pair on two bearings a shaft."""
    ball = exugear.Bearing(radial=2e8, axial=1e8)
    return smooth_box(parts={0 * mm: ball, 60 * mm: ball})


@cache
def bar() -> meshio.Mesh:
    """A bar as the mesh of a housing."""
    return to_meshio(MeshHex.init_tensor(*(np.linspace(0, size, n) for size, n in ((0.3, 4), (0.1, 2), (0.1, 2)))))


def bar_end(points: np.ndarray) -> np.ndarray:
    """Whether points lie at the end of the bar."""
    return points[0] > 0.299


def bar_start(points: np.ndarray) -> np.ndarray:
    """Whether points lie at its beginning."""
    return points[0] < 0.001


@cache
def reduced_housing() -> fem.ReducedHousing:
    """The bar, a seat at its end."""
    return fem.reduce_housing(bar(), [bar_end], bar_start, modes=3)


def elastic_shaft() -> exugear.Shaft:
    """A shaft from sections."""
    ball = exugear.Bearing(radial=2e8, axial=1e8)
    return exugear.Shaft("fast", {0 * mm: ball, 60 * mm: paper_gear(), 90 * mm: ball}, sections=[(40 * mm, 90 * mm)])


def two_bodies() -> tuple[Any, Any, list]:
    """A hand-built system with the paper's pair in contact: container, mbs, its bodies and contact."""
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    mbs.variables["container"] = container
    nodes = [mbs.AddNode(eii.Node1D(referenceCoordinates=[0.0])) for _ in range(2)]
    positions = ([0, 0, 0], [150 * mm, 0, 0])
    items = [
        mbs.AddObject(eii.ObjectRotationalMass1D(inertia=1e-3, nodeNumber=node, referencePosition=position))
        for node, position in zip(nodes, positions, strict=True)
    ]
    contact = exugear.CreateGearContact(mbs, itemNumbers=items, pair=paper_pair(), force=linear_law(), phase=0.1)
    mbs.Assemble()
    return container, mbs, [*items, contact]


def design() -> exugear.OptimalFlanks:
    """A design of the paper's pair that is made up: its search knows two designs."""
    pair, goal = paper_pair(), exugear.Goal("peak_to_peak", 100.0)
    evaluation = Evaluation((goal, exugear.Goal("mean", 100.0)), "sum", 8, fem.Slices(), None)
    known = {(0.0,): Design((0.0,), np.ones(2), np.ones(2), 2.0)}
    search = FlankObjective(lambda C_a: pair, {"C_a": exugear.Variable(0.0, 1.0)}, evaluation, known=known)
    values = {goal.label: 1e-6}
    return exugear.OptimalFlanks({"C_a": 0.0}, pair, 1.0, values, values, values, {}, xr.Dataset(), search)


@cache
def instances() -> dict[str, Any]:
    """An instance of each public class; its fields are valid arguments of the class."""
    box = smooth_box()
    model = exugear.build(box)
    run = exugear.run_up(model, speed=(50.0, 60.0), load=100.0, duration=0.05, progress=False, checks=0, power=True)
    drag = exugear.Drag(0.1)
    bearing = exugear.Bearing(radial=1e8, axial=1e8, tilt=1e5, damping_time=1e-5, clearance=5 * um, drag=drag)
    field = fem.stress.Field(TRIANGLE[0], TRIANGLE[1], TRIANGLE[0], *np.ones((4, 3)), np.zeros(2), 0.0)
    recorder = exugear.Recorder()
    recorder.start(1e-4, 10, motion=True)
    made = [
        fem.iso6336.FlankDeviations(f_pb_eff=5 * um), fem.EdgeBreak(0.2 * mm), fem.EndRelief(5 * um, 2 * mm),
        fem.Grid((1e-2, 2e-2), (-1e-2, 1e-2), ((0, 0), (0, 0))), fem.HelixSlope(5 * um), fem.LeadCrowning(5 * um),
        fem.PitchDeviation((0.0,) * 57), fem.ProfileCrowning(5 * um), fem.RootRelief(5 * um, 2 * mm), fem.TipRelief(5
        * um, 2 * mm), fem.Waviness(3, um), fem.OnTooth(1, ()),
        fem.Spall(0.15, 1e-3, 5e-3), fem.crack(paper_gear(), 0.1), fem.iso1328(paper_gear(), 6), fem.Sides(),
        fem.Offsets(a=150 * mm), fem.Resolution(neighbours=1), fem.Slices(slices=40),
        fem.UpTo(100.0), fem.Material(), paper_gear(), paper_pair(), fem.map_cost(paper_pair(), 100.0), fem.Density(),
        fem.PinionCutter(20, 0.1, 0.5 * mm, 50 * mm), bolted(), fem.Bush(radial=1e9, tangential=1e9),
        exugear.Rule.fourth_order(1e-5), fem.dynamic.RunUp(), fem.explicit.CentralDifferences(), field,
        exugear.Coupling(1e4, inertia=0.1), exugear.Disc(1.0, 1e-3, 1e-3), exugear.Placement(),
        exugear.ExternalForce(y=-100.0), exugear.Unbalance(1e-3), exugear.LoadCase("case", 100.0, 10.0),
        exugear.LoadSpectrum([exugear.LoadCase("case", 100.0, 10.0)], 3600.0),
        exugear.MeshFriction(0.05, np.zeros(4), np.full(4, mm)), RING, box, box.stages[0],
        exugear.SchlenkFriction(0.02, 0.4 * um), exugear.NiemannFriction(0.02, 0.4 * um), exugear.XuFriction(0.02, 0.4
        * um), exugear.Drag(1.0, 1e-3), exugear.BearingDrag(60 * mm, 2.0, 20e-6, 3e-4, load=1000.0),
        exugear.SkfDrag("62", 25 * mm, 52 * mm, 20e-6, load=(1000.0, 0.0)),
        elastic_shaft(), linear_law(), model, model.plan.scene, model.plan, run, recorder, bearing,
        exugear.Speed(50.0), exugear.Torque(100.0), exugear.MotorCurve([0.0, 100.0], [50.0, 0.0]),
        planetary(), exugear.RingSensor(0.5, np.cos),
        reduced_housing(), exugear.Housing([("fast", 0.0)], 1e8 * np.eye(6)),
        exugear.propose_flank_corrections(loaded_box(), 100.0, mesh_stiffness=15e9, parts=8),
        exugear.deflected_pair(loaded_box(), loaded_faces()),
        planetary(), exugear.RingSensor(0.5, np.cos), exugear.SNCurve([1e3, 1e6], [2e9, 1e9]),
        exugear.RollingBearing.angular_contact(Z=9, D_w=12 * mm, D_pw=60 * mm, alpha=0.3),
        ravigneaux()[1], exugear.TorqueSupport(1e6), exugear.SpeedReached("fast", 55.0),
        exugear.Variable(0.0, 1.0, 0.1, "um"), exugear.Goal("peak_to_peak", 100.0), design(),
        exugear.Apart(0.01), run.energy_balance(), exugear.dte_envelope(run),
    ]  # fmt: skip
    return {type(instance).__name__: instance for instance in made}


def cycle_powers() -> xr.Dataset:
    """Powers over speeds and loads around the load case of these arguments."""
    over, loads = ("speed", "load"), [5.0, 20.0]
    power = np.multiply.outer([50.0, 150.0], loads)
    values = {"power_in": (over, power / 0.98), "power_out": (over, power)}
    return xr.Dataset(values, {"speed": [50.0, 150.0], "load": loads})


@cache
def by_name() -> dict[str, Any]:
    """Values of arguments by name; where a name has several meanings, after the name of its function or class."""
    made, (container, mbs, items) = instances(), two_bodies()
    folder = Path(mkdtemp())
    fem.save(smooth_map(), folder / "map.nc")
    made["Run"].save(folder / "run.nc")
    linear_law().save(folder / "law.nc")
    np.savez(folder / "housing.npz", K=1e8 * np.eye(6))
    (folder / "te.csv").write_text("torque [N m], phase [1], te [um]\n0, 0, 0\n0, 0.5, 0\n9, 0, 1\n9, 0.5, 1\n")
    chart = "tooth [1], removed [um]\n" + "".join(f"{i}, 0\n" for i in range(57))
    (folder / "chart.csv").write_text(chart)
    (folder / "trace.csv").write_text("tooth [1], axial [mm], removed [um]\n0, -9, 0\n0, 9, 1\n")
    (folder / "bearing.csv").write_text("displacement [um], force [N]\n0, 0\n10, 1000\n")
    (folder / "cycle.csv").write_text("speed [rpm], load [N m], share [%]\n1000, 50, 100\n")
    (folder / "motor.csv").write_text("speed [rpm], torque [N m]\n0, 50\n1000, 0\n")
    (folder / "flank.csv").write_text("roll [mm], axial [mm], removed [um]\n9, -9, 0\n9, 9, 0\n30, -9, 0\n30, 9, 0\n")
    ax = Figure().add_subplot()
    quantity = ("z", 57.0, "1", "number of teeth")
    plain = {
        "pair": paper_pair(), "gear": paper_gear(), "torque": 100.0, "phases": 8, "phase": 0.1,
        "te": np.zeros((2, 8)), "offsets": fem.Offsets(), "accuracy": 0.01, "progress": False, "density": fem.Density(),
        "element": ElementQuad1(), "penalty": 1e15, "run": made["Run"], "scheme": fem.explicit.CentralDifferences(),
        "resolution": fem.Resolution(), "executor": None, "path": folder / "map.nc", "data": stresses(),
        "ste": shared_map(), "force": linear_law(), "stage": 0, "mbs": mbs, "container": container, "name": "",
        "itemNumbers": items[:2], "friction": made["MeshFriction"], "recorder": exugear.Recorder(),
        "localPositions": [[0, 0, 0]] * 2, "localAxes": [[0, 0, 1]] * 2, "direction": 1, "contact": items[2],
        "fileName": "", "storeInternal": True, "load": 100.0, "acceleration": 1.0, "model": made["Model"],
        "gearbox": made["Gearbox"], "plan": made["Plan"], "duration": 0.05, "speed": (50.0, 60.0), "tolerance": 1e-3,
        "step": 1e-6, "sample": 1e-4, "sensor_period": 1e-3, "checks": 0, "abscissa": LINE, "signal": LINE,
        "time": LINE, "amplitude": LINE, "cycles": 100 * LINE, "windows": 10, "orders": 2.0, "revolutions": 4,
        "overlap": 0.5, "prominence": 0.1, "r": 75 * mm, "k": 7, "D_M": 5 * mm, "lever": 0.1, "axial": 0.0,
        "frequency": 1000.0, "mesh_frequency": 100.0, "interval": 1e-4, "number": 10, "steps": 5, "motion": True,
        "power": True, "displacement": True, "omega": 50.0, "start": 0.0, "end": 0.01, "first": 0,
        "side": 1, "coefficient": 0.05, "damping": 100.0, "backlash": 1e-4, "conserves": False, "extend": 1.5,
        "damping_ramp": 1e-6, "samples": 100,
        "length": 0.1, "d": 0.1, "d_bore": 0.02, "factor": 1.5, "line_load": 1e5, "C_R": 1.0, "C_M": 0.8, "ax": ax,
        "bodies": [TRIANGLE], "touching": [TRIANGLE[0]], "label": "a", "colours": "viridis", "colour": "k",
        "width": 1.0, "top": 1.0, "rows": 1, "columns": 1, "spatial": (), "runs": {"a": made["Run"]},
        "Z": 9, "D_w": 12 * mm, "D_pw": 60 * mm, "r_i": 6.3 * mm, "r_e": 6.4 * mm,
        "alpha": 0.3, "clearance": 5 * um, "C": 2e4, "E": 2.1e11, "nu": 0.3, "L_we": 12 * mm, "laminae": 10,
        "arrangement": "O", "spacing": 20 * mm, "preload": 100.0, "damping_time": 1e-5, "drag": None,
        "resonances": None,
        "points": TRIANGLE[0], "height": mm, "quads": np.array([[0], [1], [2], [0]]),
        "facets": np.array([[0, 4], [1, 5], [2, 6], [3, 7]]), "highest_order": 5.0, "decibels": 60.0, "pitches": 2.0,
        "alternating": True, "body": items[0], "phase_angle": 0.0, "color": (0.5, 0.5, 0.5, 1.0),
        "points_per_tooth": 24, "theta": 0.0, "tiles": 24, "scale": 2.0, "refine": 6, "fields": (made["Field"],),
        "t": 0.01, "pitch": 0.1, "title": "a", "message": "a", "value": 1.0, "unit": "1", "meaning": "a",
        "order": LINE, "low": LINE, "high": LINE, "rms": LINE,
        "peaks": exugear.spectrum.Peaks(LINE[1:3], LINE[1:3]), "divisors": (2, 1), "within": 0.1,
        "drives": {"fast": 50.0}, "loads": {"slow": 100.0}, "start_speed": None, "initial": None,
        "stop": [exugear.Apart(0.01)], "rotation": (0.4, 0.6, 0.0), "size": (120, 80), "zoom": 0.8,
        "speeds": [50.0, 60.0], "stations": 10, "bearing": "a", "frames": 4, "fps": 10.0,
        "drive": "held", "mode": 1, "marked": 0.1, "angle": 0.0, "turns_of": None, "relative_to": None,
        "ring_angles": None, "ring_angle": 0.0, **of_studies(folder),
    }  # fmt: skip
    points = ("speed", "load"), np.array([[0.98, 0.99], [0.97, 0.98]])
    efficiency = xr.Dataset(
        {"efficiency": points, "stopped": (points[0], np.full((2, 2), ""))},
        {"speed": [50.0, 60.0], "load": [50.0, 100.0]},
    )
    factors, stress = dynamic_data(made["Run"])
    special = {
        "dynamic_factor.speed": [10.0, 20.0], "dynamic_factor.windows": 5,
        "dynamic_factor.static_force": None, "plot_dynamic_factor.data": factors,
        "plot_dynamic_factor.iso": fem.iso6336.dynamic_factor(paper_pair(), 100.0, [10.0, 20.0]),
        "dynamic_stress.stresses": stresses(), "stress_envelope.stress": stress, "plot_dynamic_stress.data": stress,
        "plot_dynamic_stress.name": "root_stress", "plot_load_factors.data": load_factors(),
        "resonance_speed.mass": 100.0, "dynamic_factor.mass": 100.0, "dynamic_factor.K_A": 1.25,
        "dynamic_factor.deviations": fem.iso6336.FlankDeviations(),
        "efficiency.loads": [50.0, 100.0], "efficiency.tolerance": 1e-5, "plot_efficiency.data": efficiency,
        "Density.refined.q": 2, "with_teeth.teeth": 2, "with_teeth.behind": 1, "Density.steps.name": "flank",
        "pair_of.data": shared_map(), "over_pitches.ste": map_around_a_ring(), "ring_deflection.at": [0.0, 0.1],
        "plot_ring_stiffness.ste": map_around_a_ring(), "ring_deflection.pair": thin_ring_pair(bolted()),
        "ring_deflection.mesh": 0.2, "ring_deflection.resolution": COARSE, "Bolts.number": None,
        "static_transmission_error.resolution": None, "map_cost.resolution": None,
        "ste_map.torque": [0.0, 100.0], "ste_map.phase": np.arange(8) / 8, "ste_map.offsets": {},
        "transmission_error.run": fem.dynamic.RunUp(start=-0.1, stop=0.1, run_up=0.1, steps=20),
        "save.data": smooth_map(),
        "save_vtu.path": folder / "fields.vtu", "load.path": folder / "map.nc", "Run.load.path": folder / "run.nc",
        "MeshForce.load.path": folder / "law.nc", "ste_from_table.path": folder / "te.csv",
        "pitch_chart.path": folder / "chart.csv", "flank_traces.path": folder / "trace.csv", "crack.lost": 0.1,
        "wobble.amplitude": 5 * um, "iso1328.accuracy_class": 6, "iso1328.edition": 1995, "drawn_deviations.seed": 1,
        "drawn_deviations.tolerances": made["FlankTolerances"], "drawn_deviations.profiles": False,
        "drawn_deviations.leads": False, "run_out.z": 57, "run_out.amplitude": 5 * um, "missing.z": 57,
        "missing.teeth": [3], "tooth_pair_map.resolution": COARSE_SLICES, "tooth_pair_map.checks": 0,
        "MeshForce.from_tooth_pairs.pairs": tooth_pairs(), "MeshForce.from_tooth_pairs.coast": None,
        "MeshForce.ste.torque": [10.0], "MeshForce.ste.phases": 4,
        "Grid.from_table.path": folder / "flank.csv", "Bearing.from_table.path": folder / "bearing.csv",
        "LoadSpectrum.from_table.path": folder / "cycle.csv", "MotorCurve.from_table.path": folder / "motor.csv",
        "LoadSpectrum.from_table.gearbox": smooth_box(), "on_pinion.gearbox": smooth_box(), "on_pinion.hours": 100.0,
        "on_pinion.flank": "left", "on_pinion.stage": 0, "LoadSpectrum.efficiency.data": cycle_powers(),
        "Bearing.from_table.axial": 1e8, "from_table.tilt": 1e5,
        "Run.save.path": folder / "saved.nc", "save.path": folder / "saved.nc", "MeshFriction.from_ste.speed": 1.0,
        "report.path": folder / "run.html",
        "MeshFriction.of_pair.speed": 1.0, "loss.force": 100.0, "loss.speed": 50.0,
        "MeshFriction.from_ste.torque": 100.0, "torque.load": 100.0, "SkfDrag.torque.load": 0.0,
        "lever": 0.01, "guidance": 0.0, "taken_from.first": 0, "taken_from.step": 1, "taken_from.z": 57,
        "local.distance": mm, "start.friction": True, "start.zeroed": True,
        "forces_under.torques": [0.0, -100.0], "forces_under.held": "fast",
        "Gearbox.offsets.stage": made["Stage"], "direction_of.stage": made["Stage"], "start.carrier": True,
        "ring_modes.pair": thin_ring_pair(bolted()), "ring_modes.resolution": COARSE, "ring_modes.number": 4,
        "without_ring_modes.ste": ring_map(), "without_ring_modes.modes": ring_modes(), "Planetary.ring_modes": None,
        "RingSensor.quantity": "displacement", "ring_damping_ratio": 0.01,
        "planetary_phases.pitches": 1, "RingSensor.influence": np.cos, "RingSensor.angle": 0.5,
        "RingSensor.direction": "radial",
        "RingSensor.signal.run": run_of_a_set(), "RingSensor.signal.ring": "ring",
        "planetary_phases.sun_pair": SUN_PAIR, "planetary_phases.ring_pair": RING_PAIR, "planets": 3, "angles": None,
        "step_angle": 0.0, "tooth": None, "exact_ratios.stages": [planetary()], "exact_ratios.driving": "sun",
        "exact_ratios.held": "ring",
        "read_rexs.path": two_stages_of_rexs().write(folder / "gearbox.rexs"), "read_rexs.mesh": "iso6336",
        "read_rexs.shafts": "rigid", "read_rexs.bearings": "linear", "read_rexs.load_case": 1,
        "read_rexs.damping_ratio": 0.05, "write_rexs.path": folder / "saved.rexs", "write_rexs.load_cases": (),
        "planet_shares.run": run_of_a_set(), "planet_shares.member": "ring", "planet_shares.carrier": "carrier",
        **of_sets(),
        "reduce_housing.mesh": bar(), "reduce_housing.seats": [bar_end], "reduce_housing.fixed": bar_start,
        "reduce_housing.material": fem.STEEL, "reduce_housing.modes": 3,
        "ReducedHousing.response.frequency": [10.0], "ReducedHousing.surface_velocity.frequency": [10.0],
        "forces": np.ones((1, 6)), "damping_ratio": 0.02,
        "ReducedHousing.power_of_motion.rates": np.zeros((1, 9)), "plan.housing_modes": None,
        "plan.linear_bearings": [],
        "Housing.from_file.damping_ratio": 0.0, "Gearbox.between": {},
        "Housing.from_file.path": folder / "housing.npz", "Housing.from_file.mass": None,
        "Housing.from_file.seats": [("fast", 0.0)], "Housing.from_reduction.seats": [("fast", 0.0)],
        "Housing.from_reduction.reduced": reduced_housing(),
        "radiated_power.run": run_on_bearings(), "radiated_power.reduced": reduced_housing(),
        "radiated_power.seats": [("fast", 0.0)], "radiated_power.resolution": 200.0, "radiated_power.highest": 2000.0,
        "ReducedHousing.radiated_power.frequency": [10.0],
        "load_distribution.loads": None, "propose_flank_corrections.loads": None, "mesh_stiffness": 15e9,
        "parts": 8, "spread": 0.0, "deflected_pair.data": loaded_faces(), "deflected_pair.gearbox": loaded_box(),
        "deflected_pair.mesh": None, "plot_line_load.data": loaded_faces(), "plot_line_load.mesh": None,
        "plot_shaft_deflection.data": loaded_faces(), "plot_shaft_deflection.direction": "x",
        "plot_shaft_deflection.shaft": "fast", "plot_bearing_loads.data": loaded_faces(),
        "report.load_distribution": loaded_faces(),
        "bearing_life.run": run_on_rolling_bearings(), "bearing_life.gearbox": rolling_box(),
        "bearing_life.shares": None,
        "displacements": np.zeros((2, 5)), "RollingBearing.life.revolutions": [1.0, 2.0],
        "from_catalogue.kind": "angular contact", "from_catalogue.d": 25 * mm, "D": 52 * mm, "B": 15 * mm, "C_0": 1e4,
        "from_catalogue.C": 15.6e3, "from_catalogue.alpha": 0.7, "from_catalogue.clearance": 0.0,
        "under.force": [0.0, 0.0, 100.0, 0.0, 0.0], "displaced.displacement": np.zeros(5),
        "mesh_phases.harmonics": 2, "ratios.driving": "sun", "ratios.held": "ring",
        "radial_force.r": 2 * um, "deflection_at.force": 100.0,
        "cylinder.density": 7850.0, "plot_gears.ax": ax, "plot_field.bodies": [(*TRIANGLE, np.ones(3))],
        "plot_field.top": 1.0, "plot_root_stress.name": "root_stress", "plot_solid.points": CUBE,
        "plot_solid.ax": Figure().add_subplot(projection="3d"),
        "plot_bearing_forces.run": run_on_bearings(), "bearing_force_rms.run": run_on_bearings(),
        "steady_states.harmonics": 2, "plot_branches.quantity": "rms", "plot_branches.harmonic": None,
        "plot_branches.data": exugear.steady_states(made["Model"], speed=(50.0, 60.0), load=100.0),
        "plot_orbit.run": run_on_bearings(), "plot_orbit.bearing": "fast at 0 mm", "plot_orbit.window": (0.0, 0.02),
        "plot_mesh_force.window": (0.0, 0.05),
        "plot_te_harmonics.harmonics": 2, "te_harmonics.harmonics": 2, "animate_pair.path": folder / "pair.gif",
        "plot_contact_pattern.data": loads_over_flanks(), "plot_load_distribution.data": loads_over_flanks(),
        "plot_contact_pattern.name": "pressure", "plot_load_distribution.name": "pressure",
        **{f"{name}.loads": None for name in ("modes", "campbell", "eigenfrequencies", "steady_states", "plan")},
        "Coupling.further": (), "Coupling.name": "",
        "integrator.mbs": two_bodies()[1], "modes.speed": 10.0,
        "bending_frequencies.speed": 10.0, "campbell.harmonics": 2,
        "plot_modes.data": exugear.modes(made["Model"], load=100.0), "animate_mode.path": folder / "mode.gif",
        "animate_gearbox.path": folder / "gearbox.gif", "turn": 1.0,
        "animate_mode.data": exugear.modes(made["Model"], load=100.0),
        "plot_campbell.data": exugear.campbell(made["Model"], speed=(0.0, 60.0), load=100.0),
        "tooth_damage.stresses": stresses().assign_attrs(shared_map().attrs), "tooth_damage.torque": [100.0],
        "tooth_damage.speed": [50.0], "hours": [1e3], "load_factor": 1.0, "contacts": (1, 1),
        "tooth_damage.pitting": exugear.SNCurve.pitting(1.5e9),
        "tooth_damage.bending": exugear.SNCurve.bending(8.6e8), "cycles_at.stress": [1e9], "limit": 1e9,
        "pitting.material": "nitrided", "bending.material": "nitrided", "long_life": 0.9, "pitting_permitted": False,
        "DataSheet.rows": [quantity], "envelope.windows": 10, "BuiltPlan.cost.step": 1e-6, "shaft_graphics.d": 0.1,
    }  # fmt: skip
    return plain | special | of_signals(folder)


def of_studies(folder: Path) -> dict[str, Any]:
    """Arguments of sweeps, tolerances and optimal flanks, and of their plots."""
    tolerances = {name: scipy.stats.norm(0.0, 1.0) for name in "ab"}
    data = exugear.monte_carlo(lambda a, b: a + b, tolerances, number=20, progress=False)
    lines = {"x": ("x", [0.0, 1.0], {"unit": ""})}
    landscape = xr.DataArray([1.0, 2.0], lines, "x", attrs={"optimum_x": 0.0})
    front = xr.Dataset({"low": ("case", [1.0, 2.0]), "high": ("case", [2.0, 1.0])})
    return {
        "sweep.function": lambda a: a, "sweep.cases": [{"a": 1.0}], "sweep.store": folder / "sweep", "seed": None,
        "monte_carlo.store": folder / "monte_carlo", "sobol_indices.store": folder / "sobol",
        "monte_carlo.function": lambda a, b: a + b, "sobol_indices.function": lambda a, b: a + b,
        "monte_carlo.seed": 0, "sobol_indices.seed": 0, "optimize_flanks.seed": 0, "sobol_indices.number": 8,
        "tolerances": tolerances, "rank_correlation.data": data, "SweepStopped.data": data,
        "flanks": lambda C_a: paper_pair(), "variables": {"C_a": exugear.Variable(0, 10 * um)},
        "goals": exugear.Goal("peak_to_peak", 100.0), "combine": "sum", "draws": 2, "percentile": 90.0,
        "landscape.first": "C_a", "landscape.second": None, "landscape.points": 3, "pareto_front.first": 0,
        "pareto_front.second": 1, "pareto_front.points": 2, "method": "COBYQA", "starts": 1,
        "optimize_flanks.tolerances": None, "optimize_flanks.gearbox": None,
        "flank_measures.torque": 100.0, "measures": ("peak_to_peak",), "flank_measures.harmonics": 2,
        "root_density": fem.Density(), "bearing_forces": False,
        "vibration_measures.gearbox": lambda ste: None, "share": 0.5, "plot_flank.gear": "pinion",
        "plot_flank.direction": "profile", "plot_landscape.data": landscape,
        "plot_pareto_front.data": front.assign_attrs(first="low", second="high"),
    }  # fmt: skip


def of_sets() -> dict[str, Any]:
    """Arguments of functions of planetary sets, and of their plots."""
    phases, turn, of_set = planetary().mesh_phases(), np.linspace(0.0, 40.0, 2001), planetary()
    heard = exugear.recorded_signal(turn, np.ones(turn.size), np.cos(90 * turn))
    numbers = {"harmonics": 1, "carrier_orders": 1, "members": [], "mesh": "ring", "revolutions": None}
    lines = exugear.side_bands(heard, of_set, harmonics=1, carrier_orders=1)
    return {f"side_bands.{name}": value for name, value in numbers.items()} | {
        "side_bands.signal": heard, "side_bands.planetary": of_set, "force_seen_from_ring.run": run_of_a_set(),
        "ring": "ring", "reach": 1.0, "member_orbit.run": run_on_bearings(), "member_orbit.member": "fast",
        "frame": "slow", "quantity": "force", "plot_mesh_phases.phases": phases, "plot_phase_sums.phases": phases,
        "shares": exugear.planet_shares(run_of_a_set()), "plot_side_bands.lines": lines,
    }  # fmt: skip


def of_signals(folder: Path) -> dict[str, Any]:
    """Arguments of functions of signals, and of their plots."""
    time = np.linspace(0, 1, 2001)
    order_3 = np.cos(3 * 2 * np.pi * (10 * time + 5 * time**2))
    signal = exugear.recorded_signal(time, 2 * np.pi * (10 + 10 * time), order_3, units="N")
    functions = ("over_angle", "order_tracking", "order_cut", "spectrogram", "waterfall", "write_sound")
    signals = {f"{name}.signal": signal for name in functions}
    cuts, spectra = exugear.order_cut(signal, [3, 5]), exugear.waterfall(signal, lines=5, resolution=20.0)
    averages = exugear.synchronous_average(signal, highest_order=20.0, turns=2)
    average, band = averages.isel(average=0), {"highest_order": 5.0, "band": [100.0, 200.0]}
    return signals | {f"envelope_spectrum.{name}": value for name, value in band.items()} | {
        "synchronous_average.signal": signal, "synchronous_average.highest_order": 20.0, "shaft_order": 1.0,
        "turns": 2, "average": average, "mesh_orders": [3], "residual_signal.side_bands": 1, "shaft_orders": 1,
        "baseline": averages, "condition_indicators.side_bands": 1, "demodulate.signal": signal,
        "demodulate.band": [100.0, 200.0], "envelope_spectrum.signal": signal, "names": ("FM4",),
        "plot_envelope_spectrum.lines": exugear.envelope_spectrum(signal, **band),
        "plot_envelope_spectrum.orders": None, "indicators": exugear.condition_indicators(averages, [3], side_bands=1),
        "signal.name": "dte", "recorded_signal.speed": TURNS, "values": LINE, "units": "N", "long_name": "force",
        "stored": np.outer(LINE, [0.04, 1.0]), "component": 0, "order_cut.orders": [3.0, 5.0], "side_bands": 1,
        "mesh_orders.harmonics": 2, "resonances.harmonics": 3, "spectrogram.resolution": 20.0,
        "waterfall.resolution": 20.0, "window": "hann", "lines": 5, "rms": [1.0, 2.0], "reference": 1e-6,
        "channels": cuts["amplitude"], "over": ["order"], "write_sound.path": folder / "sound.wav", "rate": 8000,
        "full_scale": 2.0, "order_map": exugear.order_tracking(signal, highest_order=5.0), "cuts": cuts,
        "spectra": spectra, "levels": exugear.level(cuts["amplitude"]), "plot_waterfall.height": 5.0,
        "plot_waterfall.top": 500.0, "plot_spectrogram.top": 500.0,
        "plot_order_cuts.ax": Figure().add_subplot(), "frequencies": [400.0],
    }  # fmt: skip


def valid(path: str, name: str) -> Any:
    """A valid value of an argument of a function, method or class."""
    parts, table = path.split("."), by_name()
    for start in range(1, len(parts)):
        special = ".".join([*parts[start:], name])
        if special in table:
            return table[special]
    instance = instances().get(parts[-1])
    return getattr(instance, name, None) if instance is not None else table[name]
