"""A run of the lumped model that ends within seconds."""

SMALL = {
    "experiment.realisations": "4",
    "experiment.samples_per_period": "2048",
    "experiment.sampling_rate_hz": "8192",
    "experiment.multisine.band_hz": "[4, 2500]",
    "identification.band_hz": "[100, 500]",
    "identification.harmonics": "4",
    "identification.order": "1",
    "identification.window": "6",
}
SMALL_RUN = ["quick_lumped", *(part for key, value in SMALL.items() for part in ("--set", f"{key}={value}"))]
