"""The gearbox as data: stages that couple parallel shafts, in trees and in loops."""

from dataclasses import dataclass, field
from math import isfinite

import numpy as np

from exugear.gearbox.gear_train import shaft_positions, speed_ratios, traverse_shafts
from exugear.gearbox.mesh_phasing import phases
from exugear.gearbox.shaft import Shaft
from exugear.gearbox.stage import Stage
from exugear.gearbox.static_offsets import stage_offsets
from fem.support.arguments import Finite, Numbers, checked
from fem.support.validation import require
from fem.units import mm

#: Share of the largest mesh force below which a force is rounding.
ROUNDING = 1e-9
#: Share of a pitch within which the loaded flanks of a loop touch at the same time.
TOGETHER = 1e-6


@dataclass(frozen=True, eq=False)
class Gearbox:
    """Stages that couple parallel shafts. The first stage's fast shaft drives, the last stage's slow one is driven.

    stages      `exugear.Stage`, in a tree or in loops

    Derived from them, by the name of the shaft or in the order of the stages:

    ratios            speed of every shaft over that of the driving shaft
    directions        sense of rotation of every shaft about z, +1 or -1; +1 for the driving shaft
    shaft_positions   x, y of every shaft [m], the driving shaft at 0
    phases            of every stage in the reference configuration, where all driving flanks touch, as share of a pitch

    Raises ValueError for gears without a mate, shafts that are not coupled, two shafts of the same name, and loops that
    do not close, jam, do not assemble, or whose loaded flanks do not touch at the same time.
    """

    stages: tuple[Stage, ...]
    ratios: dict[str, float] = field(init=False, repr=False)
    directions: dict[str, int] = field(init=False, repr=False)
    shaft_positions: dict[str, tuple[float, float]] = field(init=False, repr=False)
    phases: tuple[float, ...] = field(init=False, repr=False)

    def __post_init__(self):
        listed = isinstance(self.stages, list | tuple) and all(isinstance(stage, Stage) for stage in self.stages)
        require(listed, f"stages must be a list of Stage, got {type(self.stages).__name__}; write Gearbox([stage])")
        object.__setattr__(self, "stages", tuple(self.stages))
        require(bool(self.stages), "stages must hold at least one Stage, got none")
        self._check_names()
        self._check_mates()
        self._check_item_names()
        self._place_shafts()
        ends = f"shaft {self.driving.name!r} drives and is driven; list the stage of the driven shaft last"
        require(self.driving.name != self.driven.name, ends)
        self._check_flanks()
        object.__setattr__(self, "phases", phases(self.stages, self.directions, self.shaft_positions))

    def __repr__(self) -> str:
        pairs = [(label, stage.pair) for label, stage in zip(self.labels, self.stages, strict=True)]
        return f"Gearbox({', '.join(f'{label}: {pair.pinion.z}/{pair.wheel.z} teeth' for label, pair in pairs)})"

    @property
    def shafts(self) -> tuple[Shaft, ...]:
        """All shafts in the order of the stages, each once."""
        return tuple({shaft.name: shaft for stage in self.stages for shaft in (stage.fast, stage.slow)}.values())

    @property
    def driving(self) -> Shaft:
        """Shaft whose speed the drive prescribes."""
        return self.stages[0].fast

    @property
    def driven(self) -> Shaft:
        """Shaft that carries the load torque."""
        return self.stages[-1].slow

    @property
    def ends(self) -> dict[str, Shaft]:
        """Shaft by the name of each body that a drive or a load may act on: the shafts, and the rotors behind them."""
        shafts = {shaft.name: shaft for shaft in self.shafts}
        return shafts | {rotor.name: shaft for shaft in self.shafts for rotor in shaft.rotors}

    @property
    def labels(self) -> tuple[str, ...]:
        """Names of the stages, with the axial position where two couple the same shafts."""
        names = [stage.name for stage in self.stages]
        long = [f"{stage.name} at {stage.axial_positions[0] / mm:g} mm" for stage in self.stages]
        return tuple(x if names.count(name) > 1 else name for name, x in zip(names, long, strict=True))

    @property
    def rows(self) -> np.ndarray:
        """(n_stage, n_shaft) deflections of the meshes per spin of the shafts [m/rad]: deflections = rows @ spins."""
        column = {shaft.name: j for j, shaft in enumerate(self.shafts)}
        rows = np.zeros((len(self.stages), len(column)))
        for row, stage in zip(rows, self.stages, strict=True):
            direction = self.directions[stage.fast.name]
            row[column[stage.fast.name]] = direction * stage.pair.pinion.r_b
            row[column[stage.slow.name]] = direction * stage.pair.wheel.r_b
        return rows

    @checked
    def static_forces(self, load: Finite, acceleration: Finite = 0.0) -> list[float]:
        """Mesh forces [N] under a load [N m] against the driven shaft's motion, > 0 on the driving flanks.

        acceleration   of the driving shaft [rad/s^2]; all shafts and the rotors behind their couplings follow it at
                       their ratios, and their inertia torques add to the load

        In loops the meshes share the load so that their elastic energy is least, at the largest stiffness of each.
        """
        torques = np.zeros(len(self.shafts))
        torques[self.shafts.index(self.driven)] = -self.directions[self.driven.name] * load
        return self.forces_under(torques, acceleration, held=self.driving.name).tolist()

    @checked
    def forces_under(self, torques: Numbers, acceleration: Finite, *, held: str) -> np.ndarray:
        """(n_stage,) mesh forces [N] under torques (n_shaft,) about z on the shafts [N m], as `static_forces`.

        acceleration   of the driving shaft [rad/s^2]
        held           name of the shaft whose speed is imposed; its drive takes the torque that is left
        """
        shafts = [shaft.name for shaft in self.shafts]
        shape = f"torques must have the shape ({len(shafts)},), a value for each of {shafts}, got {np.shape(torques)}"
        require(np.shape(torques) == (len(shafts),), shape)
        require(held in shafts, f"held must be one of the shafts {shafts}, got {held!r}")
        inertia_torques = [shaft.turning_inertia * self.ratios[shaft.name] * acceleration for shaft in self.shafts]
        root = np.sqrt([stage.force.stiffness_max for stage in self.stages])
        free = [name != held for name in shafts]
        balance = (self.rows * root[:, None]).T[free]
        return root * np.linalg.lstsq(balance, np.subtract(torques, inertia_torques)[free])[0]

    @checked
    def offsets(self, stage: Stage) -> dict[str, float]:
        """a [m], misalignment [rad] and axial [m] of a stage whose shafts are displaced (signs as in `fem.Offsets`)."""
        return stage_offsets(stage, self.shaft_positions, self.directions[stage.fast.name])

    def _check_names(self) -> None:
        for stage in self.stages:
            for shaft in (stage.fast, stage.slow):
                namesake = next(listed for listed in self.shafts if listed.name == shaft.name)
                require(namesake == shaft, f"two different shafts are named {shaft.name!r}; rename one")

    def _check_item_names(self) -> None:
        """Require that the items of Exudyn's system have different names."""
        names = ["drive", *(shaft.name for shaft in self.shafts), *self.labels]
        parts = "rotor", "coupling", "drag"
        for shaft in self.shafts:
            of_rotors = {name for rotor in shaft.rotors for name in (rotor.name, rotor.spring)}
            names += [*({f"{shaft.name} {part}" for part in parts} | of_rotors)]
        shared = sorted({name for name in names if names.count(name) > 1})
        clash = f"shafts, stages and their parts in Exudyn's system would share the names {shared}"
        require(not shared, f"{clash}; rename a shaft")

    def _check_mates(self) -> None:
        meshes = [frozenset(stage.ends) for stage in self.stages]
        for stage, mesh in zip(self.stages, meshes, strict=True):
            twice = f"gears of shafts {stage.fast.name!r} and {stage.slow.name!r} are coupled twice"
            remedy = "drop a stage, or add gears at another axial position"
            require(meshes.count(mesh) == 1, f"{twice}; {remedy}")
        mated = {end for mesh in meshes for end in mesh}
        for shaft in self.shafts:
            alone = [axial / mm for axial in shaft.gears if (shaft.name, axial) not in mated]
            remedy = "add a stage or remove the gear"
            require(not alone, f"gear without mate on shaft {shaft.name!r} at {alone} mm; {remedy}")

    def _place_shafts(self) -> None:
        traversal = traverse_shafts(self.stages)
        ratios = speed_ratios(self.stages, traversal)
        directions = {name: 1 if ratio > 0 else -1 for name, ratio in ratios.items()}
        object.__setattr__(self, "ratios", {name: float(ratio) for name, ratio in ratios.items()})
        object.__setattr__(self, "directions", directions)
        object.__setattr__(self, "shaft_positions", shaft_positions(self.stages, traversal))

    def _check_flanks(self) -> None:
        """Require that all flanks that a load presses touch at the same time, also back flanks in loops."""
        forces = np.array(self.static_forces(1.0))
        backlashes = [stage.force.backlash if isfinite(stage.force.backlash) else 0.0 for stage in self.stages]
        advance = np.where(forces < -ROUNDING * np.abs(forces).max(), -np.array(backlashes), 0.0)
        rows = self.rows[:, 1:]
        apart = np.abs(advance - rows @ np.linalg.lstsq(rows, advance)[0]).max()
        back = [stage.name for stage, x in zip(self.stages, advance, strict=True) if x]
        cause = f"stages {back} are driven from their slow shafts; name the shaft of the driving gear fast"
        together = bool(apart < TOGETHER * min(stage.pair.p_bt for stage in self.stages))
        require(together, f"loaded flanks of a loop do not touch at the same time: {cause}")
