"""A compiled kernel as a function that Exudyn calls without Python in between; EXUGEAR_PORTABLE=1 switches it off.

`direct` is the only door. A run takes 2.6 times as long (gears that spin) or 1.8 times (on bearings) by way of Python.

pybind11 unwraps a callable that is itself a stateless C++ function of the wanted type: it reads the address of that
function out of the record behind the callable. `native_user_function` copies the record of one of Exudyn's own
functions and writes another address and type into it. At that address lie three instructions (`entries_with`) that hand
data of this function to the machine code of `ASSEMBLY`: it reads Exudyn's vectors and calls the kernel by numba's
convention, i32 (result, exception, arguments). Where the kernel raises, the code asks Python for the reason and throws
a C++ exception with that message.

This is a deliberate hack that nothing outside of this module depends on. It works on Linux x86-64 for the releases of
Exudyn, pybind11, numba and LLVM that have these records and conventions. So it is checked first, in a separate process
that may crash (`exugear.multibody.direct_call_check`), and the result is cached on disk. Where the check fails Exudyn
calls the kernel by way of Python: same numbers, slower. The printed plan of a model states which call is used, and why.
"""

import ctypes
import mmap
import os
import platform
import subprocess
import sys
from _thread import interrupt_main
from collections.abc import Callable, Sequence
from ctypes import CFUNCTYPE, POINTER, PYFUNCTYPE, addressof, c_char_p, c_double, c_int, c_uint64, c_void_p, py_object
from functools import cache
from importlib.metadata import version
from inspect import CO_VARARGS
from pathlib import Path
from traceback import print_exc
from types import SimpleNamespace
from typing import Any
from zlib import crc32

import exudyn as exu
import llvmlite.binding as llvm
import numpy as np
from numba import types

from exugear.multibody.addresses import address_of
from fem.support.cache import cached
from fem.support.progress import announced

#: Function record of pybind11 2.13 in words of 8 bytes: its size; positions of name, function, its type, next overload.
WORDS, NAME, FUNCTION, TYPE, NEXT = 17, 0, 7, 8, 16
Record = c_uint64 * WORDS
#: Type of vector<double> (*)(const MainSystem&, double, int, vector<double>, vector<double>), as C++ mangles it.
SIGNATURE = b"PFSt6vectorIdSaIdEERK10MainSystemdiS1_S1_E"
#: Time limit of the check [s], which takes 3 s.
TIME_LIMIT = 60
#: The check in a new process. An empty package stands in for exugear: importing all of it would take as long again.
SCRIPT = """
import sys, types
sys.exudynFast = {fast}
sys.modules["exugear"] = types.ModuleType("exugear")
sys.modules["exugear"].__path__ = [{folder!r}]
from exugear.multibody.direct_call_check import check
check()
"""
#: The only platform with these records and calling conventions.
PLATFORM = "linux", "x86_64", "CPython"
#: Longest quotation of the check's error output.
LONGEST_QUOTE = 200
PACKAGES = "exudyn", "numba", "llvmlite", "numpy"
#: Longest message of an exception [bytes].
LONGEST_MESSAGE = 1000

