"""Damage of teeth by a load spectrum: pitting and bending, by the linear sum of Palmgren and Miner (ISO 6336-6)."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi
from typing import Annotated, Any

import numpy as np
import scipy
import xarray as xr

from exugear.load_factors.dynamic_stress import BOTH, GEAR, StressMap, stress_map
from fem.pair.pair import GearPair
from fem.ste.ste_map import deviating_teeth, pair_of, warn_of_missing_pitches
from fem.support.arguments import Numbers, checked, numbers
from fem.support.validation import require, require_finite

HOUR = 3600.0
#: Range of strengths of gears [Pa]: beyond it another unit is meant.
STRENGTHS = 1e6, 1e11
#: Life factors over numbers of load cycles, between which stress and cycles are straight lines of their logarithms; the
#: last factor, at 1e10 cycles, is an argument. Sources: Z_NT ISO 6336-2:2006 table 2, Y_NT ISO 6336-3:2006 table 1, as
#: public programs and documents repeat them: the numbers of Z_NT in gfsReboucas/Drivetrain (which in an early version
#: has 1.0 up to 1e9 cycles where no pitting is permitted, in its later one falls from 5e7 on, as here), Y_NT and Z_NT
#: read off the figures in ddjokic/python-gearbox, Z_N of the ABS rules 4-3-1A1/table 4 in the help of the FVA-Workbench
#: (6e5 cycles 1.4, nitrocarburized 5e8 cycles .9). The slopes are those of ISO 6336-6: `test_tooth_damage.py`.
END = 1e10
PITTING = {
    "through-hardened": ((1e5, 1.6), (5e7, 1.0)),
    "case-hardened": ((1e5, 1.6), (5e7, 1.0)),
    "induction-hardened": ((1e5, 1.6), (5e7, 1.0)),
    "nitrided": ((1e5, 1.3), (2e6, 1.0)),
    "nitrocarburized": ((1e5, 1.1), (2e6, 1.0)),
}
#: The same where some pitting is permitted.
SOME_PITTING = (6e5, 1.6), (1e7, 1.3), (1e9, 1.0)
PITTING_PERMITTED = "through-hardened", "case-hardened", "induction-hardened"
BENDING = {
    "through-hardened": ((1e4, 2.5), (3e6, 1.0)),
    "case-hardened": ((1e3, 2.5), (3e6, 1.0)),
    "induction-hardened": ((1e3, 2.5), (3e6, 1.0)),
    "nitrided": ((1e3, 1.6), (3e6, 1.0)),
    "nitrocarburized": ((1e3, 1.1), (3e6, 1.0)),
}
#: Share by which the ends of the range of the safety factor lie beyond those of the line.
ROUNDING = 1e-9
#: Failures, and the stress of the map that each reads.
STRESSES = {"pitting": "hertz_pressure", "bending": "root_stress"}


@checked
@dataclass(frozen=True, eq=False)
class SNCurve:
    """Permissible stress of a tooth over the number of load cycles (Woehler line).

    cycles   (n,) numbers of load cycles, rising
    stress   (n,) permissible stresses there [Pa], not rising; between them log stress is linear in log cycles

    Up to the first number the stress is the static strength: a larger one is borne by no cycle. Below the last stress
    life is infinite. Raises ValueError for points that do not fall.
    """

    cycles: Annotated[Any, numbers]
    stress: Annotated[Any, numbers]

    def __post_init__(self):
        cycles, stress = (np.atleast_1d(np.asarray(x, float)) for x in (self.cycles, self.stress))
        equal = cycles.ndim == 1 and cycles.shape == stress.shape and cycles.size > 1
        require(equal, f"cycles and stress must be (n,), n >= 2, got {cycles.shape} and {stress.shape}")
        require_finite("cycles", cycles, "pass 1e10 for an endless life")
        require_finite("stress", stress, "pass the permissible stress in Pa")
        require(bool((np.diff(cycles) > 0).all() and cycles[0] > 0), f"cycles must be > 0 and rise, got {cycles}")
        falls = bool((np.diff(stress) <= 0).all() and stress[-1] > 0)
        require(falls, f"stress must be > 0 and must not rise with the cycles, got {stress} Pa")
        pascal = f"stress must reach {STRENGTHS[0]:g} to {STRENGTHS[1]:g} Pa, got {stress[0]:g}; pass pascals: 860e6"
        require(STRENGTHS[0] <= stress[0] <= STRENGTHS[1], pascal)

    @classmethod
    @checked
    def pitting(
        cls,
        limit: float,
        material: str = "case-hardened",
        *,
        long_life: float = 0.85,
        pitting_permitted: bool = False,
    ) -> "SNCurve":
        """Line of contact pressure by the life factor Z_NT.

        limit       permissible pressure at the endurance limit [Pa]: sigma_Hlim Z_L Z_v Z_R Z_W Z_X
        material    "through-hardened", "case-hardened", "induction-hardened", "nitrided" or "nitrocarburized"
        long_life   Z_NT at 1e10 cycles, in [0.85, 1]: 1 for optimum lubrication, material and experience
        pitting_permitted
                    whether a certain degree of pitting is permissible: the line then falls up to 1e9 cycles

        Life factors: 1.6 up to 1e5 cycles, 1.0 at 5e7; with pitting 1.6 up to 6e5, 1.3 at 1e7, 1.0 at 1e9; nitrided 1.3
        up to 1e5, 1.0 at 2e6; nitrocarburized 1.1 up to 1e5, 1.0 at 2e6; from there straight to long_life at 1e10.

        Source: ISO 6336-2:2006, table 2; 1.0 up to 1e10 is its long life for optimum conditions.
        """
        points = _of_material(PITTING, material)
        if pitting_permitted:
            known = f"pitting_permitted has a line of its own for {[*PITTING_PERMITTED]}, got material={material!r}"
            require(material in PITTING_PERMITTED, known)
            points = SOME_PITTING
        return cls._by_factors(limit, points, long_life)

    @classmethod
    @checked
    def bending(cls, limit: float, material: str = "case-hardened", *, long_life: float = 0.85) -> "SNCurve":
        """Line of root stress by the life factor Y_NT.

        limit       permissible local stress at the endurance limit [Pa], sigma_Flim Y_ST Y_deltarelT Y_RrelT Y_X with
                    Y_ST = 2: finite elements give the stress in the notch, as sigma_F of the standard with Y_S
        material    as of `pitting`
        long_life   Y_NT at 1e10 cycles, in [0.85, 1]

        Life factors: 2.5 up to 1e4 cycles of through-hardened steel, 2.5 up to 1e3 of case- and induction-hardened, 1.6
        up to 1e3 of nitrided, 1.1 up to 1e3 of nitrocarburized; 1.0 at 3e6; from there straight to long_life at 1e10.

        Source: ISO 6336-3:2006, table 1.
        """
        return cls._by_factors(limit, _of_material(BENDING, material), long_life)

    @classmethod
    def _by_factors(cls, limit: float, points: Sequence[tuple[float, float]], long_life: float) -> "SNCurve":
        low, high = STRENGTHS
        require(low <= limit <= high, f"limit must lie in [{low:g}, {high:g}] Pa, got {limit:g}; pass pascals: 860e6")
        require(0.85 <= long_life <= 1, f"long_life must lie in [0.85, 1], got {long_life}")
        cycles, factors = zip(*points, (END, long_life), strict=True)
        return cls(np.array(cycles), limit * np.array(factors))

    @checked
    def cycles_at(self, stress: Numbers) -> np.ndarray:
        """Load cycles that the tooth bears at stresses (n,) >= 0 [Pa]: from 0 beyond static strength to infinity."""
        stress = np.atleast_1d(np.asarray(stress, float))
        require(bool((stress >= 0).all()), f"stress must be >= 0 Pa, got {stress.min(initial=0.0):g}")
        cycles, limits = np.asarray(self.cycles, float), np.asarray(self.stress, float)
        with np.errstate(divide="ignore"):
            logs = np.interp(-np.log(stress), -np.log(limits), np.log(cycles))
        # At a level part of the line np.interp may return any of its points: life is the longest of them.
        level = cycles[np.maximum(np.searchsorted(-limits, -stress, side="right") - 1, 0)]
        borne = np.where(np.isin(stress, limits), level, np.exp(logs))
        return np.where(stress > limits[0], 0.0, np.where(stress < limits[-1], np.inf, borne))


def _of_material(table: dict[str, tuple], material: str) -> tuple:
    require(material in table, f"material must be one of {[*table]}, got {material!r}")
    return table[material]


@checked
def tooth_damage(
    stresses: xr.Dataset,
    torque: Numbers,
    speed: Numbers,
    hours: Numbers,
    *,
    pitting: SNCurve | Sequence[SNCurve] | None = None,
    bending: SNCurve | Sequence[SNCurve] | None = None,
    load_factor: Numbers = 1.0,
    contacts: Sequence[int] = (1, 1),
) -> xr.Dataset:
    """Damage sums, safety and life of the teeth of a pair under a load spectrum.

    stresses      map of `fem.root_stress` of the pair, up to the largest torque of the spectrum times its load factor
    torque        (n_class,) torques on the pinion [N m], >= 0: those of the left flanks; the right ones have a spectrum
                  and a map of their own, that of `fem.mirror_image(pair)`
    speed         (n_class,) speeds of the pinion [rad/s]
    hours         (n_class,) [h]
    pitting       line of the contact pressure, of both gears or (pinion, wheel); by default pitting is left out
    bending       line of the root stress, likewise
    load_factor   (n_class,) on the torque, or one number: what the map does not have, K_A, K_v of
                  `exugear.dynamic_factor`, K_gamma; the division over face and tooth pairs is in the map
    contacts      of a tooth's flank per turn of pinion and wheel: (3, 1) for a sun with three planets

    A class counts with the largest stress of the mesh cycle. Returns a Dataset over gear (pinion, wheel), failure
    (pitting, bending) and class:

    stress        (gear, failure, class) [Pa]
    cycles        (gear, class) numbers of load cycles
    damage        (gear, failure) sum of cycles over those that the tooth bears; 1 is failure, infinite beyond static
                  strength
    class_damage  (gear, failure, class) its addends
    safety        (gear, failure) factor on all stresses at which the damage is 1 (ISO 6336-6)
    life          (gear, failure) hours of the spectrum until then, infinite without damage [h]

    Raises ValueError for torques beyond the map and for arrays that do not fit; warns where teeth differ and stresses
    do not reach over all their pitches. Source: ISO 6336-6:2019, clause 4.
    """
    lines = {name: curves for name, curves in (("pitting", pitting), ("bending", bending)) if curves is not None}
    require(bool(lines), "pitting or bending must be given: exugear.SNCurve.bending(860e6, 'case-hardened')")
    of_gears = {name: _of_both(name, curves) for name, curves in lines.items()}
    torque, speed, hours = (np.atleast_1d(np.asarray(x, float)) for x in (torque, speed, hours))
    factor = np.broadcast_to(np.asarray(load_factor, float), torque.shape) if np.ndim(load_factor) == 0 else load_factor
    factor = np.asarray(factor, float)
    _check_spectrum(torque=torque, speed=speed, hours=hours, load_factor=factor)
    require(len(contacts) == 2 and min(contacts) >= 1, f"contacts must be two numbers >= 1, got {[*contacts]}")
    pair = _pair(stresses)
    table = stress_map(stresses, pair.pinion.r_b)
    warn_of_missing_pitches(table.pitches, deviating_teeth(pair))
    force, largest = torque * factor / pair.pinion.r_b, float(table.force[-1])
    beyond = f"stresses end at {largest * pair.pinion.r_b:.4g} N m, the spectrum reaches"
    require(
        bool(force.max() <= largest * (1 + 1e-9)),
        f"{beyond} {force.max() * pair.pinion.r_b:.4g} N m, load factors included; map up to that torque",
    )
    turns = np.abs(speed) * hours * HOUR / (2 * pi)
    cycles = np.array([turns * contacts[0], turns * abs(pair.pinion.z / pair.wheel.z) * contacts[1]])
    stress = np.stack([_largest(table, STRESSES[name], force) for name in of_gears], axis=1)
    curves = [[of_gears[name][gear] for name in of_gears] for gear in range(2)]
    damage = np.array(
        [[_addends(curve, stress[g, k], cycles[g]) for k, curve in enumerate(row)] for g, row in enumerate(curves)]
    )
    safety = [[_safety(curve, stress[g, k], cycles[g]) for k, curve in enumerate(row)] for g, row in enumerate(curves)]
    total = damage.sum(axis=-1)
    with np.errstate(divide="ignore"):
        life = hours.sum() / total
    over = (GEAR, "failure")
    values = {
        "stress": ((*over, "class"), stress, {"units": "Pa", "long_name": "largest stress of the mesh cycle"}),
        "cycles": ((GEAR, "class"), cycles, {"units": "1", "long_name": "number of load cycles"}),
        "damage": (over, total, {"units": "1", "long_name": "damage sum"}),
        "class_damage": ((*over, "class"), damage, {"units": "1", "long_name": "damage by the class"}),
        "safety": (over, safety, {"units": "1", "long_name": "factor on all stresses at which the damage is 1"}),
        "life": (over, life, {"units": "h", "long_name": "life under the spectrum"}),
    }
    return xr.Dataset(
        values,
        {
            GEAR: BOTH,
            "failure": [*of_gears],
            "torque": ("class", torque, {"units": "N m", "long_name": "torque on the pinion"}),
            "speed": ("class", speed, {"units": "rad/s", "long_name": "speed of the pinion"}),
            "hours": ("class", hours, {"units": "h", "long_name": "duration"}),
        },
    )


def _pair(stresses: xr.Dataset) -> GearPair:
    require("pinion_z" in stresses.attrs, "stresses must hold their pair; pass what fem.root_stress returns")
    return pair_of(stresses)


def _of_both(name: str, curves: SNCurve | Sequence[SNCurve]) -> tuple[SNCurve, SNCurve]:
    both = (curves, curves) if isinstance(curves, SNCurve) else tuple(curves)
    require(len(both) == 2, f"{name} must be one exugear.SNCurve or those of pinion and wheel, got {len(both)}")
    return both  # type: ignore[return-value]


def _check_spectrum(torque: np.ndarray, **columns: np.ndarray) -> None:
    """ValueError unless the classes of a spectrum fit."""
    require(torque.ndim == 1 and torque.size > 0, f"torque must be (n_class,), n_class >= 1, got {torque.shape}")
    for name, column in {"torque": torque, **columns}.items():
        require(column.shape == torque.shape, f"{name} must be {torque.shape} as torque is, got {column.shape}")
        require_finite(name, column, "leave out classes that are not known")
        negative = name != "speed" and bool((column < 0).any())
        remedy = "; torques < 0 load the right flanks: pass them with the map of fem.mirror_image(pair)"
        require(not negative, f"{name} must be >= 0, got {column.min():g}{remedy if name == 'torque' else ''}")
    require(bool(columns["hours"].sum() > 0), "hours must not all be 0")
    require(bool((columns["load_factor"] > 0).all()), "load_factor must be > 0; leave out classes without load")


def _largest(table: StressMap, name: str, force: np.ndarray) -> np.ndarray:
    """(2, n) largest stress of the mesh cycle of pinion and wheel under forces (n,) [N]."""
    at_phases = [table.at(force, np.full(force.shape, phase))[name] for phase in table.phase]
    return np.broadcast_to(np.max(at_phases, axis=0), (2, force.size))


def _addends(curve: SNCurve, stress: np.ndarray, cycles: np.ndarray) -> np.ndarray:
    """(n_class,) cycles over those that a tooth bears; classes without cycles do no damage."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(cycles > 0, cycles / curve.cycles_at(stress), 0.0)


def _safety(curve: SNCurve, stress: np.ndarray, cycles: np.ndarray) -> float:
    """Factor on all stresses at which the damage is 1; infinite for a spectrum without stress or cycles."""
    if not (stress * cycles).any():
        return np.inf

    def excess(log_factor: float) -> float:
        """Damage less 1, limited where static strength is exceeded."""
        return float(np.minimum(_addends(curve, np.exp(log_factor) * stress, cycles).sum(), 2.0)) - 1.0

    static, *_, endless = np.log(np.asarray(curve.stress, float) / stress[cycles > 0].max())
    # Below endless life there is no damage, beyond static strength it is infinite.
    return float(np.exp(scipy.optimize.bisect(excess, endless - ROUNDING, static + ROUNDING, xtol=1e-10)))
