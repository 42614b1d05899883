"""Contact of all tooth pairs at one mesh position: the candidates, and their state under a load."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fem.contact.contact_state import State, hertz_pressure, load_rows
from fem.contact.coupling import compiled_compliance
from fem.contact.line_contact import LineContact, LineLoads, line_contact, solve_lines
from fem.contact.loaded_width import FaceSlicing, line_loads
from fem.contact.strip_bounds import Strips, strips_of
from fem.contact.strip_contact import Compliances, Solution, assemble
from fem.elasticity.face_symmetry import Face
from fem.elasticity.flank_compliance import Compliance
from fem.gap.contact_slices import ContactSlices
from fem.gap.face_grading import flank_positions, share_at
from fem.microgeometry.flank import lines_across
from fem.pair.mesh_position import MeshPosition
from fem.units import mm

#: Rounds of the search for the section that touches first, and number of sections in a round: steps shrink by 4.
ROUNDS, AROUND = 3, 9
#: Factor by which strips are widened that are narrower than the contact, and how often: to a hundred times in total.
WIDENING, WIDENINGS = 1.6, 12


@dataclass(frozen=True)
class ToothContact:
    """Two gears of known compliance at one mesh position; slices: number of slices of the modelled face."""

    position: MeshPosition
    pinion: Compliance
    wheel: Compliance
    slices: int

    @property
    def face(self) -> Face:
        """Part of the face width that is modelled."""
        return self.pinion.face

    @cached_property
    def bodies(self) -> Compliances:
        """Compliances of pinion and wheel for compiled code."""
        return compiled_compliance(self.pinion), compiled_compliance(self.wheel)

    @cached_property
    def slicing(self) -> FaceSlicing:
        """How the face is cut into slices."""
        return FaceSlicing(self.position, self.face, self.slices)

    @cached_property
    def rigid_line_contact(self) -> LineContact:
        """Contact of the whole face with one line load in each slice, whose compliance does not change."""
        return line_contact(self.slicing.whole, self.bodies, self.face, softens=False)

    @cached_property
    def line_contact(self) -> LineContact:
        """The same with a compliance that changes with the deflection."""
        return line_contact(self.slicing.whole, self.bodies, self.face, softens=True)

    def _line_loads(self, contact: LineContact, force: np.ndarray, misalignment: np.ndarray) -> LineLoads:
        """Line loads under mesh forces (m,) > 0 [N] and misalignments (m,) [rad]."""
        slices = self.slicing.whole
        gap = slices.closest.gap + slices.gap_by(misalignment)
        return LineLoads(*solve_lines(contact, force * self.face.share, gap))

    def state(self, force: float, misalignment: float = 0.0) -> State:
        """Contact under the mesh force force >= 0 [N], resolved by strips; misalignment as in `fem.Offsets`.

        Raises RuntimeError where the contact does not converge.
        """
        if force == 0:
            none = np.zeros(0)
            slices = ContactSlices(self.position, none.astype(int), none, none, mesh=self.slicing.mesh)
            return State(self.first_touch(misalignment), slices, none, none, self.face)

        def solve(slices: ContactSlices, last: State) -> State:
            return self._strip_state(slices, force * self.face.share, misalignment, last)

        load, tilt = np.array([force]), np.array([misalignment])
        with self._located(load, tilt):
            loads = self._line_loads(self.rigid_line_contact, load, tilt)
            guess = State(float(loads.te[0]), self.slicing.whole, loads.force[0], loads.force[0], self.face)
            return self.slicing.loaded(guess, misalignment, solve)

    @contextmanager
    def _located(self, force: np.ndarray, misalignment: np.ndarray) -> Iterator[None]:
        """Contacts under mesh forces (m,) [N] and misalignments (m,) [rad]; a RuntimeError says which they are."""
        try:
            yield
        except RuntimeError as error:
            position = self.position
            torque, tilt = _range(force * position.pair.pinion.r_b), _range(misalignment)
            at = f"phase {position.phase:.6g}, {torque} N m, a = {position.a / mm:.6g} mm, misalignment {tilt} rad"
            raise RuntimeError(f"{error} (at {at})") from None

    def _strip_state(self, slices: ContactSlices, force: float, misalignment: float, last: State) -> State:
        """State of slices on strips, under a force on the modelled face [N], after the last state."""
        strips, (te, stiffness, load) = self._wide_strips(slices, force, misalignment, last)
        pressure = (load / (strips.width * slices.length[:, None])).max(axis=1)
        return State(te, slices, load.sum(axis=1), pressure, self.face, stiffness / self.face.share, strips, load)

    def _wide_strips(
        self, slices: ContactSlices, force: float, misalignment: float, last: State
    ) -> tuple[Strips, Solution]:
        """Strips that cover all of the contact, and its solution.

        Slices whose outermost strips are loaded get wider strips; in other slices the active set starts from the last
        solution. At first only slices with an expected load touch: others would pull hard and disturb them.

        Raises RuntimeError where the contact is far wider than by Hertz.
        """
        expected, by_hertz = line_loads(slices, last, force)
        half_width, touching = slices.half_width(expected), np.zeros((slices.low.size, 1), bool)
        for _ in range(WIDENINGS):
            strips = strips_of(slices, half_width)
            touching = np.where(by_hertz[:, None], strips.expected > 0, touching)
            solution = assemble(slices, strips, self.bodies, self.face, misalignment).solve(force, touching)
            touching = solution.force > 0
            first_full, last_full = strips.open & touching[:, [0, -1]].T
            by_hertz = first_full | last_full
            if not by_hertz.any():
                return strips, solution
            half_width = np.where(by_hertz, WIDENING * half_width, half_width)
        raise RuntimeError("contact is a hundred times wider than by Hertz; reduce the load or take more slices")

    def slice_states(self, force: np.ndarray, misalignment: np.ndarray) -> list[State]:
        """Contacts under mesh forces (m,) >= 0 [N] and misalignments (m,) [rad] with one line load in each slice.

        Raises RuntimeError where a contact does not converge.
        """
        slices, (te, stiffness, loads) = self.slicing.whole, self.slice_loads(force, misalignment)
        columns = te.tolist(), loads, hertz_pressure(slices, loads), stiffness.tolist()
        return [State(t, slices, f, p, self.face, k) for t, f, p, k in zip(*columns, strict=True)]

    def slice_loads(self, force: np.ndarray, misalignment: np.ndarray) -> LineLoads:
        """Line loads of `slice_states`."""
        slices, loaded = self.slicing.whole, force > 0
        te, stiffness = slices.first_touch(misalignment).min(axis=1), np.zeros(force.size)
        loads = np.zeros((force.size, slices.low.size))
        if loaded.any():
            with self._located(force[loaded], misalignment[loaded]):
                solved = self._line_loads(self.line_contact, force[loaded], misalignment[loaded])
            te[loaded], stiffness[loaded], loads[loaded] = solved
        return LineLoads(te, stiffness / self.face.share, loads)

    def slice_rows(self, force: np.ndarray, misalignment: np.ndarray) -> np.ndarray:
        """(m, 7 + n_pair) transmission errors, stiffnesses, and `load_rows` of `slice_states`."""
        slices, (te, stiffness, loads) = self.slicing.whole, self.slice_loads(force, misalignment)
        rows = load_rows(slices, loads, hertz_pressure(slices, loads), self.face)
        return np.column_stack([te, stiffness, rows])

    def strip_rows(self, force: np.ndarray, misalignment: np.ndarray) -> np.ndarray:
        """The same of `state` under each force and misalignment."""
        states = [self.state(*load) for load in zip(force.tolist(), misalignment.tolist(), strict=True)]
        rows = [load_rows(state.slices, state.force[None], state.pressure[None], self.face) for state in states]
        return np.column_stack([[(state.te, state.stiffness) for state in states], np.concatenate(rows)])

    def first_touch(self, misalignment: float) -> float:
        """Transmission error at which the first tooth pair touches without load [m], by a search across the face.

        Each round evaluates the gaps at the transmission error of the round before.
        """
        slicing, te, step = self.slicing, 0.0, 1 / self.slices
        lines = share_at(slicing.grading, np.clip(flank_positions(self.position, lines_across), *slicing.ends))
        shares = np.hstack([slicing.station_shares, np.tile(lines, (len(slicing.numbers), 1))])
        for left in range(ROUNDS, -1, -1):
            sections = slicing.sections(shares)
            sections = replace(sections, te=te - misalignment * sections.middle)
            touches = sections.first_touch(misalignment).reshape(shares.shape)
            te = float(touches.min())
            if left:
                first = np.take_along_axis(shares, np.argmin(touches, axis=1)[:, None], axis=1)
                shares, step = np.clip(first + step * np.linspace(-1, 1, AROUND), 0, 1), step * 2 / (AROUND - 1)
        return te


def _range(values: np.ndarray) -> str:
    """Least and largest value in words."""
    return " to ".join(f"{value:.4g}" for value in np.unique([values.min(), values.max()]))
