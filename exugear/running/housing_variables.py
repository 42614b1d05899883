"""The motion of a housing that has coordinates of its own, in the data of a run."""

from typing import Any

import numpy as np

from exugear.gearbox.housing import PER_SEAT, seat_label
from exugear.multibody.model import Model

#: Names of the coordinates of a seat.
OF_SEAT = "x", "y", "z", "rotation_x", "rotation_y", "rotation_z"
RATE = "housing_rate"


def housing_variables(model: Model, number: int) -> dict[str, Any]:
    """Displacements of the seats and rates of all coordinates of the housing, of so many samples; else none.

    The rates are those of the coordinates of `Housing.stiffness`: of the seats, then of the modes behind them.
    """
    if model.seats is None or model.seats.housing is None:
        return {}
    elastic, (motion, rates) = model.seats.housing, model.seats.motion(number)
    labels = [seat_label(seat) for seat in elastic.housing.seats]
    moved = (motion @ elastic.at_seats.T).reshape(number, len(labels), PER_SEAT)[..., :3]
    names = OF_SEAT if elastic.housing.over_six.all() else OF_SEAT[:3]
    coordinates = [f"{label} {name}" for label in labels for name in names]
    coordinates += [f"mode {i}" for i in range(1, elastic.housing.modes + 1)]
    about = {"units": "m/s, rad/s", "long_name": "rate of the coordinate of the housing; modes m/s kg^0.5"}
    displaced = {"units": "m", "long_name": "displacement of the housing at its seat"}
    return {
        RATE: (("housing_coordinate", "time"), (rates @ elastic.shapes.T).T.astype(np.float32), about),
        "seat_displacement": (("seat", "direction", "time"), moved.transpose(1, 2, 0), displaced),
        "housing_coordinate": ("housing_coordinate", coordinates),
        "seat": ("seat", labels),
    }
