"""Commands about a pair at rest: its data sheet, its mesh, its static transmission error."""
