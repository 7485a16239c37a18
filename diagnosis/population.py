"""The calibration made beforehand, over a population of rigs (benchmarks/diagnosis.md tells which)."""

from __future__ import annotations

from gearbench.diagnosis.odds import Calibration, Odds

# Fitted by benchmarks/diagnosis_population.py to 51 drawn rigs of the calibration family (seed 60523), and updated by
# 50 of the development family (seeds 9912407 and 20260771): weights of 1, evidence, named, root of the share closed;
EFFECT = Odds(
    weights=(-4.662, 1.025, 4.282, 2.446),
    covariance=(
        (0.1201, -0.01986, -0.08746, 6.55e-05),
        (-0.01986, 0.05511, -0.06086, -0.0162),
        (-0.08746, -0.06086, 0.4553, -0.4362),
        (6.55e-05, -0.0162, -0.4362, 2.707),
    ),
    cases=1192,
    true=54,
)
# and of 1, logarithm of the largest sign over its limit.
UNKNOWN = Odds(
    weights=(0.601, 1.405),
    covariance=(
        (0.3048, 0.1591),
        (0.1591, 0.1701),
    ),
    cases=45,
    true=15,
)

# Limits: a drift of 0.4 % changes 0.0014 of the nominal gap, sound and slipping rigs of the development family up to
# 0.006, a support that drifts by 4 % 0.08. Of a channel's fluctuation sound rigs leave up to 0.18 and not much
# at one place.
POPULATION = Calibration(
    source="population", effect=EFFECT, unknown=UNKNOWN, rigs=101, structure=0.08, changing=0.03
)
