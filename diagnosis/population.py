"""The calibration made beforehand, over a population of rigs (benchmarks/diagnosis.md tells which)."""

from __future__ import annotations

from gearbench.diagnosis.odds import Calibration, Odds

# Fitted by benchmarks/diagnosis_population.py to 65 drawn rigs of the calibration family (seed 60523): weights
# of 1, evidence, named, root of the share closed;
EFFECT = Odds(
    weights=(-3.673, 1.94, 2.422, 2.298),
    covariance=(
        (0.08791, 0.006334, -0.08611, -0.01007),
        (0.006334, 0.4228, -0.4163, -0.07694),
        (-0.08611, -0.4163, 1.296, -0.8305),
        (-0.01007, -0.07694, -0.8305, 5.438),
    ),
    cases=701,
    true=36,
)
# and of 1, logarithm of the largest sign over its limit.
UNKNOWN = Odds(
    weights=(-0.4731, 1.361),
    covariance=(
        (0.2156, 0.05638),
        (0.05638, 0.2405),
    ),
    cases=34,
    true=10,
)

# Limits: a drift of 0.4 % changes 0.0014 of the nominal gap, sound and slipping rigs of the development family up to
# 0.006, a support that drifts by 4 % 0.08. Of a channel's fluctuation 23 of 24 sound rigs leave up to 0.18 and not much
# at one place; what their reaction holds from beyond half of the sampling rate no simulation has.
POPULATION = Calibration(
    source="population", effect=EFFECT, unknown=UNKNOWN, rigs=65, structure=0.2, changing=0.03
)
