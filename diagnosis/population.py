"""The calibration made beforehand, over a population of rigs (benchmarks/diagnosis.md tells which)."""

from __future__ import annotations

from gearbench.diagnosis.odds import Calibration, Odds

# Fitted by benchmarks/diagnosis_population.py: weights of 1, evidence, named, root of the share closed;
EFFECT = Odds(
    weights=(-3.823, 2.188, 3.529, 1.272),
    covariance=(
        (0.4122, -0.1091, -0.2193, -0.07931),
        (-0.1091, 0.9247, -0.4896, -0.02963),
        (-0.2193, -0.4896, 3.206, -1.793),
        (-0.07931, -0.02963, -1.793, 6.916),
    ),
    cases=178,
    true=9,
)
# and of 1, logarithm of the largest sign over its limit.
UNKNOWN = Odds(
    weights=(0.2496, 1.558),
    covariance=(
        (0.8397, 0.3548),
        (0.3548, 1.365),
    ),
    cases=6,
    true=3,
)

# Limits: a drift of 0.4 % changes 0.0014 of the nominal gap, sound and slipping rigs of the development family up to
# 0.006, a support that drifts by 4 % 0.08; sound rigs of that family leave up to a tenth of a channel's fluctuation.
POPULATION = Calibration(
    source="population", effect=EFFECT, unknown=UNKNOWN, rigs=20, structure=0.1, changing=0.03
)
