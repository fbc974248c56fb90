"""Count the work of a function: Python and C calls, elements that the kernels looked at, large arrays. No clock is read.

Calls are counted where doo3d's own lines make them, whatever NumPy or SciPy do inside, so that their versions do not matter.
Large arrays are counted by an allocator that takes the place of NumPy's, which NumPy lets a program do on every system.
"""

from __future__ import annotations

import ctypes
import gc
import os
import platform
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import CodeType, FrameType
from typing import Any

import numpy as np

import doo3d
from doo3d import kernels
from doo3d.runs.threads import ONE_THREAD

NAMES = ("crossing, mask given", "crossing", "stereo coil, ragged mask", "photograph, 3 cables, image", "cloud, 9,000 points")
"""The frames, as `doo3d bench` names them."""

SURROUNDINGS = os.environ | ONE_THREAD | {"PYTHONHASHSEED": "0"}
"""Environment of a process that counts: one thread, and sets have their order from the hash seed."""

LARGE = 400_000
"""Bytes from which on an array is large."""

WARM_UP_RUNS = 2
"""Runs before the counted ones, which import what is imported when first used and fill caches."""

SOURCES = str(Path(doo3d.__file__).parent)
INLINED = ("<listcomp>", "<dictcomp>", "<setcomp>")
"""Names of comprehensions, which are calls up to Python 3.11 only."""

DISPATCHER = "_dispatcher"
"""End of the names of the functions with which NumPy looks for other packages' arrays, before it calls the function itself."""


@dataclass(frozen=True)
class Work:
    """The work of one call.

    Attributes
    ----------
    calls
        Python and C calls that doo3d's code makes, with those of its own functions by others, and those of kernels.
    visits
        elements that the kernels looked at.
    large
        arrays of 400 kB or more that were allocated, by NumPy or by a kernel that returns them.
    """

    calls: int
    visits: int
    large: int


def versions() -> str:
    """Return the versions that counts depend on."""
    import cv2
    import scipy

    python = ".".join(platform.python_version_tuple()[:2])
    packages = f"NumPy {np.__version__}, SciPy {scipy.__version__}, OpenCV {cv2.__version__}"
    return f"Python {python}, {packages}, {platform.system()} {platform.machine()}"


def environment() -> str:
    """Return what counts depend on: the versions, and the instructions of the processor that NumPy uses."""
    found = np.show_config(mode="dicts")["SIMD Extensions"].get("found", [])
    return f"{versions()}, {' '.join(found)}"


def work_of(function: Callable[[], Any]) -> Work:
    """Return the work of a call of a function without arguments; it is called four times."""
    for _ in range(WARM_UP_RUNS):
        function()
    with _counted_kernels() as returned:
        calls = _calls_of(function)
        returned.clear()
        kernels.visits()
        large = large_arrays_of(function).total() + len(returned)
        return Work(calls, kernels.visits(), large)


def _calls_of(function: Callable[[], Any]) -> int:
    count = 0
    kinds: dict[CodeType, tuple[bool, bool]] = {}

    def kind_of(code: CodeType) -> tuple[bool, bool]:
        """Return whether code is doo3d's, and whether it counts if doo3d calls it."""
        if code not in kinds:
            counts = code.co_name not in INLINED and not code.co_name.endswith(DISPATCHER)
            kinds[code] = (code.co_filename.startswith(SOURCES), counts)
        return kinds[code]

    def profile(frame: FrameType, event: str, _: Any) -> None:
        nonlocal count
        if event == "c_call":
            count += kind_of(frame.f_code)[0]
        elif event == "call":
            own, counts = kind_of(frame.f_code)
            count += counts and (own or (frame.f_back is not None and kind_of(frame.f_back.f_code)[0]))

    gc.collect()
    gc.disable()
    sys.setprofile(profile)
    try:
        function()
    finally:
        sys.setprofile(None)
        gc.enable()
    return count


