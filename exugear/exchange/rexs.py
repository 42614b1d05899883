"""Gearboxes from REXS files, which KISSsoft, the FVA-Workbench, Bearinx and others write."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from inspect import signature
from math import copysign

import numpy as np
import xarray as xr

from exugear.exchange.rexs_bearings import Options
from exugear.exchange.rexs_file import read_file
from exugear.exchange.rexs_loads import RawCase, all_torques, load_case, raw_cases, torque_balance
from exugear.exchange.rexs_reading import Account, Reading
from exugear.exchange.rexs_train import Mesh, Set, Train
from exugear.gearbox.constant_loads import IDLE, mesh_forces
from exugear.gearbox.gearbox import Gearbox
from exugear.operation.load_spectrum import LoadCase, LoadSpectrum
from fem.pair import iso6336
from fem.pair.offsets import Offsets
from fem.pair.pair import GearPair
from fem.ste.ste_map import ste_map
from fem.ste.transmission import static_transmission_error
from fem.support.arguments import FilePath, Finite, checked
from fem.support.validation import require, require_within

#: Torque on the driving shaft [N m] where a file holds none.
ASSUMED_TORQUE = 100.0
#: Torques of a map over the largest one of the load cases.
LOAD_SHARES = 0.0, 0.1, 0.3, 0.6, 1.0, 1.5
MAP_PHASES = 20
#: Axial offset from which on a map counts it [m].
LEAST_AXIAL = 1e-6


@dataclass(frozen=True, eq=False)
class RexsModel:
    """A gearbox and its load cases from a file: `gearbox, load_cases = exugear.read_rexs(path)`.

    gearbox      `exugear.Gearbox`; None where the file holds no cylindrical gears, but bevel or worm stages alone
    load_cases   list of load cases, whose `speed` and `load` a run takes
    account      what was read, what was assumed, and what was left out; `print(model)` shows it
    version, application   of the file
    """

    gearbox: Gearbox | None
    load_cases: list[LoadCase]
    account: Account = field(repr=False)
    version: str = ""
    application: str = ""

    @property
    def spectrum(self) -> LoadSpectrum:
        """The load cases as a duty cycle, for `bearing_life` and damage sums; ValueError without load cases."""
        return LoadSpectrum(self.load_cases)

    def __iter__(self) -> Iterator:
        return iter((self.gearbox, self.load_cases))

    def __str__(self) -> str:
        box = repr(self.gearbox) if self.gearbox else "no gearbox: the file holds no cylindrical gears"
        cases = [str(case) for case in self.load_cases]
        return "\n".join([f"REXS {self.version} of {self.application}", box, *cases, str(self.account)])


@checked
def read_rexs(
    path: FilePath,
    *,
    mesh: str | Callable = "fem",
    shafts: str = "elastic",
    bearings: str = "rolling",
    load_case: int = 1,
    damping_ratio: float = 0.06,
    step_angle: Finite = 0.0,
    progress: bool = True,
) -> RexsModel:
    """The gearbox of a REXS file, version 1.0 to 2.0: XML, JSON, or a zip archive with either.

    mesh            force law of the meshes: "fem", maps by finite elements up to 1.5 times the largest torque of the
                    load cases; "iso6336", the constant stiffness of ISO 6336-1, method B, which excites nothing but is
                    there at once; or a function of a `fem.GearPair` and that torque [N m] which returns an STE map;
                    if it takes `offsets`, it gets the `fem.Offsets` of a wheel that stands axially off its pinion
    shafts          "elastic": shafts with sections get them, and `exugear.plan` keeps rigid what may be rigid; "rigid"
    bearings        "rolling": rolling bearings whose file holds inner geometry, or dimensions and capacities, have
                    their force law; "linear": their stiffness under a tenth of their capacity, at less cost of a run
    load_case       number of the load case, from 1 on, whose external forces act on the shafts
    damping_ratio   of every mesh, which files do not hold
    step_angle      of stepped planets, as of a `Planetary` [rad], which files do not hold
    progress        whether to show bars with the time left

    The axes u, v, w of the file become z, x, y. Cylindrical stages between parallel shafts and planetary stages, also
    with stepped planets, are read, with gears, tools, materials, sections, bearings, external forces, gravity and load
    cases. The account of the result tells all that was assumed or left out: bevel and worm stages, housings,
    lubricants, tolerances.

    Raises FileNotFoundError, and ValueError with line and remedy for a file that is broken, of another version, or
    whose values have other units; and what gears and pairs refuse.
    """
    require_within("damping_ratio", damping_ratio, 0, 1, remedy="(6 % of the critical damping: 0.06)")
    kinds = f'mesh must be "fem", "iso6336" or a function of pair and torque, got {mesh!r}'
    require(callable(mesh) or mesh in ("fem", "iso6336"), kinds)
    for name, value, choice in (
        ("shafts", shafts, ("elastic", "rigid")),
        ("bearings", bearings, ("rolling", "linear")),
    ):
        require(value in choice, f"{name} must be one of {[*choice]}, got {value!r}")
    reading = Reading(read_file(path))
    train = Train(reading, Options(bearings == "rolling", shafts == "elastic", step_angle))
    gearbox: Gearbox | None = None
    cases: list[LoadCase] = []
    if train.members:
        gearbox, cases = _gearbox(reading, train, mesh, damping_ratio, load_case, progress=progress)
        reading.account.assumed("meshes", f"damping ratio {damping_ratio:g}")
    reading.close()
    return RexsModel(gearbox, cases, reading.account, reading.file.version, reading.file.application)


def _gearbox(
    reading: Reading, train: Train, mesh: str | Callable, damping_ratio: float, acting: int, *, progress: bool
) -> tuple[Gearbox, list[LoadCase]]:
    """The gearbox, whose maps reach as far as the mesh forces of the load cases need.

    acting   number of the load case whose external forces act on the shafts
    """
    raw = raw_cases(reading, train.layouts)
    require(1 <= acting <= len(raw), f"load_case must lie in [1, {len(raw)}], the load cases of the file, got {acting}")
    train.begin(raw[acting - 1].forces)
    if any(case.forces != raw[acting - 1].forces for case in raw):
        reading.account.assumed("external forces", f"those of load case {acting} act; read the file again for others")
    first = train.first_shaft
    members = train.in_order(first)
    ends = _ends(train, members, first, raw)
    trial = _with_constant_laws(train, members, damping_ratio, ends)
    driving, driven = ends["driving"], ends["driven"]
    powers = [torque_balance(case, trial.ratios, driving, driven) * case.speeds.get(first, 1.0) for case in raw]
    if sum(powers) < 0:
        ends = {"driving": ends["driven"], "driven": ends["driving"]}
        members = train.in_order(ends["driving"])
        trial = _with_constant_laws(train, members, damping_ratio, ends)
    cases = [load_case(case, trial.ratios, ends["driving"], ends["driven"]) for case in raw]
    forces = _largest_forces(reading, trial, raw, cases)
    train.note(members)
    laws, sequence = [], iter(zip(trial.stages, forces, strict=True))
    for member in members:
        pairs = train.pairs(member)
        stages = [next(sequence) for _ in range(2 * len(member.planets) if isinstance(member, Set) else 1)]
        for (pair, offset), (stage, force) in zip(pairs, stages, strict=False):
            axial = copysign(1.0, trial.ratios.get(stage.fast.name) or 1.0) * offset
            laws.append(_mesh_of(mesh, pair, force * pair.pinion.r_b, axial, progress=progress))
    return train.gearbox(members, laws, damping_ratio, **ends), cases


def _ends(train: Train, members: list[Mesh | Set], first: str, raw: list[RawCase]) -> dict[str, str]:
    """Driving shaft, and as driven shaft that whose load takes the rest, else another load, else the end of the train.

    The rest is left to a shaft with a load whose torque no load case holds.
    """
    names = [name for member in members for name in member.shafts]
    free = [name for name in names if name != first and name not in train.held]
    loaded = [name for name in train.loaded_shafts() if name in free]
    known = {name for case in raw for name in (*case.torques, *case.powers)}
    of_rest = [name for name in loaded if name not in known]
    ends = [name for name in reversed(free) if names.count(name) == 1]
    return {"driving": first, "driven": next(iter([*of_rest, *loaded, *ends]), free[-1])}


def _with_constant_laws(train: Train, members: list[Mesh | Set], damping_ratio: float, ends: dict[str, str]) -> Gearbox:
    """The gearbox with laws that are there at once, for its ratios and mesh forces."""
    pairs = [(pair, offset) for member in members for pair, offset in train.pairs(member)]
    laws: list[xr.Dataset] = [_constant_map(pair, 100.0, 0.0) for pair, _ in pairs]
    return train.gearbox(members, laws, damping_ratio, **ends)


def _largest_forces(reading: Reading, gearbox: Gearbox, raw: list[RawCase], cases: list[LoadCase]) -> list[float]:
    """Mesh force [N] of each stage that is the largest over the load cases, with the torques on all shafts."""
    loads = [_loads(gearbox, *each) for each in zip(raw, cases, strict=True)]
    if not any(any(each.values()) for each in loads):
        reading.account.assumed("meshes", f"{ASSUMED_TORQUE:g} N m on the driving shaft, as the file holds no torque")
        loads = [{gearbox.driven.name: ASSUMED_TORQUE / abs(gearbox.ratios[gearbox.driven.name])}]
    driven = gearbox.driven.name
    further = sorted({name for each in loads for name, torque in each.items() if torque and name != driven})
    if further:
        words = f"load is the torque on {driven!r} alone; runs take those on {further}, too, by loads={{shaft: torque}}"
        reading.account.assumed("load cases", words)
    forces = np.abs([mesh_forces(gearbox, each) for each in loads]).max(axis=0)
    for number, stage in enumerate(gearbox.stages):
        if forces[number] <= IDLE * forces.max():
            words = f"{ASSUMED_TORQUE:g} N m on its pinion, as no load case loads it"
            reading.account.assumed(stage.name, words)
            forces[number] = ASSUMED_TORQUE / stage.pair.pinion.r_b
    return forces.tolist()


def _loads(gearbox: Gearbox, raw: RawCase, case: LoadCase) -> dict[str, float]:
    """Torques of a load case against the motion of the shafts [N m]; the driving shaft takes the rest."""
    driving, driven = gearbox.driving.name, gearbox.driven.name
    torques = all_torques(raw, gearbox.ratios, case.speed)
    further = [name for name in torques if name in gearbox.ratios and name not in (driving, driven, *gearbox.held)]
    return {driven: case.load} | {name: -gearbox.directions[name] * torques[name] for name in further}


def _mesh_of(mesh: str | Callable, pair: GearPair, torque: float, axial: float, *, progress: bool) -> xr.Dataset:
    """Map of a pair up to 1.5 times its torque [N m], whose wheel stands an axial offset [m] from its pinion.

    axial   > 0 along the z axis of the map, about which the mesh force turns the pinion clockwise
    """
    axial = axial if abs(axial) > LEAST_AXIAL else 0.0
    if callable(mesh):
        ste = mesh(pair, torque, **{"offsets": Offsets(axial=axial)} if axial and _takes_offsets(mesh) else {})
        expected = f"mesh must return the map that fem.static_transmission_error returns, got {type(ste).__name__}"
        require(isinstance(ste, xr.Dataset), expected)
        return ste
    if mesh == "iso6336":
        return _constant_map(pair, torque, axial)
    torques, offsets = torque * np.array(LOAD_SHARES), Offsets(axial=axial) if axial else None
    return static_transmission_error(pair, torques, MAP_PHASES, offsets=offsets, progress=progress)


def _takes_offsets(mesh: Callable) -> bool:
    """Whether a function of pair and torque takes the offsets between the gears, too."""
    return "offsets" in signature(mesh).parameters


def _constant_map(pair: GearPair, torque: float, axial: float) -> xr.Dataset:
    """Map of the mean mesh stiffness of ISO 6336-1, method B: its transmission error is the same at all phases."""
    torques = torque * np.array(LOAD_SHARES)
    stiffness = iso6336.mesh_stiffness(pair) * pair.b
    te = np.repeat((torques / (pair.pinion.r_b * stiffness))[:, None], 4, axis=1)
    ste = ste_map(pair, torques, np.arange(4) / 4, te)
    return ste.assign_attrs(axial=axial) if axial else ste
