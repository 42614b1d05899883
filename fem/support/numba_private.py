"""Private parts of numba that shorten compilation, and renew kept code when a callee changes.

`fem.support.numba_cache` takes them from this module for the versions of numba with which they were tested, `TESTED`
there, and works without them.

- Only the root of a call tree becomes machine code (`callee`, `whole_call_tree`). Numba optimizes each function
  together with all that it calls, and translates it into machine code: code n levels deep in a call tree is optimized n
  times, though it runs only where it is inlined into the root. That takes two thirds of the time of compilation. Here
  the functions that a root calls are neither optimized nor translated, but linked to it.
- Types are inferred once (`types_inferred_once`). Wherever an operation occurs, numba tries the overloads of its name
  in turn, of which an index or a product has dozens. That takes a sixth of the time that is left.
- Between the passes over a function numba computes the lifetimes of its variables some nine times, of which three
  count, and the text of its types for listeners (`without_idle_work`). That takes a tenth of what is left.
- A version of a function for each whole number that a caller knows would add a fifth to the functions of a contact on
  bearings (`Callee.get_call_template`).
- Code on disk is renewed when the source of a callee changes, and survives damaged files (`stamped_cache`): numba
  itself checks the file of the function alone.

Together they make the first compilation three times as fast (shafts that spin 3.1, on bearings 3.4 times).
"""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cached_property, partial
from typing import Any

from numba import njit
from numba.core.codegen import JITCodeLibrary
from numba.core.environment import lookup_environment
from numba.core.errors import TypingError
from numba.core.postproc import PostProcessor, VariableLifetime
from numba.core.registry import CPUDispatcher, cpu_target
from numba.core.targetconfig import ConfigStack
from numba.core.transforms import canonicalize_cfg
from numba.core.types import BaseFunction, IntegerLiteral, Record, Type, unliteral

#: Options of numba for functions that Python does not call.
NO_WRAPPERS = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
#: Numba's type of functions with overloads; its `get_call_type` returns the signature for the types of arguments.
OVERLOADED: Any = BaseFunction
#: Numba's class that prepares a function between passes, and its type of records.
PROCESSOR: Any = PostProcessor
RECORD: Any = Record
#: Signatures by function, types of arguments, and the liberties taken with floating-point numbers.
SIGNATURES: dict[tuple, Any] = {}


class TreeLibrary(JITCodeLibrary):
    """Code of a function; machine code as soon as the address of one of its functions is requested."""

    @property
    def codegen(self) -> Any:
        """Numba's code generator, or before there is machine code, one that sets no addresses in it."""
        return self._codegen if self._finalized else _WithoutMachineCode

    def _optimize_functions(self, ll_module) -> None:
        """Only the whole tree is optimized."""
        ll_module.data_layout = self._codegen._data_layout

    def _ensure_finalized(self) -> None:
        """Do not make machine code where a library is linked to another one."""

    def get_pointer_to_function(self, name: str) -> int:
        if not self._finalized and name in {function.name for function in self.get_defined_functions()}:
            self.finalize()
        return super().get_pointer_to_function(name)

    def finalize(self) -> None:
        """Optimize the whole tree and make machine code of it."""
        self._raise_if_finalized()
        self._codegen._check_llvm_bugs()
        self._shared_module = None  # that of this function alone, which would be linked to further trees
        self._link_callees(self._final_module)
        self._optimize_final_module()
        self._final_module.verify()
        self._finalize_final_module()
        for variable in self._final_module.global_variables:
            environment = lookup_environment(variable.name)
            if environment is not None:
                self.codegen.set_env(variable.name, environment)

    def _get_module_for_linking(self):
        """Module of the whole tree."""
        if self._finalized:
            return super()._get_module_for_linking()
        module = self._root().clone()
        self._link_callees(module)
        return module

    def _root(self):
        """Module of this function alone."""
        return super()._get_module_for_linking()

    def _link_callees(self, module) -> None:
        """Link the functions that this one calls, and those that they call, to a module."""
        callees: dict[Any, None] = {}
        self._add_callees(callees)
        for library in callees:
            is_tree = isinstance(library, TreeLibrary) and not library._finalized
            module.link_in(library._root() if is_tree else library._get_module_for_linking(), preserve=True)
            getattr(self, "_reload_init", set()).update(getattr(library, "_reload_init", ()))

    def _add_callees(self, callees: dict[Any, None]) -> None:
        """Add the libraries of the tree below this function as keys."""
        for library in self._linking_libraries:
            if library not in callees:
                callees[library] = None
                if isinstance(library, TreeLibrary) and not library._finalized:
                    library._add_callees(callees)


class _WithoutMachineCode:
    """Code generator of a library without machine code."""

    @staticmethod
    def set_env(name, environment) -> None:
        """The root sets the environments of all functions."""


