"""The calibration made beforehand, over a population of rigs (benchmarks/diagnosis_log.md tells which)."""

from __future__ import annotations

from gearbench.diagnosis.odds import Calibration, Odds

# Fitted by benchmarks/diagnosis_population.py to drawn rigs of the calibration family: the first to 39 (seed 5530291),
# 16 (9047712) and 26 (3150927), of the former two to signs that stated probabilities tell; weights of 1, evidence,
# called for, and the logarithm of the factor by which some part of the gap grows;
EFFECT = Odds(
    weights=(-3.639, 1.333, 4.109, 0.4402),
    covariance=(
        (0.04755, -0.00895, -0.02625, -0.002192),
        (-0.00895, 0.07044, -0.05459, -0.002784),
        (-0.02625, -0.05459, 1.206, -0.2154),
        (-0.002192, -0.002784, -0.2154, 0.1595),
    ),
    cases=1055,
    true=63,
)
# the second onto those before to the last 26: of 1, logarithm of the largest sign over its limit.
UNKNOWN = Odds(
    weights=(0.5319, 1.774),
    covariance=(
        (0.2838, 0.1023),
        (0.1023, 0.1999),
    ),
    cases=56,
    true=21,
)

# Limits: a drift of 0.4 % changes 0.0014 of the nominal gap, sound and slipping rigs of the development family up to
# 0.006, none of 53 drawn sound rigs anything that counts; drifts and tones of three seeds 0.02 and more. Of a channel's
# fluctuation sound rigs leave up to 0.18 and not much at one place.
POPULATION = Calibration(
    source="population", effect=EFFECT, unknown=UNKNOWN, rigs=81, structure=0.08, changing=0.012
)
