"""The calibration made beforehand, over a population of rigs (benchmarks/diagnosis.md tells which)."""

from __future__ import annotations

from gearbench.diagnosis.odds import Calibration, Odds

# Fitted by benchmarks/diagnosis_population.py: weights of 1, evidence, named, root of the share closed;
EFFECT = Odds(
    weights=(-3.859, 0.6465, 4.84, 1.179),
    covariance=(
        (0.5553, 0.1518, -0.6165, -0.04696),
        (0.1518, 0.8248, -1.108, 0.1667),
        (-0.6165, -1.108, 3.772, -1.489),
        (-0.04696, 0.1667, -1.489, 6.738),
    ),
    cases=115,
    true=7,
)
# and of 1, logarithm of the largest sign over its limit.
UNKNOWN = Odds(
    weights=(0.3625, 0.6422),
    covariance=(
        (2.13, 1.397),
        (1.397, 2.491),
    ),
    cases=2,
    true=1,
)

# Limits: a drift of 0.4 % changes 0.0014 of the nominal gap, sound and slipping rigs of the development family up to
# 0.006, a support that drifts by 4 % 0.08; sound rigs of that family leave up to a tenth of a channel's fluctuation.
POPULATION = Calibration(
    source="population", effect=EFFECT, unknown=UNKNOWN, rigs=13, structure=0.1, changing=0.03
)
