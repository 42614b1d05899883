"""A compiled kernel as a function that Exudyn calls without Python: a deliberate hack, kept in this one place.

pybind11 unwraps a callable that is itself a stateless C++ function of the wanted type: it reads that function's address
out of the record behind the callable. `forged` copies the record of one of Exudyn's own functions and writes another
address and type into it. At that address stands the code of `ASSEMBLY`: it takes Exudyn's vectors apart and calls the
kernel by numba's convention, i32 (result, exception, arguments). Where the kernel raises, it asks Python why and leaves
by a C++ exception with that message.

All this holds on Linux x86-64 for those releases of Exudyn, pybind11 and numba whose records and conventions are these.
`exugear.elements.native.native` has it tried in a process of its own first.
"""

import ctypes
from ctypes import CFUNCTYPE, POINTER, PYFUNCTYPE, addressof, c_char_p, c_double, c_int, c_uint64, c_void_p, py_object
from types import SimpleNamespace

import exudyn as exu
import llvmlite.binding as llvm
from numba import types

#: Words of the function record of pybind11 2.13: name, function, its type, next overload.
WORDS, NAME, FUNCTION, TYPE, NEXT = 17, 0, 7, 8, 16
Record = c_uint64 * WORDS
#: vector<double> (*)(const MainSystem&, double, int, vector<double>, vector<double>)
SIGNATURE = b"PFSt6vectorIdSaIdEERK10MainSystemdiS1_S1_E"
#: Longest message.
ROOM = 1000

#: What Exudyn calls, and what Python calls. A vector<double> is three pointers: begin, end, end of its room.
ASSEMBLY = """
define ptr @contact(ptr %forces, ptr %system, double %t, i32 %item, ptr %q, ptr %q_t) {{
  %exception = alloca ptr
  %begin = call ptr {new}(i64 {size})
  %one = load ptr, ptr %q
  %two = load ptr, ptr %q_t
  {loads}
  %status = call i32 {kernel}(ptr %begin, ptr %exception, {addresses}, double %t, {state})
  %well = icmp eq i32 %status, 0
  br i1 %well, label %good, label %bad
good:
  %end = getelementptr i8, ptr %begin, i64 {size}
  %forces.1 = getelementptr i8, ptr %forces, i64 8
  %forces.2 = getelementptr i8, ptr %forces, i64 16
  store ptr %begin, ptr %forces
  store ptr %end, ptr %forces.1
  store ptr %end, ptr %forces.2
  ret ptr %forces
bad:
  call void {delete}(ptr %begin)
  %message = call ptr {explain}(double %t, ptr %one, ptr %two)
  %never = musttail call ptr {throw}(ptr %message, ptr %system, double %t, i32 %item, ptr %q, ptr %q_t)
  ret ptr %never
}}
define ptr @call(ptr %self, ptr %arguments) {{
  %result = tail call ptr {python}(ptr {portable}, ptr %arguments)
  ret ptr %result
}}
"""


class Method(ctypes.Structure):
    """CPython's PyMethodDef."""

    _fields_ = (("name", c_char_p), ("call", c_void_p), ("flags", c_int), ("doc", c_char_p))


def python(name: str, result, *arguments):
    """A function of CPython."""
    return PYFUNCTYPE(result, *arguments)((name, ctypes.pythonapi))


