"""Contact of all tooth pairs at one mesh position: the candidates, and their state under a load."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fem.contact.contact_slices import ContactSlices, GapAcross, gap_across, least_gaps
from fem.contact.contact_state import LoadQuantities, State, hertz_pressure, load_quantities
from fem.contact.coupling import compiled_compliance
from fem.contact.face_grading import flank_positions, share_at
from fem.contact.line_contact import LineLoads, line_contact, solve_lines
from fem.contact.loaded_width import FaceSlicing, line_loads
from fem.contact.strip_bounds import Strips, strips_of
from fem.contact.strip_contact import Compliances, Solution, assemble
from fem.elasticity.face_symmetry import Face
from fem.elasticity.flank_compliance import Compliance
from fem.microgeometry.flank import lines_across
from fem.pair.mesh_position import MeshPosition
from fem.support.numba_cache import kept_unchecked
from fem.units import mm

#: Rounds of the search for the section that touches first, and number of sections in a round: steps shrink by 4.
ROUNDS, AROUND = 3, 9
#: Factor by which strips are widened that are narrower than the contact, and how often: to a hundred times in total.
WIDENING, WIDENINGS = 1.6, 12

#: Slices are coupled that touch within the deflection of a pair of this stiffness per face width, over 1/flattening of
#: both flanks: 6 N/(mm um) of steel.
SOFTEST = 0.035


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
        numbers = self.position.numbers()
        pinion = compiled_compliance(self.pinion, 0.0, numbers)
        return pinion, compiled_compliance(
            self.wheel, self.position.tooth_angle, range(1 - numbers.stop, 1 - numbers.start)
        )

    @cached_property
    def slicing(self) -> FaceSlicing:
        """How the face is cut into slices."""
        return FaceSlicing(self.position, self.face, self.slices)

    @cached_property
    def gap_across(self) -> tuple[ContactSlices, GapAcross]:
        """Slices of the whole modelled face, and how the gap varies across them."""
        return gap_across(self.slicing.whole)

    def state(self, force: float, misalignment: float = 0.0) -> State:
        """Contact under the mesh force force >= 0 [N], resolved by strips; misalignment as in `fem.Offsets`.

        Raises RuntimeError where the contact does not converge.
        """
        return self.strip_states(np.array([force]), np.array([misalignment]))[0]

    def strip_states(self, force: np.ndarray, misalignment: np.ndarray) -> list[State]:
        """The same under mesh forces (m,) and misalignments (m,), whose first guesses share their compliance."""
        return self._strip_states(force, misalignment, *self._guess(force, misalignment))

    def _guess(self, force: np.ndarray, misalignment: np.ndarray) -> tuple[ContactSlices, LineLoads]:
        """Slices that may carry load, and line loads on them, from which strips begin."""
        with self._located(force, misalignment):
            return self._line_loads(force, misalignment, softens=False)

    def _strip_states(
        self, force: np.ndarray, misalignment: np.ndarray, slices: ContactSlices, loads: LineLoads
    ) -> list[State]:
        columns = force.tolist(), misalignment.tolist(), loads.te.tolist(), loads.force
        return [
            self._strip_state(load, tilt, State(te, slices, guess, guess, self.face))
            if load > 0
            else self._unloaded(tilt)
            for load, tilt, te, guess in zip(*columns, strict=True)
        ]

    def _unloaded(self, misalignment: float) -> State:
        none = np.zeros(0)
        slices = ContactSlices(self.position, none.astype(int), none, none, mesh=self.slicing.mesh)
        return State(self.first_touch(misalignment), slices, none, none, self.face)

    def _strip_state(self, force: float, misalignment: float, guess: State) -> State:
        """State under a mesh force > 0 [N], on slices that follow the loaded width from a first guess on."""

        def solve(slices: ContactSlices, last: State) -> State:
            return self._on_strips(slices, force * self.face.share, misalignment, last)

        with self._located(np.array([force]), np.array([misalignment])):
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

    def _on_strips(self, slices: ContactSlices, force: float, misalignment: float, last: State) -> State:
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
        slices, loads = self.slice_loads(force, misalignment)
        columns = loads.te.tolist(), loads.force, hertz_pressure(slices, loads.largest), loads.stiffness.tolist()
        return [State(t, slices, f, p, self.face, k) for t, f, p, k in zip(*columns, strict=True)]

    def slice_loads(self, force: np.ndarray, misalignment: np.ndarray) -> tuple[ContactSlices, LineLoads]:
        """Slices that may carry load, and the line loads of `slice_states` on them."""
        with self._located(force, misalignment):
            slices, loads = self._line_loads(force, misalignment, softens=True)
        return slices, loads._replace(stiffness=loads.stiffness / self.face.share)

    def slice_quantities(self, force: np.ndarray, misalignment: np.ndarray) -> dict[str, np.ndarray]:
        """te (m,) [m], stiffness (m,) [N/m] and `LoadQuantities` of `slice_states`, by name."""
        slices, loads = self.slice_loads(force, misalignment)
        pressure = hertz_pressure(slices, loads.largest)
        quantities = load_quantities(slices, loads.force, pressure, self.face, loads.moment, loads.largest)
        overlap = self._overlap(slices, loads, loads.te)
        return {"te": loads.te, "stiffness": loads.stiffness, "overlap": overlap} | quantities._asdict()

    def _line_loads(
        self, force: np.ndarray, misalignment: np.ndarray, *, softens: bool
    ) -> tuple[ContactSlices, LineLoads]:
        """Slices that may touch, and line loads on them, under mesh forces (m,) [N] and misalignments (m,) [rad].

        Only slices within reach of the deflection are coupled; where it exceeds the expected one, the reach is doubled.
        """
        (whole, across), loaded = self.gap_across, force > 0
        middle, slope = across.misaligned(whole, misalignment)
        touches = least_gaps(middle, slope, across.bend) / across.approach
        unloaded = touches.min(axis=1)
        reach = force.max() * whole.mesh.geometry.position["flattening"] / (SOFTEST * self.position.pair.b)
        while True:
            near = within_reach(whole.number, touches <= unloaded[:, None] + reach)
            slices, te = whole.part(near), unloaded.copy()
            stiffness, (of_slices, moment, largest) = np.zeros(te.size), np.zeros((3, te.size, near.size))
            loads = LineLoads(te, stiffness, of_slices, moment, largest, np.ascontiguousarray(touches[:, near]))
            if loaded.any():
                contact = line_contact(
                    slices, across.bend[near], self.bodies, self.face, force=force.max(), softens=softens
                )
                gaps = (np.ascontiguousarray(values[loaded][:, near]) for values in (middle, slope, touches))
                solved = solve_lines(contact, force[loaded] * self.face.share, *gaps)
                for of_all, of_loaded in zip(loads, solved, strict=True):
                    of_all[loaded] = of_loaded
            if (te <= unloaded + reach).all():
                return slices, loads
            reach *= 2

    def strip_quantities(self, force: np.ndarray, misalignment: np.ndarray) -> dict[str, np.ndarray]:
        """The same of `strip_states`."""
        slices, loads = self._guess(force, misalignment)
        states = self._strip_states(force, misalignment, slices, loads)
        columns = zip(*(state.quantities for state in states), strict=True)
        quantities = dict(zip(LoadQuantities._fields, map(np.concatenate, columns), strict=True))
        te, stiffness = (np.array([getattr(state, name) for state in states]) for name in ("te", "stiffness"))
        return {"te": te, "stiffness": stiffness, "overlap": self._overlap(slices, loads, te)} | quantities

    def _overlap(self, slices: ContactSlices, loads: LineLoads, te: np.ndarray) -> np.ndarray:
        """(m, n_pair) largest overlap of the flanks of each tooth pair under the loads on the other ones [m].

        It is > 0 where the tooth pair carries load; elsewhere it is minus its clearance, NaN beyond reach.
        """
        numbers = self.slicing.numbers
        return overlaps_of(slices.number, numbers.start, len(numbers), te, loads.touches)

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


@kept_unchecked
def overlaps_of(number, first, pairs, te, touches):
    """`ToothContact._overlap` of slices (n,) of tooth pairs from the first one on that touch at touches (m, n) [m]."""
    overlap = np.full((te.size, pairs), np.nan)
    for k in range(te.size):
        for i in range(number.size):
            overlap[k, number[i] - first] = np.fmax(overlap[k, number[i] - first], te[k] - touches[k, i])
    return overlap


def _range(values: np.ndarray) -> str:
    """Least and largest value in words."""
    return " to ".join(f"{value:.4g}" for value in np.unique([values.min(), values.max()]))


def within_reach(number: np.ndarray, touching: np.ndarray) -> np.ndarray:
    """Slices (k,) from the first to the last of each tooth pair that touches in any state, and those beside them.

    number      (n,) tooth pairs of the slices
    touching    (m, n) whether they touch in each state
    """
    near, rows = np.zeros(number.size, bool), np.flatnonzero(touching.any(axis=0))
    for pair in np.unique(number[rows]):
        of_pair = rows[number[rows] == pair]
        near[max(of_pair[0] - 1, 0) : of_pair[-1] + 2] |= number[max(of_pair[0] - 1, 0) : of_pair[-1] + 2] == pair
    return np.flatnonzero(near)
