"""Gear dynamics on Exudyn: from the STE map to the run-up."""

import lazy_loader

from exugear.bearing import Bearing
from exugear.connector import CreateGearContact
from exugear.eigenfrequencies import eigenfrequencies
from exugear.force import MeshForce
from exugear.friction import MeshFriction
from exugear.friction_connector import CreateGearFriction
from exugear.gearbox import Gearbox
from exugear.integrator import integrator
from exugear.model import Model, build
from exugear.plan import Plan, plan
from exugear.recorded import dte_envelope
from exugear.recorder import Recorder
from exugear.ring import RingPair
from exugear.run import Run, RunStopped, run_up
from exugear.sensor import CreateGearSensor
from exugear.shaft import Coupling, Disc, Placement, Shaft
from exugear.spectrum import envelope, order_spectrum, resonances
from exugear.stage import Stage
from exugear.viewer import draw
from fem.version import __version__

#: Modules that only pictures need, imported when they are first asked for.
__getattr__, _, _ = lazy_loader.attach(__name__, ["graphics", "plots"])

__all__ = [
    "Bearing",
    "Coupling",
    "CreateGearContact",
    "CreateGearFriction",
    "CreateGearSensor",
    "Disc",
    "Gearbox",
    "MeshForce",
    "MeshFriction",
    "Model",
    "Placement",
    "Plan",
    "Recorder",
    "RingPair",
    "Run",
    "RunStopped",
    "Shaft",
    "Stage",
    "__version__",
    "build",
    "draw",
    "dte_envelope",
    "eigenfrequencies",
    "envelope",
    "graphics",
    "integrator",
    "order_spectrum",
    "plan",
    "plots",
    "resonances",
    "run_up",
    "spectrum",
]


def __dir__() -> list[str]:
    return __all__
