"""How inner loops are compiled and kept, and what they share. Imported by the names of its files: it loads Numba."""

__all__: list[str] = []
