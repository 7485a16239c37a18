"""How inner loops are compiled and kept, and what they share."""
