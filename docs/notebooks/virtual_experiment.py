# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # A virtual experiment
#
# A rig runs under a multisine torque; from half a second of its record comes the frequency response over the mesh
# cycle. Here the rig is the linear lumped model, whose exact response is known: we see how well it is found.

# %%
import matplotlib.pyplot as plt
import numpy as np

import gearbench as gb
from gearbench.bench.results.responses import reference_results

case = gb.read_case("quick_lumped", ["experiment.realisations=1"])
record = gb.simulate(case)
print(record.sizes, record.attrs["mesh_period"], "s a mesh period")

# %% [markdown]
# The transmission error along the line of action, and its spectrum: mesh orders (20 Hz apart) over the multisine's
# lines.

# %%
dte = gb.dte(record).isel(realisation=0)
rate = record.attrs["sampling_rate"]
spectrum = np.abs(np.fft.rfft(dte.values)) / dte.size
figure, (above, below) = plt.subplots(2, 1, figsize=(8, 6))
above.plot(1e3 * record["time"][:2048], 1e6 * dte[:2048])
above.set(xlabel="time [ms]", ylabel="DTE [um]")
below.semilogy(np.fft.rfftfreq(dte.size, 1 / rate), 1e6 * spectrum)
below.set(xlabel="frequency [Hz]", ylabel="DTE [um]", xlim=(0, 3500))

# %% [markdown]
# Mesh feedback takes one realisation. Its error is predicted, and here also known.

# %%
settings = gb.IdentificationSettings(method="mesh-feedback", band=(1.0, 3500.0))
frf = gb.identify([record], settings)
exact = reference_results(case, frf)["exact"]  # at every so many frequencies
print(f"expected error {frf.attrs['expected_error']:.2%}")

# %%
true = gb.itf(exact)
found = gb.itf(frf).sel(frequency=true["frequency"]).interp(phase=true["phase"])
error = float(np.sqrt((np.abs(found - true) ** 2).sum() / (np.abs(true) ** 2).sum()))
print(f"error over all phases and frequencies {error:.2%}")
figure, axes = plt.subplots(figsize=(8, 4))
for phase in (0.0, 0.5):
    axes.semilogy(found["frequency"], np.abs(found.sel(phase=phase, method="nearest")), label=f"phase {phase}")
axes.set(xlabel="frequency [Hz]", ylabel="|ITF| [m/N]")
axes.legend()

# %%
assert error < 0.02
