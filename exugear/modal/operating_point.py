"""The state about which a gearbox is linearized: static equilibrium under its load."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from exugear.gearbox.constant_loads import mesh_forces
from exugear.multibody.drive_and_load import applied, restored
from exugear.multibody.equilibrium import solve_initial_equilibrium
from exugear.multibody.exudyn_objects import assemble_in_state, quiet
from exugear.multibody.model import Model, linearized
from exugear.operation.conditions import conditions_at_rest
from exugear.planning.mirrored_flanks import remedy_of, warn_of_mirrored


@contextmanager
def in_loaded_equilibrium(model: Model, loads: Mapping[str, float], drive: str = "held") -> Iterator[Model]:
    """Put a gearbox at rest into equilibrium under loads; its state is restored afterwards.

    loads   constant torques [N m] by the names of shafts, as `exugear.gearbox.constant_loads.given_loads`
    drive   "held": the driving shafts, or the rotors behind their couplings, are fixed; "free": once in equilibrium
            they may turn

    Yields the model with the rows of its present system. Raises ValueError for loads beyond the maps.
    """
    conditions = conditions_at_rest(model.gearbox, loads)
    with quiet(), restored(model):
        model = linearized(model, model.gearbox.independent)
        with applied(model, conditions):
            solve_initial_equilibrium(model, conditions)
            forces = mesh_forces(model.gearbox, loads)
            warn_of_mirrored(model.plan.mirrored, model.gearbox.labels, forces, remedy=remedy_of(model.plan))
            if drive == "free":
                for i in range(len(model.drive_items.ends)):
                    model.drive_items.set_constraint(i, {"activeConnector": False})
                assemble_in_state(model.bare_mbs)
            with model.drive_items.holding():
                yield model