@contextmanager
def _counted_kernels() -> Iterator[list[int]]:
    """Make every call of a kernel one of a Python function, which a profiler sees; yield the sizes of large arrays returned."""
    returned: list[int] = []

    def counted(kernel: Callable[..., Any]) -> Callable[..., Any]:
        def call(*arguments: Any, **named: Any) -> Any:
            result = kernel(*arguments, **named)
            arrays = result if isinstance(result, tuple) else (result,)
            returned.extend(each.nbytes for each in arrays if isinstance(each, np.ndarray) and each.nbytes >= LARGE)
            return result

        return call

    natives = {name: kernel for name, kernel in vars(kernels._native).items() if not name.startswith("_")}
    functions = [native for native in natives.values() if not isinstance(native, type)]
    wrappers = {id(kernel): counted(kernel) for kernel in functions}
    places: list[tuple[Any, str, Any]] = [
        (module, name, value)
        for module in [module for name, module in sys.modules.items() if name.partition(".")[0] == "doo3d"]
        for name, value in vars(module).items()
        if id(value) in wrappers
    ]
    for native in natives.values():
        if isinstance(native, type):
            methods = [(name, each) for name, each in vars(native).items() if callable(each) and not name.startswith("__")]
            places += [(native, name, each) for name, each in methods]
            wrappers |= {id(each): counted(each) for _, each in methods}
    for place, name, value in places:
        setattr(place, name, wrappers[id(value)])
    try:
        yield returned
    finally:
        for place, name, value in places:
            setattr(place, name, value)


class _Allocator(ctypes.Structure):
    """PyDataMemAllocator of numpy/ndarraytypes.h."""

    _fields_ = (
        ("context", ctypes.c_void_p),
        ("malloc", ctypes.c_void_p),
        ("calloc", ctypes.c_void_p),
        ("realloc", ctypes.c_void_p),
        ("free", ctypes.c_void_p),
    )


class _Handler(ctypes.Structure):
    """PyDataMem_Handler of numpy/ndarraytypes.h, version 1."""

    _fields_ = (("name", ctypes.c_char * 127), ("version", ctypes.c_uint8), ("allocator", _Allocator))


_MALLOC = ctypes.PYFUNCTYPE(ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t)
_CALLOC = ctypes.PYFUNCTYPE(ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t, ctypes.c_size_t)
_REALLOC = ctypes.PYFUNCTYPE(ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t)
SET_HANDLER, GET_HANDLER = 304, 305
"""Places of PyDataMem_SetHandler and PyDataMem_GetHandler in NumPy's table of C functions, fixed since NumPy 1.22."""

_kept: list[Any] = []  # handlers of arrays that may still live


def large_arrays_of(function: Callable[[], Any]) -> Counter[str]:
    """Return how many large arrays NumPy allocates at each line of doo3d, such as "segment/segment.py:158".

    An allocator counts them and hands on to NumPy's own.
    """
    capsule_of, pointer_of = ctypes.pythonapi.PyCapsule_New, ctypes.pythonapi.PyCapsule_GetPointer
    capsule_of.restype, capsule_of.argtypes = ctypes.py_object, (ctypes.c_void_p, ctypes.c_char_p, ctypes.c_void_p)
    pointer_of.restype, pointer_of.argtypes = ctypes.c_void_p, (ctypes.py_object, ctypes.c_char_p)
    core = getattr(np, "_core", None) or np.core
    table = ctypes.cast(pointer_of(core._multiarray_umath._ARRAY_API, None), ctypes.POINTER(ctypes.c_void_p))
    set_handler = ctypes.PYFUNCTYPE(ctypes.py_object, ctypes.py_object)(table[SET_HANDLER])
    usual = ctypes.PYFUNCTYPE(ctypes.py_object)(table[GET_HANDLER])()
    own = ctypes.cast(pointer_of(usual, b"mem_handler"), ctypes.POINTER(_Handler)).contents.allocator
    malloc, calloc, realloc = _MALLOC(own.malloc), _CALLOC(own.calloc), _REALLOC(own.realloc)
    places: Counter[str] = Counter()

    def note(size: int) -> None:
        if size < LARGE:
            return
        frame = sys._getframe()
        while frame.f_back is not None and not frame.f_code.co_filename.startswith(SOURCES):
            frame = frame.f_back
        file = Path(frame.f_code.co_filename)
        places[f"{file.relative_to(SOURCES).as_posix() if file.is_relative_to(SOURCES) else file.name}:{frame.f_lineno}"] += 1

    def counting_malloc(context: int, size: int) -> int:
        note(size)
        return malloc(context, size)

    def counting_calloc(context: int, number: int, size: int) -> int:
        note(number * size)
        return calloc(context, number, size)

    def counting_realloc(context: int, pointer: int, size: int) -> int:
        note(size)
        return realloc(context, pointer, size)

    callbacks = (_MALLOC(counting_malloc), _CALLOC(counting_calloc), _REALLOC(counting_realloc))
    addresses = [ctypes.cast(callback, ctypes.c_void_p).value for callback in callbacks]
    handler = _Handler(b"counting", 1, _Allocator(own.context, *addresses, own.free))
    name = ctypes.create_string_buffer(b"mem_handler")
    _kept.append((usual, callbacks, handler, name))
    set_handler(capsule_of(ctypes.addressof(handler), name, None))
    try:
        function()
    finally:
        set_handler(usual)
    return places