#: What Exudyn calls (contact) and what Python calls (call). A vector<double> is three pointers: begin, end, capacity.
#: data: kernel, compile, explain, portable, addresses of the records. LLVM passes a nest argument in the register r10.
#: The kernel is compiled at the first call: a model that is drawn does without, and modes compile contacts alone.
ASSEMBLY = """
define ptr @contact(ptr nest %data, ptr %forces, ptr %system, double %t, i32 %item, ptr %q, ptr %q_t) {{
entry:
  %exception = alloca ptr
  %begin = call ptr {new}(i64 {size})
  %coordinates = load ptr, ptr %q
  %velocities = load ptr, ptr %q_t
  {loads}
  %known = load ptr, ptr %data
  %is_known = icmp ne ptr %known, null
  br i1 %is_known, label %run, label %first
first:
  %compile.at = getelementptr ptr, ptr %data, i64 1
  %compile = load ptr, ptr %compile.at
  %new = call ptr %compile()
  store ptr %new, ptr %data
  %is_compiled = icmp ne ptr %new, null
  br i1 %is_compiled, label %run, label %failure
run:
  %kernel = phi ptr [ %known, %entry ], [ %new, %first ]
  %status = call i32 %kernel(ptr %begin, ptr %exception, {addresses}, double %t, {state})
  %succeeded = icmp eq i32 %status, 0
  br i1 %succeeded, label %success, label %failure
success:
  %end = getelementptr i8, ptr %begin, i64 {size}
  %forces.1 = getelementptr i8, ptr %forces, i64 8
  %forces.2 = getelementptr i8, ptr %forces, i64 16
  store ptr %begin, ptr %forces
  store ptr %end, ptr %forces.1
  store ptr %end, ptr %forces.2
  ret ptr %forces
failure:
  call void {delete}(ptr %begin)
  %explain.at = getelementptr ptr, ptr %data, i64 2
  %explain = load ptr, ptr %explain.at
  %message = call ptr %explain(double %t, ptr %coordinates, ptr %velocities)
  %never = musttail call ptr {throw}(ptr nest %data, ptr %message, ptr %system, double %t, i32 %item, ptr %q, ptr %q_t)
  ret ptr %never
}}
define ptr @call(ptr nest %data, ptr %self, ptr %arguments) {{
  %portable.at = getelementptr ptr, ptr %data, i64 3
  %portable = load ptr, ptr %portable.at
  %result = tail call ptr {python}(ptr %portable, ptr %arguments)
  ret ptr %result
}}
"""
#: Number of data before the addresses of the records.
BEFORE_ADDRESSES = 4
#: x86-64: r10 = data; r11 = code; jump to r11.
SET_R10, SET_R11, JUMP_TO_R11 = b"\x49\xba", b"\x49\xbb", b"\x41\xff\xe3"


def direct(
    function: Callable, kernel, records: Sequence[np.record | None], n: int, pointed_to: object = None
) -> Callable:
    """The user function that Exudyn calls without Python where that works; it keeps the records alive.

    function     (mbs, t, item, q, q_t) -> forces of n coordinates: what Exudyn calls elsewhere, and Python always
    kernel       compiled (*addresses of the records, t, *q, *q_t), which the function calls, too; None: address 0
    pointed_to   what the records hold addresses of: it is kept alive, too
    """
    vars(function)["kept"] = records, pointed_to
    return function if obstacle() else native_user_function(function, kernel, tuple(map(address_of, records)), n)


def call_path() -> str:
    """How Exudyn calls contacts, for the printed plan."""
    return f"by way of Python ({obstacle()})" if obstacle() else "called without Python"


def obstacle() -> str:
    """Why Exudyn calls contacts by way of Python; empty where it calls them directly."""
    requested = os.environ.get("EXUGEAR_PORTABLE", "") not in ("", "0")
    return "EXUGEAR_PORTABLE requests it" if requested else _obstacle()


@cache
def _obstacle() -> str:
    system = sys.platform, platform.machine(), platform.python_implementation()
    if system != PLATFORM:
        return f"only {' '.join(PLATFORM)} can do without, this is {' '.join(system)}"
    if "python" not in Path(sys.executable).name:
        return f"the check needs python as a separate process, not {sys.executable}"
    try:
        return str(cached(_circumstances(), lambda: {"obstacle": np.array(_failure_of_check())})["obstacle"])
    except (AttributeError, OSError, subprocess.TimeoutExpired) as error:
        return f"the direct call could not be checked: {error}"


def _circumstances() -> str:
    """All that the result of the check may depend on: the key under which it is cached."""
    packages = [f"{name} {version(name)}" for name in PACKAGES]
    sources = sorted(Path(__file__).parent.glob("direct_call*.py"))
    source = str(crc32(b"".join(path.read_bytes() for path in sources)))
    system = sys.version, *platform.libc_ver(), os.environ.get("LD_PRELOAD", "")
    return "\n".join(["check of the direct call", SCRIPT, source, exu.Help.__module__, *packages, *system])


