"""The calibration made beforehand, over a population of rigs (benchmarks/diagnosis.md tells which)."""

from __future__ import annotations

from gearbench.diagnosis.odds import Calibration, Odds

# Fitted by benchmarks/diagnosis_population.py to 51 drawn rigs of the calibration family (seed 60523): weights
# of 1, evidence, named, root of the share closed;
EFFECT = Odds(
    weights=(-4.962, 0.746, 4.368, 2.598),
    covariance=(
        (0.3491, 0.05402, -0.4023, -0.058),
        (0.05402, 0.3141, -0.5255, -0.1527),
        (-0.4023, -0.5255, 1.905, -0.5559),
        (-0.058, -0.1527, -0.5559, 3.89),
    ),
    cases=552,
    true=18,
)
# and of 1, logarithm of the largest sign over its limit.
UNKNOWN = Odds(
    weights=(0.6261, 1.363),
    covariance=(
        (0.3477, 0.1722),
        (0.1722, 0.2449),
    ),
    cases=28,
    true=12,
)

# Limits: a drift of 0.4 % changes 0.0014 of the nominal gap, sound and slipping rigs of the development family up to
# 0.006, a support that drifts by 4 % 0.08. Of a channel's fluctuation sound rigs leave up to 0.18 and not much
# at one place.
POPULATION = Calibration(
    source="population", effect=EFFECT, unknown=UNKNOWN, rigs=51, structure=0.2, changing=0.03
)
