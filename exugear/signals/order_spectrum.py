"""Amplitudes of arrays over the orders of a shaft, as arrays."""

from typing import NamedTuple

import numpy as np

from exugear.signals.columns import check_columns
from exugear.signals.order_tracking import order_tracking
from exugear.signals.signal import recorded_signal
from fem.support.arguments import Numbers, checked


@checked
class OrderSpectrum(NamedTuple):
    """Amplitudes (n_line, n_order) of the orders (n_order,) of shaft rotation at the speeds (n_line,) [rad/s]."""

    speed: np.ndarray
    order: np.ndarray
    amplitude: np.ndarray


@checked
def order_spectrum(
    time: Numbers, speed: Numbers, signal: Numbers, *, orders: float, revolutions: int = 8, overlap: float = 0.75
) -> OrderSpectrum:
    """Amplitudes of a signal over the orders of a shaft: `order_tracking` of arrays.

    time            (n,) [s]
    speed           (n,) of the shaft [rad/s]
    signal          (n,)
    orders          highest order wanted, for instance five times the number of teeth
    revolutions     length of a block, of which each spectrum is taken; its orders lie 1 / revolutions apart (Hann)
    overlap         of neighbouring blocks, as share of their length

    Blocks with fewer than 2.25 samples per period of the highest order are left out. With speed = 2 pi mesh_frequency
    the orders are mesh orders and the revolutions mesh cycles. Raises ValueError for signals shorter than a block, and
    where no block remains.
    """
    time, speed, signal = (np.asarray(x, float) for x in (time, speed, signal))
    check_columns(time=time, speed=speed, signal=signal)
    lines = order_tracking(
        recorded_signal(time, speed, signal), orders=orders, revolutions=revolutions, overlap=overlap
    )
    return OrderSpectrum(*(lines[name].values for name in ("speed", "order", "amplitude")))
