"""Truth rigs with withheld effects, and the score of a diagnosis of them.

`truth`: rigs whose equations of motion diagnosis does not know, their effects and measurement. `making`: cases of a
challenge and the plan of what is withheld. `scoring`: verdicts judged against the answers. Diagnosis and the truth rigs
do not import one another.
"""

from gearbench.challenge.errors import ChallengeError

__all__ = ["ChallengeError"]
