"""The size of the elements on flanks and fillets: its default and its limits."""

from __future__ import annotations

from gearbench.geometry.error import GeometryError

PER_MODULE = 12  # elements a module, where no size is given
FINEST, COARSEST = 400, 2  # elements a module, at most and at least


def default_size(module: float) -> float:
    """Element size [m] of a gear of that module [m] where none is given."""
    return module / PER_MODULE


def flank_size(module: float, element_size: float | None) -> float:
    """Element size [m] for a gear of that module [m]: the given one, or the default where it is None.

    Raises GeometryError outside its limits.
    """
    size = default_size(module) if element_size is None else element_size
    if not module / FINEST <= size <= module / COARSEST:
        raise GeometryError(
            f"simulation.element_size_um = {size * 1e6:g} must lie between {module * 1e6 / FINEST:g}"
            f" (module/{FINEST}) and {module * 1e6 / COARSEST:g} (module/{COARSEST})"
        )
    return size
