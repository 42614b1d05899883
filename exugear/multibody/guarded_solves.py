"""Where Exudyn solves a system with gear contacts: threads are checked before, contacts that never closed after.

Where a user function fails, its exception is raised in place of Exudyn's.

With `parallel.numberOfThreads` >= 2 and at least `parallel.multithreadedLowerLimitResiduals` objects (20 by default)
Exudyn 1.13.6 evaluates the forces of all user functions twice and adds both, in implicit, static and explicit solves
alike: springs become twice as stiff. With Python functions it may also wait for itself without end, as the thread that
solves keeps Python's lock from the others. A limit that no system reaches gives the result of a single thread bit by
bit.

The checks stand in the methods of Exudyn's solvers with which all solves begin: a user function is too late, since the
first evaluation may already hang, and explicit solves call none in Python. They cost a solve 1 us, a step nothing.
"""

from collections.abc import Callable
from functools import wraps
from math import isinf

import exudyn as exu

from exugear.multibody.gear_contact import StoredContact, contacts_of, known_contacts
from exugear.multibody.model import REST
from exugear.multibody.turns import turn_with
from exugear.multibody.user_function_errors import user_errors_raised
from fem.support.user_warning import warn_user

#: Number of objects below which Exudyn evaluates forces in one thread: more than any system has.
ALL_OBJECTS = 10**9
REMEDY = f"set settings.parallel.multithreadedLowerLimitResiduals = {ALL_OBJECTS}, or numberOfThreads = 1"
#: Exudyn's solvers; their methods (solver, mainSystem, simulationSettings) that evaluate forces first.
SOLVERS = exu.MainSolverStatic, exu.MainSolverImplicitSecondOrder, exu.MainSolverExplicit
FIRST_METHODS = "SolveSystem", "InitializeSolver"


def exudyn_settings() -> exu.SimulationSettings:
    """New settings without a solution file, with which Exudyn calls user functions once in any number of threads."""
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    settings.parallel.multithreadedLowerLimitResiduals = ALL_OBJECTS
    return settings


def check_threads(mbs, settings) -> None:
    """RuntimeError, with the remedy, where Exudyn would apply the forces of gear contacts twice."""
    threads, limit = settings.parallel.numberOfThreads, settings.parallel.multithreadedLowerLimitResiduals
    if threads < 2 or mbs.systemData.NumberOfObjects() < limit or not contacts_of(mbs):
        return
    cause = f"{threads} threads and at least multithreadedLowerLimitResiduals = {limit} objects"
    raise RuntimeError(f"Exudyn applies the forces of gear contacts twice with {cause}; {REMEDY}")


def never_closed(contact: StoredContact) -> bool:
    """Whether the teeth of a contact without back flank have never touched."""
    table, _, state, *_ = contact.records
    return state.closed == 0.0 and isinf(table.head.backlash)


def report_open_contacts(mbs) -> None:
    """Warn, once for each, of contacts without back flank whose teeth have never touched in a solve."""
    if not any(map(never_closed, known_contacts(mbs))):
        return
    for number, contact in contacts_of(mbs).items():
        if never_closed(contact):
            _, frame, state, *_ = contact.records
            state.closed = 1.0
            name = mbs.GetObject(number)["name"]
            warn_user(_of_stage(name) if REST in mbs.variables else _of_contact(number, name, frame.direction))


def _of_stage(name: str) -> str:
    """Why the teeth of a stage of a built gearbox may never touch, with the remedy."""
    cause = "of a set a planet whose pin or teeth stand back with the force on it carries nothing, the others do"
    remedy = "raise the load, or pass a finite backlash if the stage may be loaded either way"
    return f"the teeth of stage {name!r} never touched, it carried no load: {cause}; {remedy}"


def _of_contact(number: int, name: str, direction: float) -> str:
    """Why the teeth of a contact of a system built by hand may never touch, with the remedy."""
    sense = "counter-clockwise" if direction > 0 else "clockwise"
    cause = f"its direction is {direction:+.0f}, so that it closes where the pinion pushes {sense}"
    remedy = f"pass direction={-direction:+.0f}, or a finite backlash if it may be loaded either way"
    return f"the teeth of gear contact {number} ({name!r}) never touched; {cause}; {remedy}"


def _guarded(method: Callable, *, solves: bool) -> Callable:
    """A method of a solver that is checked, in which threads take turns; solves: whether it is the whole solve."""

    @wraps(method)
    def guarded(solver, mainSystem, simulationSettings):
        check_threads(mainSystem, simulationSettings)
        with turn_with(mainSystem), user_errors_raised(mainSystem):
            result = method(solver, mainSystem, simulationSettings)
        if solves and result:
            report_open_contacts(mainSystem)
        return result

    return guarded


for _solver in SOLVERS:
    for _name in FIRST_METHODS:
        setattr(_solver, _name, _guarded(getattr(_solver, _name), solves=_name == "SolveSystem"))
