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
# # Find the hidden effect
#
# A "measured" rig has an effect that its simulation leaves out. The diagnosis reads the records and the nominal rig,
# and nothing else.

# %%
import gearbench as gb

nominal = gb.read_case("gap_demo")
hidden = gb.read_case("gap_demo", ["rig.sensors.delay_angle_driver_us=40"])
records = [gb.simulate(case) for _, case in hidden.experiments()]
print([record.attrs["condition"] for record in records])

# %% [markdown]
# Each record is one condition; the one named `held-out` has no part in the search.

# %%
found = gb.diagnose(records, nominal, quick=True)
verdict = found.verdict
print(verdict)

# %%
assert [one.effect for one in verdict.effects] == ["sensor-delay"]
