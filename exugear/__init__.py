"""Gear dynamics on Exudyn: from the STE map to the run-up."""

import lazy_loader

from exugear.gearbox.bearing import Bearing
from exugear.gearbox.drag import BearingDrag, Drag, SkfDrag
from exugear.gearbox.gearbox import Gearbox, exact_ratios
from exugear.gearbox.housing import Housing
from exugear.gearbox.inner_planets import InnerPlanets
from exugear.gearbox.planetary import Planetary
from exugear.gearbox.planetary_phases import planetary_phases
from exugear.gearbox.rolling_bearing import RollingBearing
from exugear.gearbox.shaft import Coupling, Disc, Placement, Shaft, TorqueSupport
from exugear.gearbox.shaft_loads import ExternalForce, Unbalance
from exugear.gearbox.stage import Stage
from exugear.load_factors.bearing_life import bearing_life
from exugear.load_factors.dynamic_factor import dynamic_factor
from exugear.load_factors.dynamic_stress import dynamic_stress, stress_envelope
from exugear.load_factors.planet_shares import planet_shares
from exugear.load_factors.tooth_damage import SNCurve, tooth_damage
from exugear.mesh_force.force import MeshForce
from exugear.mesh_force.friction_coefficient import NiemannFriction, SchlenkFriction, XuFriction
from exugear.mesh_force.mesh_friction import MeshFriction
from exugear.mesh_force.ring_pair import RingPair
from exugear.modal.campbell import campbell
from exugear.modal.modes import eigenfrequencies, modes
from exugear.multibody.assembly import build
from exugear.multibody.gear_contact import CreateGearContact
from exugear.multibody.gear_friction import CreateGearFriction
from exugear.multibody.gear_sensor import CreateGearSensor
from exugear.multibody.model import Model
from exugear.multibody.recorder import Recorder
from exugear.multibody.solver_settings import integrator
from exugear.operation.load_spectrum import LoadCase, LoadSpectrum
from exugear.operation.shaft_ends import MotorCurve, Speed, Torque
from exugear.operation.stop_conditions import Apart, SpeedReached
from exugear.planning.built_plan import BuiltPlan
from exugear.planning.integrator_and_step import Rule
from exugear.planning.plan import Plan, plan
from exugear.reporting.viewer import draw, picture
from exugear.running.efficiency import efficiency
from exugear.running.energy_balance import EnergyBalance
from exugear.running.run import Run, RunStopped, run, run_up
from exugear.signals import spectrum
from exugear.signals.angle_sampling import over_angle
from exugear.signals.condition_indicators import condition_indicators
from exugear.signals.envelope import dte_envelope, envelope, peaks
from exugear.signals.envelope_spectrum import demodulate, envelope_spectrum
from exugear.signals.fault_orders import fault_orders
from exugear.signals.levels import level, rms_sum
from exugear.signals.member_orbit import member_orbit
from exugear.signals.order_cut import order_cut
from exugear.signals.radiated_power import radiated_power
from exugear.signals.resonances import resonances
from exugear.signals.ring_sensor import RingSensor
from exugear.signals.short_time_spectra import order_tracking, spectrogram, waterfall
from exugear.signals.side_bands import force_seen_from_ring, side_bands
from exugear.signals.signal import mesh_orders, recorded_signal, sensor_signal, signal
from exugear.signals.sound import write_sound
from exugear.signals.synchronous_average import residual_signal, synchronous_average
from exugear.steady_state.steady_states import steady_states
from fem.support.version import __version__

#: Modules and functions for pictures and for contacts by finite elements, imported on first use; functions of earlier
#: versions, which are deprecated.
__getattr__, _, _ = lazy_loader.attach(
    __name__,
    ["plots"],
    {
        "exchange.rexs": ["read_rexs"],
        "exchange.rexs_writing": ["write_rexs"],
        "load_factors.flank_corrections": ["FlankCorrections", "propose_flank_corrections"],
        "load_factors.load_distribution": ["DeflectedPair", "deflected_pair", "load_distribution"],
        "reporting": ["graphics"],
        "reporting.animation": ["animate_gearbox", "animate_mode", "animate_pair"],
        "reporting.report": ["report"],
        "signals.resonances": ["resonance_table"],
        "signals.short_time_spectra": ["order_spectrum"],
        "study.flank_search": ["Variable"],
        "study.goals": ["Goal"],
        "study.optimal_flanks": ["OptimalFlanks", "optimize_flanks"],
        "study.sweep": ["SweepStopped", "sweep"],
        "study.tolerances": ["monte_carlo", "rank_correlation", "sobol_indices"],
        "study.vibration": ["vibration_measures"],
    },
)

__all__ = [
    "Apart",
    "Bearing",
    "BearingDrag",
    "BuiltPlan",
    "Coupling",
    "CreateGearContact",
    "CreateGearFriction",
    "CreateGearSensor",
    "DeflectedPair",
    "Disc",
    "Drag",
    "EnergyBalance",
    "ExternalForce",
    "FlankCorrections",
    "Gearbox",
    "Goal",
    "Housing",
    "InnerPlanets",
    "LoadCase",
    "LoadSpectrum",
    "MeshForce",
    "MeshFriction",
    "Model",
    "MotorCurve",
    "NiemannFriction",
    "OptimalFlanks",
    "Placement",
    "Plan",
    "Planetary",
    "Recorder",
    "RingPair",
    "RingSensor",
    "RollingBearing",
    "Rule",
    "Run",
    "RunStopped",
    "SNCurve",
    "SchlenkFriction",
    "Shaft",
    "SkfDrag",
    "Speed",
    "SpeedReached",
    "Stage",
    "SweepStopped",
    "Torque",
    "TorqueSupport",
    "Unbalance",
    "Variable",
    "XuFriction",
    "__version__",
    "animate_gearbox",
    "animate_mode",
    "animate_pair",
    "bearing_life",
    "build",
    "campbell",
    "condition_indicators",
    "deflected_pair",
    "demodulate",
    "draw",
    "dte_envelope",
    "dynamic_factor",
    "dynamic_stress",
    "efficiency",
    "eigenfrequencies",
    "envelope",
    "envelope_spectrum",
    "exact_ratios",
    "fault_orders",
    "force_seen_from_ring",
    "graphics",
    "integrator",
    "level",
    "load_distribution",
    "member_orbit",
    "mesh_orders",
    "modes",
    "monte_carlo",
    "optimize_flanks",
    "order_cut",
    "order_tracking",
    "over_angle",
    "peaks",
    "picture",
    "plan",
    "planet_shares",
    "planetary_phases",
    "plots",
    "propose_flank_corrections",
    "radiated_power",
    "rank_correlation",
    "read_rexs",
    "recorded_signal",
    "report",
    "residual_signal",
    "resonances",
    "rms_sum",
    "run",
    "run_up",
    "sensor_signal",
    "side_bands",
    "signal",
    "sobol_indices",
    "spectrogram",
    "spectrum",
    "steady_states",
    "stress_envelope",
    "sweep",
    "synchronous_average",
    "tooth_damage",
    "vibration_measures",
    "waterfall",
    "write_rexs",
    "write_sound",
]


def __dir__() -> list[str]:
    return __all__
