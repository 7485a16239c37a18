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
# A "measured" rig has an effect that its simulation leaves out: its flanks rub. The diagnosis reads the records and the
# nominal rig, and nothing else.

# %%
import gearbench as gb

quickly = ["simulation.mesh_stiffness=potential-energy"]  # a minute less than tables of finite elements
nominal = gb.read_case("gap_demo", quickly)
hidden = gb.read_case("gap_demo", [*quickly, "rig.friction.coefficient=0.06"])
records = []
for name, case in hidden.experiments():
    if name not in ("base", "held-out"):  # the other two would be a minute more
        continue
    records.append(gb.simulate(case).assign_attrs(condition=name))
    print(name, dict(records[-1].sizes), f"{case.experiment.torque_mean:g} N m")

# %% [markdown]
# Each record is one condition; the one called `held-out` has no part in the search and judges the verdict. To end
# soon, the library is cut down to three suspects; leave `without` away to ask for all eleven.

# %%
others = ["backlash", "pitch-error", "tooth-crack", "coupling", "bearing-nonlinearity", "torque-ripple"]
others += ["support-stiffness", "mesh-damping"]  # left in: sensor-delay, friction, eccentricity
found = gb.diagnose(records, nominal, without=others, quick=True)
verdict = found.verdict
print(verdict.verdict, [effect.name for effect in verdict.effects])
for candidate in verdict.candidates[:4]:
    print(candidate)

# %% [markdown]
# How far the gap of the transmission error shrinks, on the record that the search has not seen: the nominal rig, the
# same recalibrated (its numbers as free as the case says), the rig with the effect, and the noise floor.

# %%
(whole,) = (one for one in verdict.gap if one.channel == "dte" and one.band_hz == (0.0, 3000.0))
for words, part in (
    ("nominal", whole.nominal), ("recalibrated", whole.recalibrated), ("with the effect", whole.with_effect),
    ("noise floor", whole.floor),
):  # fmt: skip
    print(f"{words:<16} {1e6 * part.value:.4f} um rms ({1e6 * part.low:.4f} to {1e6 * part.high:.4f})")

# %% [markdown]
# The updated rig is a case like any other: write it down with `gb.dump_case(found.updated)`. Its friction is what was
# hidden.

# %%
print(f"hidden {hidden.rig.friction.coefficient:g}, found {found.updated.rig.friction.coefficient:.3f}")
assert [effect.name for effect in verdict.effects] == ["friction"]
assert whole.recalibrated.value > 1.5 * whole.with_effect.value
assert whole.with_effect.value < 1.1 * whole.floor.value
assert abs(found.updated.rig.friction.coefficient - hidden.rig.friction.coefficient) < 0.01
