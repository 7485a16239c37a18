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
# # Finite elements against springs
#
# The same pair, 62/62 teeth of module 2, by elastic gears in contact and by the potential-energy method of the lumped
# model: mesh stiffness over the mesh cycle at 100 N m, and what the load does to it.

# %%
import matplotlib.pyplot as plt

import gearbench as gb

case = gb.read_case("paper_fe")
loads = [20.0, 100.0, 400.0]
elastic = gb.static(case, model="reduced", torque=loads)
springs = gb.static(case, model="lumped", torque=loads)

# %%
figure, axes = plt.subplots(figsize=(8, 4.5))
for number, load in enumerate(loads):
    stiffness = 1e-6 * elastic["stiffness_secant"].isel(load=number)
    axes.plot(elastic["phase"], stiffness, label=f"finite elements, {load:g} N m")
axes.plot(springs["phase"], 1e-6 * springs["stiffness_secant"].isel(load=1), "k--", label="potential energy")
axes.set(xlabel="mesh phase [cycles]", ylabel="mesh stiffness [N/um]")
axes.legend()

# %% [markdown]
# Springs side by side know nothing of the gear body that neighbouring teeth share: where two pairs carry, their sum
# is too stiff. Where one pair carries, both agree better. Contact flattens with load, so that elastic teeth stiffen a
# little.

# %%
most = {
    "finite elements": elastic["stiffness_secant"].isel(load=1).max().item(),
    "potential energy": springs["stiffness_secant"].isel(load=1).max().item(),
}
least = {
    "finite elements": elastic["stiffness_secant"].isel(load=1).min().item(),
    "potential energy": springs["stiffness_secant"].isel(load=1).min().item(),
}
for name in most:
    print(f"{name:>18}: {1e-6 * least[name]:.0f} to {1e-6 * most[name]:.0f} N/um")
double = most["potential energy"] / most["finite elements"]
single = least["potential energy"] / least["finite elements"]
print(f"too stiff by {double - 1:.0%} with two pairs, by {single - 1:.0%} with one")

# %%
mean = elastic["stiffness_secant"].mean("phase")
assert double > single > 1.0
assert (mean.diff("load") > 0).all()
