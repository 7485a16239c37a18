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
    if name not in ("base", "held-out"):  # the other two would be a minute more
        continue
    records.append(gb.simulate(case).assign_attrs(condition=name))
    print(name, dict(records[-1].sizes), f"{case.experiment.torque_mean:g} N m")

# %% [markdown]
# Each record is one condition; the one called `held-out` has no part in the search and judges the verdict. To end
# soon, the library is cut down to three suspects; leave `without` away to ask for all ten.

# %%
others = ["backlash", "pitch-error", "tooth-crack", "coupling", "bearing-nonlinearity", "torque-ripple"]
others += ["support-stiffness"]  # left in: sensor-delay, friction, eccentricity
found = gb.diagnose(records, nominal, without=others, quick=True)
verdict = found.verdict
print(verdict.verdict, [effect.name for effect in verdict.effects])
for candidate in verdict.candidates[:4]:
    print(candidate)

# %% [markdown]
# The updated rig is a case like any other: write it down with `gb.dump_case(found.updated)`.

# %%
assert [effect.name for effect in verdict.effects] == ["sensor-delay"]
