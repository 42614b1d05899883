"""Contact of a pair at one phase and place: what may touch, and what does under a load."""

from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil, cos, sqrt

import numpy as np

from fem.contact.contact_width import Ranges, across, kinks, loads_at, overlap, wider, with_kinks
from fem.contact.flank_gap import TINY, ContactSlices
from fem.contact.line_contact import line_contact
from fem.contact.strip_bounds import Strips, at_tip_edge, strips_of
from fem.contact.strip_contact import along_contact, assemble, coupling, flattening_of
from fem.elasticity.flank_compliance import Compliance
from fem.microgeometry.flank import lines_across
from fem.pair.mesh_position import MeshPosition

#: Slices are narrower towards the end faces by this power.
GRADING = 1.6
#: Pairs that nearly touch join at once [modules].
NEAR = 4e-7
#: Loaded widths have settled that fall short of what touches, or exceed it, by less than these shares of the widest.
SHORT, SPARE = 0.02, 0.1
#: The loaded width is found again until it settles, after GROWING rounds the wider one of two.
ROUNDS, GROWING = 24, 6
#: Half-planes under whole slices are held at this depth, in modules: no less than half of what the width gets to.
DEPTH = 1 / 2
#: Overlap of the flanks, in modules, over which their compliance is taken as linear.
OVERLAP = 1 / 250
#: So often strips that are full to the edge are widened.
WIDENINGS = 12
#: Rounds in which the place that touches first is found among sections around the last one, four times closer each.
CLOSER, AROUND = 3, np.linspace(-1, 1, 9)


@dataclass(frozen=True)
class State:
    """What one contact solve found.

    te          static transmission error in mid-plane [m]
    cells       slices of pairs of teeth that were considered
    force       (n,) normal forces on the cells [N]
    pressure    (n,) largest contact pressure in each [Pa]
    stiffness   tangent stiffness of the mesh: change of the mesh force per te [N/m]; 0 without load
    strips      strips of the cells, and load (n, STRIPS) their forces [N]; None in the slice mode
    mirrored    whether the lower half of the face, which has no cells, carries the same
    """

    te: float
    cells: ContactSlices
    force: np.ndarray
    pressure: np.ndarray
    stiffness: float = 0.0
    strips: Strips | None = None
    load: np.ndarray | None = None
    mirrored: bool = False

    def share(self, number: int) -> float:
        """Share of the load that a pair of teeth carries; 0 without load."""
        return float(self.force[self.cells.number == number].sum() / max(self.force.sum(), TINY))

    def line_load(self) -> float:
        """Largest force per length of contact line [N/m]."""
        return float((self.force / self.cells.length).max(initial=0.0))

    def peak_pressure(self) -> float:
        """Largest contact pressure [Pa]."""
        return float(self.pressure.max(initial=0.0))

    def hertz_pressure(self) -> float:
        """Largest pressure of the line loads by Hertz, on the curvature of the involutes [Pa]."""
        return float(self.cells.hertz_pressure(self.force).max(initial=0.0))

    def tip_contact(self) -> float:
        """Share of the load that slices carry whose contact reaches a tip edge; 0 without load."""
        return float(self.force[at_tip_edge(self.cells, self.force)].sum() / max(self.force.sum(), TINY))

    def centroid(self) -> float:
        """Axial place of the resultant force [m]; 0 without load and where both halves carry the same."""
        if self.mirrored:
            return 0.0
        return float(self.force @ self.cells.middle / max(self.force.sum(), TINY))