def _failure_of_check() -> str:
    """How the check failed, with the end of its error output; empty where it passed."""
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path)), "PYTHONWARNINGS": "ignore"}
    fast, folder = exu.Help.__module__.endswith("fast"), str(Path(__file__).parents[1])
    command = [sys.executable, "-P", "-c", SCRIPT.format(fast=fast, folder=folder)]
    with announced("checking whether Exudyn can call the compiled contact without Python", once=True):
        ended = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=TIME_LIMIT)
    quote = " ".join(ended.stderr.split())[-LONGEST_QUOTE:] or "no message"
    return f"its check ended with {ended.returncode}: {quote}" if ended.returncode else ""


class Method(ctypes.Structure):
    """CPython's PyMethodDef."""

    _fields_ = (("name", c_char_p), ("call", c_void_p), ("flags", c_int), ("doc", c_char_p))


def python_api_function(name: str, result, *arguments):
    """A function of CPython."""
    return PYFUNCTYPE(result, *arguments)((name, ctypes.pythonapi))


def native_user_function(portable, kernel, addresses: tuple[int, ...], n: int):
    """The user function portable(mbs, t, item, q, q_t) of n coordinates, as a function that Exudyn calls directly.

    kernel, addresses   the compiled kernel(*addresses, t, *q, *q_t) that portable calls, and its integers

    Called from Python it runs portable, which it keeps alive. Raises ValueError where Exudyn's functions have records
    of another layout.
    """
    name, record = record_of_exudyn()
    keep = SimpleNamespace(portable=portable, kernel=kernel, message=ctypes.create_string_buffer(LONGEST_MESSAGE))
    explain = explaining(portable, n, keep.message)
    keep.explain = CFUNCTYPE(c_void_p, c_double, POINTER(c_double), POINTER(c_double))(explain)
    keep.compile = CFUNCTYPE(c_void_p)(compiling(kernel, len(addresses), n))
    functions = code_address(keep.compile), code_address(keep.explain), id(portable)
    keep.data = (c_uint64 * (BEFORE_ADDRESSES + len(addresses)))(0, *functions, *addresses)
    code = machine_code(len(addresses), n)
    keep.entries = entries_with(keep.data, [code.get_function_address(name) for name in ("contact", "call")])
    contact, call = (keep.entries.ctypes.data + i * keep.entries.itemsize for i in range(2))
    keep.name = ctypes.create_string_buffer(SIGNATURE)
    keep.type = (c_uint64 * 2)(0, addressof(keep.name))
    record[FUNCTION], record[TYPE] = contact, addressof(keep.type)
    keep.record = record
    keep.method = Method(portable.__name__.encode(), call, 1, None)
    capsule = python_api_function("PyCapsule_New", py_object, c_void_p, c_void_p, c_void_p)(
        addressof(record), name, None
    )
    function = python_api_function("PyCFunction_NewEx", py_object, c_void_p, py_object, py_object)
    return function(addressof(keep.method), capsule, keep)


def record_of_exudyn():
    """Name of the capsules that hold records, and a copy of the record of exudyn.Help; ValueError for other layouts."""
    function: Any = exu.Help
    capsule = function.__self__
    name = python_api_function("PyCapsule_GetName", c_void_p, py_object)(capsule)
    record = Record.from_address(
        python_api_function("PyCapsule_GetPointer", c_void_p, py_object, c_void_p)(capsule, name)
    )
    texts = ctypes.string_at(record[NAME]), ctypes.string_at((c_uint64 * 2).from_address(record[TYPE])[1])
    if texts != (b"Help", b"PFvvE") or record[NEXT] != 0:
        raise ValueError("Exudyn's functions have records of another layout")
    return name, Record(*record)


