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

quickly = ["simulation.mesh_stiffness=potential-energy"]  # a minute less than tables of finite elements
nominal = gb.read_case("gap_demo", quickly)
hidden = gb.read_case("gap_demo", [*quickly, "rig.sensors.delay_angle_driver_us=40"])
records = []
for name, case in hidden.experiments():
    records.append(gb.simulate(case))
    print(name, dict(records[-1].sizes), f"{case.experiment.torque_mean:g} N m")

# %% [markdown]
# Each record is one condition. Of four the last has no part in the search: it judges the verdict.

# %%
found = gb.diagnose(records, nominal, quick=True)
verdict = found.verdict
print(verdict.verdict, [effect.name for effect in verdict.effects])
for candidate in verdict.candidates[:4]:
    print(candidate)

# %% [markdown]
# The updated rig is a case like any other: write it down with `gb.dump_case(found.updated)`.

# %%
assert [effect.name for effect in verdict.effects] == ["sensor-delay"]