def forged(portable, kernel, addresses: tuple[int, ...], n: int):
    """The user function portable(mbs, t, item, q, q_t) of n coordinates as one that Exudyn calls without Python.

    kernel, addresses   the compiled kernel(*addresses, t, *q, *q_t) that portable calls, and its integers

    Called from Python it is portable, and keeps that alive. ValueError where this Exudyn's functions look different.
    """
    name, record = help_of_exudyn()
    keep = SimpleNamespace(portable=portable, kernel=kernel, said=ctypes.create_string_buffer(ROOM))
    explain = explaining(portable, n, keep.said)
    keep.explain = CFUNCTYPE(c_void_p, c_double, POINTER(c_double), POINTER(c_double))(explain)
    keep.code = compiled(text_of(entry_of(kernel, len(addresses), n), addresses, n, keep))
    keep.name = ctypes.create_string_buffer(SIGNATURE)
    keep.type = (c_uint64 * 2)(0, addressof(keep.name))
    record[FUNCTION], record[TYPE] = keep.code.get_function_address("contact"), addressof(keep.type)
    keep.record = record
    keep.method = Method(portable.__name__.encode(), keep.code.get_function_address("call"), 1, None)
    capsule = python("PyCapsule_New", py_object, c_void_p, c_void_p, c_void_p)(addressof(record), name, None)
    function = python("PyCFunction_NewEx", py_object, c_void_p, py_object, py_object)
    return function(addressof(keep.method), capsule, keep)


def help_of_exudyn():
    """Name of the capsules that hold records, and a copy of the record of exudyn.Help; ValueError for other layouts."""
    capsule = exu.Help.__self__  # type: ignore[attr-defined]
    name = python("PyCapsule_GetName", c_void_p, py_object)(capsule)
    record = Record.from_address(python("PyCapsule_GetPointer", c_void_p, py_object, c_void_p)(capsule, name))
    named = ctypes.string_at(record[NAME]), ctypes.string_at((c_uint64 * 2).from_address(record[TYPE])[1])
    if named != (b"Help", b"PFvvE") or record[NEXT] != 0:
        raise ValueError("Exudyn's functions have other records")
    return name, Record(*record)


def entry_of(kernel, number: int, n: int) -> int:
    """Address of the compiled code of a kernel of a number of addresses, for n coordinates."""
    _, _, arguments, _ = kernel.get_call_template((types.int64,) * number + (types.float64,) * (1 + 2 * n), {})
    found = kernel.overloads[arguments]
    if found.signature.return_type != types.UniTuple(types.float64, n):
        raise ValueError(f"a kernel must return {n} floats")
    return found.library.get_pointer_to_function(found.fndesc.llvm_func_name)


def text_of(entry: int, addresses: tuple[int, ...], n: int, keep) -> str:
    """LLVM's text for a kernel of n coordinates."""
    cpp = ctypes.CDLL("libstdc++.so.6")
    places = {
        "kernel": entry,
        "new": place_of(cpp._Znwm),
        "delete": place_of(cpp._ZdlPv),
        "throw": place_of(cpp._ZSt21__throw_runtime_errorPKc),
        "explain": place_of(keep.explain),
        "portable": id(keep.portable),
        "python": place_of(ctypes.pythonapi.PyObject_CallObject),
    }
    steps = [
        f"%{place}.{i} = getelementptr double, ptr %{place}, i64 {i}\n  %{x}.{i} = load double, ptr %{place}.{i}"
        for place, x in (("one", "q"), ("two", "v"))
        for i in range(n)
    ]
    return ASSEMBLY.format(
        size=8 * n,
        loads="\n  ".join(steps),
        addresses=", ".join(f"i64 {place}" for place in addresses),
        state=", ".join(f"double %{x}.{i}" for x in "qv" for i in range(n)),
        **{name: f"inttoptr (i64 {place} to ptr)" for name, place in places.items()},
    )


def place_of(function) -> int:
    return ctypes.cast(function, c_void_p).value or 0


def compiled(text: str):
    """Engine that holds the code of a text."""
    machine = llvm.Target.from_default_triple().create_target_machine(opt=2)
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(text), machine)
    engine.finalize_object()
    return engine


def explaining(portable, n: int, said):
    """The function (t, q, q_t) that writes what portable raises there and returns the address; it must not raise."""

    def explain(t, q, q_t):
        try:
            portable(None, t, 0, q[:n], q_t[:n])
            said.value = b"the compiled contact failed\n"
        except BaseException as error:
            said.value = f"{type(error).__name__}: {error}\n".encode()[: ROOM - 1]
        return addressof(said)

    return explain
