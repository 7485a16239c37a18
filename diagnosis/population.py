"""The calibration made beforehand, over a population of rigs (benchmarks/diagnosis_log.md tells which)."""

from __future__ import annotations

from gearbench.diagnosis.odds import Calibration, Odds

# Fitted by benchmarks/diagnosis_population.py to drawn rigs of the calibration family: 29 (seed 7304417), onto these 31
# with every effect of the library (seed 8820417), and 39 (seed 5530291). Weights of 1, evidence, named, and the
# logarithm of the factor by which some part of the gap grows, which the first rigs do not tell: nothing, give or take
# 1, before the others;
EFFECT = Odds(
    weights=(-4.147, 1.844, 4.279, -0.182),
    covariance=(
        (0.06889, -0.02405, -0.02803, -0.003977),
        (-0.02405, 0.09483, -0.08214, 0.003636),
        (-0.02803, -0.08214, 2.106, -0.4388),
        (-0.003977, 0.003636, -0.4388, 0.1812),
    ),
    cases=1293,
    true=54,
)
# and of 1, logarithm of the largest sign over its limit.
UNKNOWN = Odds(
    weights=(0.242, 1.741),
    covariance=(
        (0.3476, 0.1313),
        (0.1313, 0.2377),
    ),
    cases=49,
    true=17,
)

# Limits: a drift of 0.4 % changes 0.0014 of the nominal gap, sound and slipping rigs of the development family up to
# 0.006, none of 53 drawn sound rigs anything that counts; drifts and tones of three seeds 0.02 and more. Of a channel's
# fluctuation sound rigs leave up to 0.18 and not much at one place.
POPULATION = Calibration(
    source="population", effect=EFFECT, unknown=UNKNOWN, rigs=60, structure=0.08, changing=0.012
)
