"""The calibration made beforehand, over a population of rigs (benchmarks/diagnosis_log.md tells which)."""

from __future__ import annotations

from gearbench.diagnosis.odds import Calibration, Odds

# Fitted by benchmarks/diagnosis_population.py to drawn rigs of the calibration family: 29 (seed 7304417), and onto
# these 31 with every effect of the library (seed 8820417). Weights of 1, evidence, named, and the logarithm of the
# factor by which some part of the gap grows, which the first rigs do not tell: nothing, give or take 1, before the
# others;
EFFECT = Odds(
    weights=(-4.039, 1.98, 3.766, 0.4166),
    covariance=(
        (0.1166, -0.04876, -0.03616, -0.005343),
        (-0.04876, 0.131, -0.0899, 0.004229),
        (-0.03616, -0.0899, 2.748, -0.3448),
        (-0.005343, 0.004229, -0.3448, 0.371),
    ),
    cases=783,
    true=40,
)
# and of 1, logarithm of the largest sign over its limit.
UNKNOWN = Odds(
    weights=(0.4389, 1.8),
    covariance=(
        (0.7013, 0.2844),
        (0.2844, 0.5448),
    ),
    cases=25,
    true=8,
)

# Limits: a drift of 0.4 % changes 0.0014 of the nominal gap, sound and slipping rigs of the development family up to
# 0.006, a support that drifts by 4 % 0.08. Of a channel's fluctuation sound rigs leave up to 0.18 and not much
# at one place.
POPULATION = Calibration(
    source="population", effect=EFFECT, unknown=UNKNOWN, rigs=60, structure=0.08, changing=0.03
)