class Callee(CPUDispatcher):
    """A function that compiled code calls, without code to call it from Python: Python calls another version."""

    #: Whether it stays a function in the machine code of its root.
    apart = False

    @cached_property
    def for_python(self) -> Any:
        """The function as numba compiles it alone."""
        options = {name: value for name, value in self.targetoptions.items() if name not in NO_WRAPPERS}
        return njit(self.py_func, **{name: value for name, value in options.items() if name != "nopython"})

    def get_call_template(self, args, kws):
        """The version for types of arguments, whole numbers that the caller knows taken as any whole numbers.

        Else each of them would have a version of its own. Where none is found so, as of a tuple of so many floats, the
        number counts.
        """
        with suppress(TypingError):
            return super().get_call_template(_any_numbers(args), _any_numbers(kws))
        return super().get_call_template(args, kws)

    def add_overload(self, cres) -> None:
        """Store a version without making it known to Python."""
        self.overloads[tuple(cres.signature.args)] = cres
        if self.apart:
            # of LLVM; numba has no such option
            cres.library.get_function(cres.fndesc.llvm_func_name).add_function_attribute("noinline")

    def _compile_for_args(self, *arguments, **keywords):
        """Compiled version for a call from Python."""
        return self.for_python._compile_for_args(*arguments, **keywords)


def _any_numbers(kinds):
    """Types of arguments (tuple or, by name, dict) without the values of whole numbers."""
    if isinstance(kinds, dict):
        return dict(zip(kinds, _any_numbers(kinds.values()), strict=True))
    return tuple(unliteral(kind) if isinstance(kind, IntegerLiteral) else kind for kind in kinds)


def callee(function=None, *, apart: bool = False, **options) -> Any:
    """Decorator like `numba.njit` for functions that compiled code calls.

    apart   never inlined: for code that is long or rarely run

    Numba passes `forceinline` on to all that such a function calls, where it is the first to call it: a law of 20
    functions then grew to 118,000 instructions, a minute of compilation, or did not, by the order of compilations in a
    process. Here it holds for the function that asks for it only. A function should not be an argument of another one:
    where the latter is not inlined, its code contains an address, and numba warns that it does not keep it.
    """
    if function is None:
        return partial(callee, apart=apart, **options)
    options = {"forceinline": False} | options
    dispatcher = Callee(function, targetoptions={"nopython": True, "boundscheck": None, **NO_WRAPPERS, **options})
    dispatcher.apart = apart
    return dispatcher


@contextmanager
def whole_call_tree() -> Iterator[None]:
    """Context in which a call tree is compiled as a whole, under numba's lock."""
    codegen: Any = cpu_target.target_context.codegen()
    codegen._library_class = TreeLibrary
    try:
        yield
    finally:
        del codegen._library_class


@contextmanager
def types_inferred_once() -> Iterator[None]:
    """Context, under numba's lock, in which signatures that were inferred before are taken again."""
    infer = OVERLOADED.get_call_type

    def remembered(function, typing_context, arguments, keywords):
        call = function, tuple(arguments), tuple(keywords.items()), _fast_math()
        if call not in SIGNATURES:
            SIGNATURES[call] = infer(function, typing_context, arguments, keywords)
        return SIGNATURES[call]

    OVERLOADED.get_call_type = remembered
    try:
        yield
    finally:
        OVERLOADED.get_call_type = infer


@contextmanager
def without_idle_work() -> Iterator[None]:
    """Context, under numba's lock, in which passes leave out what only generators and object mode need, and texts."""
    run, text = PROCESSOR.run, RECORD.__repr__

    def run_before_lowering(processor, emit_dels: bool = False, extend_lifetimes: bool = False):
        function = processor.func_ir
        if emit_dels or function.is_generator:
            run(processor, emit_dels, extend_lifetimes)
        else:
            function.blocks = canonicalize_cfg(function.blocks)
            function.variable_lifetime, function.generator_info = VariableLifetime(function.blocks), None

    PROCESSOR.run, RECORD.__repr__ = run_before_lowering, Type.__repr__
    try:
        yield
    finally:
        PROCESSOR.run, RECORD.__repr__ = run, text


def _fast_math() -> frozenset[str]:
    """Numba's flags of `fastmath` for the function that it compiles: overloads are compiled with them, too."""
    flags: Any = ConfigStack.top_or_none()
    return frozenset(flags.fastmath.flags) if flags else frozenset()


def stamped_cache(dispatcher, stamp: int) -> None:
    """Let numba's cache of a function on disk hold for a stamp of its sources, instead of that of its file alone.

    Where its files are damaged the function is compiled anew; where no room is left it is not saved.
    """
    on_disk: Any = dispatcher._cache
    index = type(on_disk._cache_file)
    names = {"cache_path": on_disk.cache_path, "filename_base": on_disk._impl.filename_base}
    on_disk._cache_file = index(**names, source_stamp=stamp)
    load, save = on_disk.load_overload, on_disk.save_overload

    def load_overload(*arguments):
        try:
            return load(*arguments)
        except Exception:
            with suppress(Exception):
                on_disk.flush()
            return None

    def save_overload(*arguments):
        with suppress(OSError):
            save(*arguments)

    on_disk.load_overload, on_disk.save_overload = load_overload, save_overload
