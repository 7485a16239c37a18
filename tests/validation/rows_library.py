"""The library of gears against what is published about them."""

from __future__ import annotations

from gearbench.cases import read_case
from gearbench.commands.house.checks import Check, Got
from gearbench.geometry import pair

# Contact ratio as printed, two decimals. FZG type C: Magalhaes et al. (Tribology International 43, 2010). NASA: Lin,
# Oswald and Townsend (Mechanism and Machine Theory 29, 1994). Both count sharp tips.
CONTACT_RATIO = {"fzg_c": 1.44, "nasa_28": 1.64}


def contact_ratios() -> Got:
    """Largest difference of a contact ratio from the printed one."""
    found = {name: pair(read_case(name).rig).contact_ratio_sharp for name in CONTACT_RATIO}
    worst = max(abs(found[name] - wanted) for name, wanted in CONTACT_RATIO.items())
    return Got(worst, ", ".join(f"{name} {value:.4f}" for name, value in found.items()))


CHECKS = [Check("library", "contact ratios of the library against print", 0.005, "", contact_ratios)]
