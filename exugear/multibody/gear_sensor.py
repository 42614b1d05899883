"""A sensor of Exudyn for a gear contact."""

from collections.abc import Callable
from itertools import chain
from typing import Any

import exudyn as exu
import exudyn.itemInterface as eii
import numpy as np
from exudyn.misc.extensionRegistry import extends, install

from exugear.multibody.exudyn_objects import INITIAL
from exugear.multibody.gear_contact import FUNCTION, ContactCopy, StoredContact, stored_contact
from exugear.multibody.recorder import NAMES
from exugear.multibody.user_function_errors import errors_kept, stopped
from fem.support.arguments import checked

#: Gap between teeth that just touch [m].
TOUCHING = 1e-9


@checked
def CreateGearSensor(
    mbs: exu.MainSystem, contact: int, name: str = "", fileName: str = "", storeInternal: bool = False
) -> int:
    """Create a sensor of a gear contact; also called as mbs.CreateGearSensor(...).

    contact         number that CreateGearContact returned
    fileName        file to which the values are written
    storeInternal   keep the values in memory, for mbs.GetSensorStoredData

    Its values and their signs are those of `Recorder`: deflection (DTE) [m], mesh force [N], centre distance [m],
    misalignment [rad], axial offset [m], force centroid [m], torques on pinion and wheel [N m], phase [pitches]. To
    sample every step, a `Recorder` costs less. Returns the number of the sensor. Raises ValueError for an object that
    is no gear contact.
    """
    function = errors_kept(mbs, user_function(stored_contact(mbs, contact), int(contact)))
    item = eii.SensorUserFunction(
        name=name, fileName=fileName, storeInternal=storeInternal, sensorUserFunction=function
    )
    return mbs.AddSensor(item)


def user_function(contact: StoredContact, number: int) -> Callable:
    """The function that Exudyn calls: it evaluates a copy of a contact, which is the object with this number."""
    copy = ContactCopy(contact.kernel, contact.records, contact.kinds)

    def gear_sensor(mbs, t, sensors, factors, configuration):
        nodes = object_of(mbs, contact, number)["nodeNumbers"]
        kinds = exu.OutputVariableType.Coordinates, exu.OutputVariableType.Coordinates_t
        q, q_t = (
            np.concatenate([np.atleast_1d(mbs.GetNodeOutput(n, kind, configuration)) for n in nodes]) for kind in kinds
        )
        copy.update()
        try:
            copy.forces(t, *q.tolist(), *q_t.tolist())
        except ValueError as error:
            raise stopped(*contact.records[:2], error) from None
        return [float(copy.recorder.samples[name][0]) for name in NAMES]

    return gear_sensor


def teeth_touch(mbs, contact: StoredContact, number: int) -> bool:
    """Whether the teeth of a contact, by the number of its object, touch in the initial state of its system."""
    deflection, force, *_ = user_function(contact, number)(mbs, 0.0, [], [], INITIAL)
    return force != 0 or deflection > -TOUCHING


def object_of(mbs, contact: StoredContact, number: int) -> dict[str, Any]:
    """Exudyn's object of a contact, whose number was this until objects were deleted."""
    end = mbs.systemData.NumberOfObjects()
    for item in map(mbs.GetObject, chain([number] if number < end else [], range(end))):
        if item.get(FUNCTION) == contact.function:
            return item
    raise RuntimeError("the gear contact of a sensor was deleted; delete the sensor, too")


extends(exu.MainSystem, "CreateGearSensor")(CreateGearSensor)
install()
