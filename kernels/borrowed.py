"""Arrays that a loop borrows from whoever called it."""

from __future__ import annotations

from typing import Any

from numba import types
from numba.core import cgutils
from numba.extending import intrinsic


def _borrow(typing: Any, value: Any) -> Any:
    """The same value, a named tuple of arrays, of tuples of them and of numbers, whose arrays nobody counts references
    to: for compiled code only.

    Counting takes an atomic operation for each array of a tuple wherever a function receives the tuple or reads it,
    several times as long as what small steps do with them. The caller of the compiled loop must hold the arrays until
    it returns, as the caller of any function does; nothing borrowed may be returned.
    """

    def build(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return _disowned(context, builder, signature.args[0], values[0])

    return value(value), build


def _disowned(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    """The value with the owners of all its arrays struck out."""
    if isinstance(kind, types.Array):
        array = context.make_array(kind)(context, builder, value)
        array.meminfo = cgutils.get_null_value(array.meminfo.type)
        array.parent = cgutils.get_null_value(array.parent.type)
        return array._getvalue()
    if isinstance(kind, types.BaseTuple):
        kinds: Any = kind
        for i, inner in enumerate(tuple(kinds)):
            held = _disowned(context, builder, inner, builder.extract_value(value, i))
            value = builder.insert_value(value, held, i)
    return value


borrowed: Any = intrinsic(_borrow)
# What machine code that uses it depends on (see `identity`): renewed by hand where the lines above change.
borrowed.identity = "borrowed 1"
