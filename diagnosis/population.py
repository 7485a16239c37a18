"""The calibration made beforehand, over a population of rigs (benchmarks/diagnosis.md tells which)."""

from __future__ import annotations

from gearbench.diagnosis.odds import Calibration, Odds

# Fitted by benchmarks/diagnosis_population.py to 29 drawn rigs of the calibration family (seed 7304417): weights of 1,
# evidence, named, root of the share closed;
EFFECT = Odds(
    weights=(-4.37, 2.417, 3.324, 1.444),
    covariance=(
        (0.2999, -0.131, -0.08654, -0.05099),
        (-0.131, 0.3031, -0.1784, -0.01134),
        (-0.08654, -0.1784, 3.162, -2.023),
        (-0.05099, -0.01134, -2.023, 6.36),
    ),
    cases=376,
    true=23,
)
# and of 1, logarithm of the largest sign over its limit.
UNKNOWN = Odds(
    weights=(0.2031, 2.377),
    covariance=(
        (1.209, 0.4525),
        (0.4525, 1.341),
    ),
    cases=11,
    true=3,
)

# Limits: a drift of 0.4 % changes 0.0014 of the nominal gap, sound and slipping rigs of the development family up to
# 0.006, a support that drifts by 4 % 0.08. Of a channel's fluctuation sound rigs leave up to 0.18 and not much
# at one place.
POPULATION = Calibration(
    source="population", effect=EFFECT, unknown=UNKNOWN, rigs=29, structure=0.08, changing=0.03
)
