"""Compiled functions that are compiled where a kernel first calls them, once for all kernels.

What a scene does not need is then not compiled for it, and what many kernels call is compiled once, not in each. A
kernel asks for the address of the function at its first call and keeps it: later calls take as long as those of a
function of its own that is not inlined. The address is one of this process, and code on disk holds none.
"""

from collections.abc import Callable
from ctypes import CFUNCTYPE, c_void_p, cast
from inspect import Parameter, Signature, signature
from traceback import print_exc
from typing import Any

import llvmlite.binding as llvm
from llvmlite import ir
from numba.core import cgutils
from numba.core.dispatcher import Dispatcher
from numba.extending import intrinsic

from fem.support.numba_cache import kept

#: Functions that return addresses to kernels: they live as long as the process.
ADDRESSES: dict[str, Any] = {}


def on_demand(returns, *arguments) -> Callable[[Callable], Any]:
    """Decorator of functions that kernels call and that are compiled, and kept on disk, at their first call.

    returns, arguments   their numba types; numbers of a call are converted to them, tuples must have them

    Of a `kept` function, which Python calls, kernels then call the code that Python calls with these types.

    Errors of the function are those of the kernel. A kernel raises RuntimeError where the function can't be compiled,
    and Python prints why.
    """

    def decorate(function):
        dispatcher: Any = function if isinstance(function, Dispatcher) else kept(function)
        name = f"address_of.{function.__module__}.{function.__qualname__}"

        def address() -> int:
            # ctypes returns anything where Python raises
            try:
                dispatcher.compile(arguments)
            except BaseException:
                print_exc()
                return 0
            overload = dispatcher.overloads[arguments]
            return overload.library.get_pointer_to_function(overload.fndesc.llvm_func_name)

        ADDRESSES[name] = CFUNCTYPE(c_void_p)(address)
        llvm.add_symbol(name, cast(ADDRESSES[name], c_void_p).value)
        call = _call_of(name, returns, arguments)
        vars(call)["__signature__"] = _after_context(signature(function))
        return intrinsic(call)

    return decorate


def _call_of(name: str, returns, arguments: tuple):
    """The call in a kernel of a function whose address a function of that name returns, for numba's `intrinsic`."""

    def call(typing_context, *given):
        return returns(*arguments), code

    def code(context, builder, _, values):
        convention, module = context.call_conv, builder.module
        pointer = convention.get_function_type(returns, arguments).as_pointer()
        known = cgutils.add_global_variable(module, pointer, f"known.{name}")
        known.linkage, known.initializer = "internal", ir.Constant(pointer, None)
        function = cgutils.alloca_once_value(builder, builder.load(known))
        with cgutils.if_unlikely(builder, cgutils.is_null(builder, builder.load(function))):
            asked = cgutils.get_or_insert_function(module, ir.FunctionType(pointer, ()), name)
            address = builder.call(asked, ())
            with cgutils.if_unlikely(builder, cgutils.is_null(builder, address)):
                convention.return_user_exc(builder, RuntimeError, (f"{name} was not found",))
            builder.store(address, known)
            builder.store(address, function)
        status, result = convention.call_function(builder, builder.load(function), returns, arguments, values)
        with cgutils.if_unlikely(builder, status.is_error):
            convention.return_status_propagate(builder, status)
        return result

    return call


def _after_context(arguments: Signature) -> Signature:
    """The signature with an argument before the others, as `intrinsic` wants it."""
    context = Parameter("typing_context", Parameter.POSITIONAL_OR_KEYWORD)
    return arguments.replace(parameters=[context, *arguments.parameters.values()])
