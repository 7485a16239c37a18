"""Truth rigs with withheld effects, and the score of a diagnosis of them."""