@dataclass(frozen=True)
class ToothContact:
    """A meeting of two gears with known compliances; slices: number of slices of the width of `bodies`."""

    meeting: MeshPosition
    pinion: Compliance
    wheel: Compliance
    slices: int

    @property
    def face(self) -> tuple[float, float]:
        """Axial ends of what is solved: the common face, or its upper half where the other one is alike [m]."""
        low, high = self.meeting.face
        return (0.0 if self.pinion.share < 1 else low), high

    def graded(self, share: np.ndarray) -> np.ndarray:
        """Axial places [m] at shares of the face, closer together towards the end faces."""
        low, high = self.face
        if self.pinion.share < 1:
            return high * (1 - (1 - share) ** GRADING)
        side = 2 * share - 1
        return (low + high) / 2 + (high - low) / 2 * np.sign(side) * (1 - (1 - np.abs(side)) ** GRADING)

    def shares(self, axial: np.ndarray) -> np.ndarray:
        """Inverse of `graded`."""
        low, high = self.face
        if self.pinion.share < 1:
            return 1 - (1 - axial / high) ** (1 / GRADING)
        side = (axial - (low + high) / 2) / ((high - low) / 2)
        return (1 + np.sign(side) * (1 - (1 - np.minimum(np.abs(side), 1)) ** (1 / GRADING))) / 2

    def sliced(self, ranges: Ranges, slices: int, te: float = 0.0) -> ContactSlices:
        """Slices of pairs of teeth over ranges of the face.

        On the widest as many as the fourth root of its share of the face demands, on others as the root of theirs.
        They end at kinks.
        """
        edges, shares = {}, {number: self.shares(np.array(ends)) for number, ends in ranges.items()}
        even = slices / max(map(np.ptp, shares.values()), default=1.0) ** 0.25
        for number, (start, end) in shares.items():
            n = max(1, ceil(even * sqrt(end - start)))
            edges[number] = self.graded(with_kinks(np.linspace(start, end, n + 1), self.kinked_shares[number]))
        none = np.zeros(0)
        numbers = np.concatenate([none.astype(int), *(np.full(e.size - 1, k) for k, e in edges.items())])
        low, high = (np.concatenate([none, *(e[part] for e in edges.values())]) for part in (slice(-1), slice(1, None)))
        return ContactSlices(self.meeting, numbers, low, high, te)

    def sections(self, shares: np.ndarray) -> ContactSlices:
        """Sections of no width at shares (n_pair, n) of the face, of all pairs."""
        numbers, places = np.array(self.meeting.numbers()), self.graded(shares)
        return ContactSlices(self.meeting, np.repeat(numbers, shares.shape[1]), places.ravel(), places.ravel())

    @cached_property
    def kinked_shares(self) -> dict[int, np.ndarray]:
        """(n,) shares of the face where the gap may have a kink, by number of the pair."""
        shares = self.shares(np.clip(kinks(self.meeting), *self.face))
        return dict(zip(self.meeting.numbers(), shares, strict=True))

    @cached_property
    def station_shares(self) -> np.ndarray:
        """(n_pair, n) these and equidistant ones."""
        even = np.linspace(0, 1, self.slices + 1)
        return np.stack([np.append(even, kinked) for kinked in self.kinked_shares.values()])

    @property
    def depth(self) -> float:
        """At which half-planes under whole slices are held [m]."""
        return DEPTH * self.meeting.pair.pinion.m_n

    @cached_property
    def stations(self) -> ContactSlices:
        """Sections at these shares."""
        return self.sections(self.station_shares)

    @cached_property
    def whole(self) -> ContactSlices:
        """Slices of all pairs over the whole face."""
        return self.sliced(dict.fromkeys(self.meeting.numbers(), self.face), self.slices)

    def coupled(self, te: float) -> np.ndarray:
        """(n, n) compliance between the whole slices where they are closest at te [m/N].

        Half-planes held at `depth` apart.
        """
        arcs = replace(self.whole, te=te).touching if te else self.whole.touching
        smooth = coupling(self.whole, arcs, self.pinion, self.wheel)[:, 0, :, 0]
        return smooth + along_contact(self.whole, self.depth, self.pinion, self.wheel)

    @cached_property
    def rest_coupling(self) -> np.ndarray:
        """(n, n) compliance between the whole slices before they deflect [m/N]."""
        return self.coupled(0.0)

    @cached_property
    def softening(self) -> np.ndarray:
        """(n, n) change of that compliance per transmission error [1/N]."""
        step = OVERLAP * self.meeting.pair.pinion.m_n
        return (self.coupled(step) - self.rest_coupling) / step

    def gaps(self, cells: ContactSlices, misalignment) -> tuple[np.ndarray, np.ndarray]:
        """Normal gap [m] and approach per transmission error where the flanks of cells are closest, each (n,)."""
        gap, per_error = cells.nearest
        return gap + cos(self.meeting.pair.beta_b) * misalignment * cells.middle, per_error

    def hertz(self, cells: ContactSlices) -> tuple[np.ndarray, np.ndarray]:
        """Factor and constant of the flattening of cells under one line load, as `line_contact` takes them."""
        width = cells.half_width(1 / (cells.high - cells.low))
        return flattening_of(cells), 0.5 + np.log(2 * self.depth / width)

    def line_contact(self, force: np.ndarray, misalignment: np.ndarray, change) -> tuple[np.ndarray, ...]:
        """Transmission errors (m,) [m], stiffnesses (m,) [N/m] and line loads on the whole slices (m, n) [N].

        change      of `rest_coupling` per transmission error [1/N]
        """
        cells = self.whole
        gap, per_error = self.gaps(cells, misalignment[:, None])
        return line_contact(self.rest_coupling, change, self.hertz(cells), gap, per_error, force)

    def slice_states(self, force: np.ndarray, misalignment: np.ndarray) -> list[State]:
        """Contacts under mesh forces (m,) >= 0 [N] and misalignments (m,) [rad] with one line load in each slice."""
        cells, loaded = self.whole, force > 0
        gap, per_error = self.gaps(cells, misalignment[:, None])
        te, stiffness, loads = (gap / per_error).min(axis=1), np.zeros(force.size), np.zeros(gap.shape)
        share = self.pinion.share
        if loaded.any():
            solved = self.line_contact(force[loaded] * share, misalignment[loaded], self.softening)
            te[loaded], stiffness[loaded], loads[loaded] = solved
        columns = te.tolist(), loads, cells.hertz_pressure(loads), (stiffness / share).tolist()
        return [State(t, cells, f, p, k, mirrored=share < 1) for t, f, p, k in zip(*columns, strict=True)]

    def ranges(self, te: float, misalignment: float, cells: ContactSlices, loads: np.ndarray) -> Ranges:
        """Axial ends between which the flanks of each pair of teeth overlap under a transmission error te [m].

        Where they do so between stations only, those of the cells with loads (n,) [N]. Half a face goes on mirrored.
        """
        at_stations, at_cells = (np.divide(*self.gaps(some, misalignment)) for some in (self.stations, cells))
        near, found = NEAR * self.meeting.pair.pinion.m_n, {}
        for number in np.unique(self.stations.number):
            own, mine = self.stations.number == number, cells.number == number
            carry = mine & (loads > 0)
            axial, order = np.unique(np.append(self.stations.low[own], cells.middle[mine]), return_index=True)
            clear = te + near - np.append(at_stations[own], at_cells[mine])[order]
            if self.pinion.share < 1:
                axial, clear = np.append(-axial[1], axial), np.append(clear[1], clear)
            if clear.max() > 0:
                low, high = overlap(axial, clear)
                found[int(number)] = max(low, self.face[0]), high
            elif carry.any():
                found[int(number)] = float(cells.low[carry].min()), float(cells.high[carry].max())
        return found

    def state(self, force: float, misalignment: float = 0.0) -> State:
        """Contact under the mesh force force >= 0 [N]; misalignment as in `fem.Offsets`.

        Raises RuntimeError where the contact does not settle.
        """
        if force == 0:
            return State(self.unloaded(misalignment), self.sliced({}, 0), np.zeros(0), np.zeros(0))
        force, cells = force * self.pinion.share, self.whole
        (te,), _, (loads,) = self.line_contact(np.array([force]), np.array([misalignment]), change=0.0)
        ranges = self.ranges(te, misalignment, cells, loads)
        for step in range(ROUNDS):
            line_load = loads / (cells.high - cells.low)
            guess = {k: (cells.middle[cells.number == k], line_load[cells.number == k]) for k in ranges}
            cells = self.sliced(ranges, self.slices, te)
            state = self.pressed(cells, force, misalignment, cells.half_width(loads_at(cells, guess, force)))
            loads, touched = state.force, self.ranges(state.te, misalignment, cells, state.force)
            if self.covered(touched, ranges, SPARE if step < GROWING else np.inf):
                return state
            ranges, te = touched if step < GROWING else wider(touched, ranges), state.te
        raise RuntimeError("the loaded width did not settle; try a neighbouring phase or more slices")

    def unloaded(self, misalignment: float) -> float:
        """Transmission error at which the first pair touches [m], which is closest beside its closest section.

        Sections around it are compared as the gears stand once the closest one of all touches.
        """
        lines = self.shares(np.clip(across(self.meeting, lines_across), *self.face))
        shares, step = np.stack([np.append(at, lines) for at in self.station_shares]), 1 / self.slices
        cells = self.sections(shares) if lines.size else self.stations
        for _ in range(CLOSER):
            clear = np.divide(*self.gaps(cells, misalignment)).reshape(shares.shape)
            closest = np.take_along_axis(shares, np.argmin(clear, axis=1)[:, None], axis=1)
            shares, step = np.clip(closest + step * AROUND, 0, 1), step / 4
            cells = self.sections(shares)
            cells = replace(cells, te=clear.min() - misalignment * cells.middle[:, None])
        return float(np.divide(*self.gaps(cells, misalignment)).min())

    def covered(self, touched: Ranges, ranges: Ranges, spare: float) -> bool:
        """Whether the ranges hold what was touched, and beside it no more than a spare share of the widest."""
        if touched.keys() - ranges.keys():
            return False
        wanted = self.shares(np.array(list(touched.values())))
        outwards = (self.shares(np.array([ranges[k] for k in touched])) - wanted) * [-1, 1]
        outwards /= np.ptp(wanted, axis=1).max()
        return bool(outwards.min() > -SHORT and outwards.max() < spare)

    def pressed(self, cells: ContactSlices, force: float, misalignment: float, half_width: np.ndarray) -> State:
        """Contact of cells on strips wide enough to hold it; when some are widened, the rest start as they ended."""
        spilt, touching = np.ones(cells.low.size, bool), np.zeros((cells.low.size, 1), bool)
        for _ in range(WIDENINGS):
            strips = strips_of(cells, half_width)
            touching = np.where(spilt[:, None], strips.expected > 0, touching)
            te, stiffness, load = assemble(cells, strips, self.pinion, self.wheel, misalignment).solve(force, touching)
            first, last = strips.open & (load[:, [0, -1]].T > 0)
            spilt = first | last
            if not spilt.any():
                pressure = (load / (strips.width * cells.length[:, None])).max(axis=1)
                stiffness /= self.pinion.share
                return State(te, cells, load.sum(axis=1), pressure, stiffness, strips, load, self.pinion.share < 1)
            half_width, touching = np.where(spilt, 1.6 * half_width, half_width), load > 0
        raise RuntimeError("contact is a hundred times wider than Hertz says; reduce the load or take more slices")
