"""What a failed solve says: time, speed, cause and remedy; that a load leaves no static equilibrium."""

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from exugear.multibody.model import Model
from exugear.multibody.user_function_errors import Diverged, OutOfRange, user_errors_raised
from exugear.planning.plan import UNDAMPED
from fem.units import rpm

#: Duration of the static solve, in which the spins do not advance [s].
STATIC_SOLVE_TIME = 1e-12
NO_EQUILIBRIUM = (
    "no static equilibrium; try another load: a larger one where teeth or bearings hardly touch, "
    "a smaller one or stiffer bearings where these yield far"
)
STIFFNESS_UNIT_HINT = "(in N/m: 200 N/um are 200e6)"
#: What is said of a solve that did not converge.
FAILED = "Newton's iteration failed"
#: How Exudyn names the kind of a user function that failed.
USER_FUNCTION = r"USER FUNCTION '([^']*)'"


class NoEquilibrium(ValueError, RuntimeError):
    """A load beyond the maps or the tables of bearings, under which bearings yield too far, or a failed static solve.

    As ValueError the load is out of the range of the gearbox, as RuntimeError a solve has failed.
    """


@contextmanager
def explained(
    model: Model, remedy: Callable[[], str], speed_of, kind: type[RuntimeError] = RuntimeError
) -> Iterator[None]:
    """Turn the exceptions of a solve into a kind of RuntimeError with time, speed and remedy; Ctrl-C passes."""
    try:
        with user_errors_raised(model.bare_mbs):
            yield
    except Exception as error:
        if isinstance(error.__cause__, KeyboardInterrupt):
            raise KeyboardInterrupt from None
        if isinstance(error, AttributeError | NameError | ImportError | LookupError):
            raise  # a mistake in the code, of which Newton's iteration knows nothing
        t = model.bare_mbs.systemData.GetTime()
        where = f"at t = {t:.6g} s ({float(speed_of(t)) / rpm:.5g} rpm)"
        raise kind(f"{where}: {_reason(error, remedy())}{damping_remark(model, t)}") from None


def _reason(error: Exception, remedy: str) -> str:
    """Reason of a failed solve: a force that is not known, a user function of the user, or Newton's iteration."""
    if isinstance(error, Diverged):
        return f"{error.reason}; {remedy}"
    if isinstance(error, OutOfRange):
        return str(error)
    if error.__cause__ is not None:
        named = re.search(USER_FUNCTION, str(error))
        cause = f"{type(error.__cause__).__name__}: {error.__cause__}"
        return f"user function {named.group(1) if named else ''} failed, {cause}"
    return f"{FAILED}; {remedy}"


def damping_remark(model: Model, t: float) -> str:
    """Remark on a run that fails at t [s] where no mesh, bearing or coupling is damped; else empty."""
    return f" ({UNDAMPED})" if model.scene.undamped and t > STATIC_SOLVE_TIME else ""
