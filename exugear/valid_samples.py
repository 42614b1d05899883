"""Samples of a run that count: until it stopped, or until bearings let the teeth part."""

from bisect import bisect_left
from dataclasses import replace
from functools import partial

import numpy as np

from exugear.equilibrium import UNIT
from exugear.model import Model, on_bearings
from exugear.steps import Steps
from fem.units import mm


def keep_valid(model: Model, steps: Steps, stop: BaseException | None) -> BaseException | None:
    """Cut the samples from what stopped the run on, which may be that bearings yielded."""
    blocks = [mesh.recorder.samples for mesh in model.meshes]
    lost = np.isnan([samples[0][:, 0] for samples in blocks]).any(axis=0)
    if stop:
        lost |= steps.time >= model.mbs.systemData.GetTime()
    number = int(lost.argmax()) if lost.any() else lost.size
    apart, words = _out_of_mesh(model, number)
    number, stop = (apart, RuntimeError(f"at t = {steps.time[apart]:.6g} s: {words}")) if words else (number, stop)
    for samples in blocks:
        samples[:] = [block[:number] for block in samples]
    return stop


def _out_of_mesh(model: Model, number: int) -> tuple[int, str]:
    """The first of so many samples whose bearings yielded until the teeth no longer hand over, and words; or none."""
    for mesh in model.meshes:
        if on_bearings(model, mesh):
            pair, peaks = mesh.stage.pair, np.maximum.accumulate(mesh.recorder.a[:number])
            apart = bisect_left(peaks, True, key=partial(_is_apart, pair))
            if apart < number:
                far = f"bearings of {mesh.stage.name} yield to a centre distance of {peaks[apart] / mm:.6g} mm"
                return apart, f"{far}, where the pair cannot run; try less load or stiffer bearings {UNIT}"
    return number, ""


def _is_apart(pair, a: float) -> bool:
    """Whether a pair cannot be mounted at a centre distance [m] that is no smaller than its own."""
    try:
        replace(pair, a=max(float(a), pair.a))
    except ValueError:
        return True
    return False
