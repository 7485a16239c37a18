"""Compilation of the inner loops of all packages.

Machine code is kept on disk under what it depends on (see `identity`): it can never be older than what it calls or than
a constant it reads, and an edit costs only the functions that it concerns their compilation.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

import numba
from numba.core import types
from numba.core.caching import FunctionCache

from gearbench.kernels.folders import code_folder
from gearbench.kernels.identity import identity

CONFIG: Any = numba.config
# Division by zero gives infinity, as in numpy; nobody calls these through C function pointers. What a function does not
# say of fast mathematics it would have from whichever caller it is first compiled for.
OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True, "fastmath": False}
# Of what compiled code alone calls: the entrance from Python unpacks every array of every named tuple, which takes as
# long to compile as a small function does. Called from Python all the same, it is compiled anew with one.
INNER: dict[str, Any] = {"no_cpython_wrapper": True}
# Of a helper of one loop: part of its caller's machine code, so that handing over named tuples of arrays costs nothing
# (a call counts references to each array and copies them all).
INLINED: dict[str, Any] = {"forceinline": True} | INNER
# For `fastmath`: only what cannot change a result beyond rounding, which is fused multiply-add, free order of sums,
# signs of zero, reciprocals.
ROUNDING = {"contract", "reassoc", "nsz", "arcp"}


def compiled(function: Callable[..., Any] | None = None, /, **options: Any) -> Any:
    """`numba.njit` that releases the interpreter lock and keeps its machine code on disk.

    Used as `@compiled`, or with options of `numba.njit` beside OPTIONS as `@compiled(fastmath=ROUNDING)`. What the
    function reads from its module must be defined above it and be numbers, arrays, tuples or compiled; else TypeError.
    Where the folder cannot be written the function is compiled anew in every process.
    """
    if function is None:
        return partial(compiled, **options)
    chosen = OPTIONS | options
    key = identity(function, chosen)
    dispatcher: Any = numba.njit(function, **chosen)
    if not CONFIG.DISABLE_JIT:
        with suppress(OSError, RuntimeError):
            dispatcher._cache = _kept(function, code_folder(f"{function.__module__}.{function.__qualname__}", key))
        if chosen.get("no_cpython_wrapper"):
            _enter_elsewhere(dispatcher, numba.njit(function, **chosen | {"no_cpython_wrapper": False}))
    return dispatcher


def is_kept(function: Any) -> bool:
    """Whether machine code of a compiled function is on disk, for whatever arguments."""
    folder = getattr(function._cache, "cache_path", None)
    return folder is not None and any(Path(folder).glob("*.nbc"))


def compile_like(function: Any, arguments: tuple[Any, ...]) -> None:
    """Compile a compiled function for arguments like these, without calling it."""
    function.compile(tuple(numba.typeof(one) for one in arguments))


def _enter_elsewhere(inner: Any, entered: Any) -> None:
    """Let Python's calls of `inner`, which has no entrance, compile and call `entered`: Numba would jump to nowhere."""

    def add_overload(result: Any) -> None:
        inner.overloads[tuple(result.signature.args)] = result  # for compiled callers; Python's calls never find it

    inner.add_overload, inner._compile_for_args = add_overload, entered._compile_for_args


def _kept(function: Callable[..., Any], folder: Path) -> FunctionCache:
    """The function's cache in this folder and nowhere else. Raises RuntimeError where it cannot be written."""
    before = CONFIG.CACHE_DIR
    CONFIG.CACHE_DIR = str(folder)
    try:
        cache = _Cache(function)
    finally:
        CONFIG.CACHE_DIR = before
    if not Path(cache.cache_path).is_relative_to(folder):
        raise RuntimeError(f"{folder} cannot be written")
    return cache


class _Cache(FunctionCache):
    """Numba's cache of one function. It tells apart named tuples whose fields have changed places, and costs time but
    never the result where it is damaged or cannot be written."""

    def _index_key(self, sig: Any, codegen: Any) -> Any:
        return *super()._index_key(sig, codegen), _fields(sig)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        try:
            return super().load_overload(sig, target_context)
        except Exception:  # unpickling damaged files raises anything
            with suppress(OSError):
                self.flush()
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        with suppress(OSError):
            super().save_overload(sig, data)


def _fields(kind: Any) -> tuple[Any, ...]:
    """Names of the fields of all named tuples in a signature or a type of it."""
    if isinstance(kind, (tuple, types.Tuple, types.UniTuple, types.NamedTuple, types.NamedUniTuple)):
        return (*getattr(kind, "fields", ()), *(inner for one in kind for inner in _fields(one)))
    inner = getattr(kind, "dtype", getattr(kind, "type", None))
    return _fields(inner) if isinstance(inner, types.Type) else ()
