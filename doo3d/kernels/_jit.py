"""The decorators of functions that only kernels call."""

from __future__ import annotations

import numba

helper = numba.njit(cache=True, no_cpython_wrapper=True, no_cfunc_wrapper=True)
"""numba.njit without the wrappers for Python and C, which are a third of the time to compile a small function."""

inlined = numba.njit(cache=True, no_cpython_wrapper=True, no_cfunc_wrapper=True, inline="always")
"""A helper that becomes a part of its caller: for calls in inner loops, where counting references to arrays costs a fifth."""
