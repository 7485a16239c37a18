"""What the machine code of a function depends on, as one hash.

Compiling freezes what a function reads: its own instructions, the constants it finds in its module, wherever those come
from, the functions it calls with all that these depend on, and the fields of the named tuples that it makes. Numba
renews kept machine code only when the function's own file changes. The hash is therefore taken of the values
themselves: whatever edit changes one of them changes it, in whichever file or package, and no other edit does. The
fields of named tuples that come as arguments are not known before the call; `compiled` adds them there.
"""

from __future__ import annotations

import dis
import hashlib
from collections.abc import Callable, Iterator
from types import CodeType, FunctionType, ModuleType
from typing import Any

import numba
import numpy as np
from numba import types
from numba.extending import intrinsic

Intrinsic: Any = type(intrinsic(lambda typing: (types.void(), None)))  # it has no public name
OUTSIDE = ("builtins", "math", "numpy")  # what comes from there changes with the versions of Python and Numba only
PLAIN = (bool, int, float, complex, str, bytes, type(None), np.generic, np.dtype)
GLOBAL, EXTENDED = dis.opmap["LOAD_GLOBAL"], dis.opmap["EXTENDED_ARG"]


def identity(function: Callable[..., Any], options: dict[str, Any]) -> str:
    """Hash of all that machine code of the function, compiled with these options, depends on.

    It is kept with the function, for those that call it. Raises TypeError where the function reads what is neither
    number, text, array, tuple nor compiled, or what is defined only below it.
    """
    if function.__code__.co_freevars:
        raise TypeError(f"{function.__qualname__} is to be compiled and must not read variables of another function")
    reads = [(name, _read(function, name)) for name in sorted(set(_global_names(function.__code__)))]
    own = _instructions(function.__code__, function.__doc__), _described(function.__defaults__)
    content = numba.__version__, _described(options), own, reads
    found = hashlib.sha256(repr(content).encode()).hexdigest()
    function.__dict__["identity"] = found
    return found


def _global_names(code: CodeType) -> Iterator[str]:
    """Names that the code takes from its module or from Python, those of functions within it included."""
    argument = 0
    for operation, low in zip(code.co_code[::2], code.co_code[1::2], strict=True):
        argument = argument << 8 | low
        if operation == EXTENDED:
            continue
        if operation == GLOBAL:
            yield code.co_names[argument >> 1]  # the last bit says that it is called
        argument = 0
    for inner in code.co_consts:
        if isinstance(inner, CodeType):
            yield from _global_names(inner)


def _instructions(code: CodeType, words: str | None) -> object:
    """What the code does, without its docstring `words` and without its place in a file."""
    constants = [
        _instructions(one, None) if isinstance(one, CodeType) else _described(one)
        for one in code.co_consts
        if not (isinstance(one, str) and one == words)
    ]
    names = code.co_names, code.co_varnames, code.co_argcount, code.co_kwonlyargcount, code.co_flags
    return code.co_code, names, constants


def _read(function: Callable[..., Any], name: str) -> object:
    """Description of what a name of the function's module stands for."""
    scope = function.__globals__
    if name == function.__name__:
        return "itself"
    if name not in scope:
        builtins: Any = scope["__builtins__"]
        if name in (builtins if isinstance(builtins, dict) else vars(builtins)):
            return name
        raise TypeError(f"{function.__qualname__} is to be compiled and reads {name}, which is defined only below it")
    try:
        return _described(scope[name])
    except TypeError as fault:
        raise TypeError(f"{function.__qualname__} is to be compiled and reads {name}, {fault}") from None


def _described(value: Any) -> object:
    """What of a value enters machine code; its repr is the same in every process."""
    plain = getattr(value, "py_func", value)
    # Only of functions: numpy has something of that name too.
    if isinstance(plain, (FunctionType, Intrinsic)) and (kept := plain.__dict__.get("identity")):
        return kept
    if isinstance(value, PLAIN):
        return type(value).__name__, repr(value)
    if isinstance(value, np.ndarray):
        return repr(value.dtype), value.shape, value.strides, value.tobytes()
    if isinstance(value, dict):
        return [(name, _described(one)) for name, one in sorted(value.items())]
    if isinstance(value, (set, frozenset)):
        return sorted(repr(_described(one)) for one in value)
    if isinstance(value, tuple):
        return getattr(value, "_fields", ()), [_described(one) for one in value]
    if isinstance(value, type) and issubclass(value, tuple) and hasattr(value, "_fields"):
        made: Any = value
        return made.__name__, made._fields, _described(made._field_defaults)
    home = value.__name__ if isinstance(value, ModuleType) else getattr(value, "__module__", None) or ""
    if home.split(".")[0] in OUTSIDE:
        return home, getattr(value, "__name__", "")
    raise TypeError(f"which is a {type(value).__name__} and neither number, text, array, tuple nor compiled")