def entry_of(kernel, number: int, n: int) -> int:
    """Address of the compiled code of a kernel that takes a number of addresses, for n coordinates.

    Coordinates and velocities that a kernel takes as *x are one tuple to numba, as where Python calls it: the same code
    serves both.
    """
    state: tuple = (types.float64,) * (2 * n)
    if kernel.py_func.__code__.co_flags & CO_VARARGS:
        state = (types.UniTuple(types.float64, 2 * n),)
    arguments = (types.int64,) * number + (types.float64, *state)
    kernel.compile(arguments)
    overload = kernel.overloads[arguments]
    if overload.signature.return_type != types.UniTuple(types.float64, n):
        raise ValueError(f"a kernel must return {n} floats")
    return overload.library.get_pointer_to_function(overload.fndesc.llvm_func_name)


def assembly(number: int, n: int) -> str:
    """`ASSEMBLY` for kernels of a number of addresses and n coordinates."""
    cpp = ctypes.CDLL("libstdc++.so.6")
    symbols = {
        "new": code_address(cpp._Znwm),
        "delete": code_address(cpp._ZdlPv),
        "throw": code_address(cpp._ZSt21__throw_runtime_errorPKc),
        "python": code_address(ctypes.pythonapi.PyObject_CallObject),
    }
    loads = [
        f"%{array}.{i} = getelementptr {kind}, ptr %{array}, i64 {i}\n  %{x}.{i} = load {kind}, ptr %{array}.{i}"
        for array, kind, x, entries in (
            ("coordinates", "double", "q", range(n)),
            ("velocities", "double", "v", range(n)),
            ("data", "i64", "address", range(BEFORE_ADDRESSES, BEFORE_ADDRESSES + number)),
        )
        for i in entries
    ]
    return ASSEMBLY.format(
        size=8 * n,
        loads="\n  ".join(loads),
        addresses=", ".join(f"i64 %address.{BEFORE_ADDRESSES + i}" for i in range(number)),
        state=", ".join(f"double %{x}.{i}" for x in "qv" for i in range(n)),
        **{name: f"inttoptr (i64 {address} to ptr)" for name, address in symbols.items()},
    )


def code_address(function) -> int:
    """Address of the machine code of a ctypes function."""
    return ctypes.cast(function, c_void_p).value or 0


@cache
def machine_code(number: int, n: int):
    """Engine that holds the machine code of `assembly`."""
    machine = llvm.Target.from_default_triple().create_target_machine(opt=2)
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(assembly(number, n)), machine)
    engine.finalize_object()
    return engine


def entries_with(data, codes: Sequence[int]) -> np.ndarray:
    """Executable memory (n, 32 bytes): each row hands data to one of the codes at these addresses (n,)."""
    flags, prot = mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS, mmap.PROT_READ | mmap.PROT_WRITE | mmap.PROT_EXEC
    memory = mmap.mmap(-1, mmap.PAGESIZE, flags, prot)
    entries = np.frombuffer(memory, "S32", len(codes))
    for i, code in enumerate(codes):
        words = (address.to_bytes(8, "little") for address in (addressof(data), code))
        entries[i] = SET_R10 + next(words) + SET_R11 + next(words) + JUMP_TO_R11
    return entries


def compiling(kernel, number: int, n: int):
    """The function that compiles a kernel and returns its address: 0 where that fails, of which `explaining` tells why.

    It is called from C++ and must not raise.
    """

    def compile() -> int:
        try:
            return entry_of(kernel, number, n)
        except KeyboardInterrupt:
            interrupt_main()  # raises KeyboardInterrupt again where the reason is asked for
        except BaseException:
            print_exc()
        return 0

    return compile


def explaining(portable, n: int, message):
    """The function (t, q, q_t) that writes into message the error that portable raises, and returns its address.

    It is called from C++ and must not raise.
    """

    def explain(t, q, q_t):
        try:
            portable(None, t, 0, q[:n], q_t[:n])
            message.value = b"the compiled contact failed\n"
        except KeyboardInterrupt:
            message.value = b"interrupted\n"
            interrupt_main()  # raises KeyboardInterrupt again once C++ has returned
        except BaseException as error:
            message.value = f"{type(error).__name__}: {error}\n".encode()[: LONGEST_MESSAGE - 1]
        return addressof(message)

    return explain
