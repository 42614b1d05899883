"""Gear dynamics on Exudyn: from the STE map to the run-up."""

from exugear import graphics, plots
from exugear.connector import CreateGearContact, Recorder
from exugear.force import MeshForce
from exugear.gearbox import Bearing, Gearbox, Shaft, Stage
from exugear.integrator import integrator
from exugear.model import Model, build
from exugear.plan import Plan, plan
from exugear.run import Run, run_up
from exugear.spectrum import envelope, order_spectrum, resonances

__all__ = [
    "Bearing",
    "CreateGearContact",
    "Gearbox",
    "MeshForce",
    "Model",
    "Plan",
    "Recorder",
    "Run",
    "Shaft",
    "Stage",
    "build",
    "envelope",
    "graphics",
    "integrator",
    "order_spectrum",
    "plan",
    "plots",
    "resonances",
    "run_up",
]
