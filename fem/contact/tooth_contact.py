"""Contact of all tooth pairs at one mesh position: the candidates, and their state under a load."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fem.contact.contact_state import State, hertz_pressure
from fem.contact.contact_width import FaceSlicing, flank_positions, line_loads
from fem.contact.flank_gap import ContactSlices, closest_point
from fem.contact.line_contact import LineContact
from fem.contact.strip_contact import Bodies, wide_enough
from fem.elasticity.face_symmetry import Face
from fem.elasticity.flank_compliance import Compliance
from fem.microgeometry.flank import lines_across
from fem.pair.mesh_position import MeshPosition

#: Rounds of the search for the section that touches first, and number of sections in a round: steps shrink by 4.
ROUNDS, AROUND = 3, 9


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

    @property
    def bodies(self) -> Bodies:
        return self.pinion, self.wheel

    @cached_property
    def slicing(self) -> FaceSlicing:
        """How the face is cut into slices."""
        return FaceSlicing(self.position, self.face, self.slices)

    @cached_property
    def line_contact(self) -> LineContact:
        """Contact of the whole face with one line load in each slice."""
        return LineContact(self.slicing.whole, self.bodies)

    def state(self, force: float, misalignment: float = 0.0) -> State:
        """Contact under the mesh force force >= 0 [N], resolved by strips; misalignment as in `fem.Offsets`.

        Raises RuntimeError where the contact does not converge.
        """
        if force == 0:
            none = np.zeros(0)
            return State(self.first_touch(misalignment), self.slicing.over({}), none, none, self.face)
        force = force * self.face.share

        def solve(slices: ContactSlices, last: State) -> State:
            return self._strip_state(slices, force, misalignment, line_loads(slices, last, force))

        te, loads = self.line_contact.guess(force, misalignment)
        guess = State(te, self.slicing.whole, loads, np.zeros(loads.size), self.face)
        return self.slicing.loaded(guess, misalignment, solve)

    def _strip_state(self, slices: ContactSlices, force: float, misalignment: float, line_load: np.ndarray) -> State:
        """State of slices on strips, under a force on the modelled face [N]; line_load: a guess (n,) [N/m]."""
        half_width = slices.half_width(line_load)
        strips, (te, stiffness, load) = wide_enough(slices, self.bodies, force, misalignment, half_width)
        pressure = (load / (strips.width * slices.length[:, None])).max(axis=1)
        return State(te, slices, load.sum(axis=1), pressure, self.face, stiffness / self.face.share, strips, load)

    def slice_states(self, force: np.ndarray, misalignment: np.ndarray) -> list[State]:
        """Contacts under mesh forces (m,) >= 0 [N] and misalignments (m,) [rad] with one line load in each slice.

        Raises RuntimeError where a contact does not converge.
        """
        slices, loaded = self.slicing.whole, force > 0
        te, stiffness = slices.first_touch(misalignment).min(axis=1), np.zeros(force.size)
        loads = np.zeros((force.size, slices.low.size))
        if loaded.any():
            solved = self.line_contact.solve(force[loaded] * self.face.share, misalignment[loaded])
            te[loaded], stiffness[loaded], loads[loaded] = solved
        columns = te.tolist(), loads, hertz_pressure(slices, loads), (stiffness / self.face.share).tolist()
        return [State(t, slices, f, p, self.face, k) for t, f, p, k in zip(*columns, strict=True)]

    def first_touch(self, misalignment: float) -> float:
        """Transmission error at which the first tooth pair touches without load [m], by a search across the face.

        Each round evaluates the gaps at the transmission error of the round before.
        """
        lines = np.clip(flank_positions(self.position, lines_across), *self.slicing.ends)
        lines = self.slicing.grading.share(lines)
        shares, te = np.stack([np.append(at, lines) for at in self.slicing.station_shares]), 0.0

        def touch(shares: np.ndarray) -> tuple[np.ndarray]:
            nonlocal te
            sections = self.slicing.sections(shares)
            sections = replace(sections, te=te - misalignment * sections.middle[:, None])
            touches = sections.first_touch(misalignment).reshape(shares.shape)
            te = float(touches.min())
            return (touches,)

        _, touches = closest_point(touch, shares, 1 / self.slices, (0, 1), rounds=ROUNDS, around=AROUND)
        return float(touches.min())
