"""What a mesh-feedback model says: HTF, its variance, stiffness and damping against phase, and how far it fits."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from gearbench.identification.feedback.data import ClassData
from gearbench.identification.feedback.estimate import Feedback
from gearbench.identification.feedback.model import Model, Operator
from gearbench.identification.feedback.start import gauged
from gearbench.identification.spectra.joint import Complexes, Floats

# Draws of the parameters from their covariance, and output lines on which they are followed.
DRAWS = 16
# Part of their deviation that parameters are drawn by: variances are those of a response that is linear in them. Whole
# steps would lead through poles at zero frequency and functions that vanish; parameters that stand in for each other
# have deviations of many times their size, along which a thousandth of it is not linear yet.
STEP = 1e-6
FOLLOWED = 40
# Deviation of the part that a model leaves of lines beyond its fit from which on too few of them stand out of noise.
HIDDEN = 0.002
# Equations of a window in which residuals are compared with the inputs.
COMPARED = 80
# Quiet windows, and the deviations above these from which on residuals are more than even noise leaves.
QUIET, LEAST_OF_WINDOWS = 0.25, 1.5
# A part of the response that no mesh force explains, beyond this and twice what chance makes, speaks against it.
UNEXPLAINED = 0.03


def htf_on(
    model: Model,
    data: ClassData,
    lines: NDArray[np.int64],
    harmonics: int,
    ratio: float = 1.0,
    furthest: int | None = None,
) -> Complexes:
    """HTF (2H+1, F) [m/N], l = -H..H, on lines of the record by harmonic balance; 0 beyond the line `furthest`, which
    is `data.furthest_at(ratio)` unless given.

    `ratio`: mesh frequency over that of the record, which D, N, k and c do not depend on.
    """
    result = np.zeros((2 * harmonics + 1, lines.size), dtype=complex)
    step, furthest = data.mesh_lines * ratio, furthest or data.furthest_at(ratio)
    for residue in np.unique(np.round(lines % step, 9)):
        chosen = np.flatnonzero(np.abs(np.round(lines % step, 9) - residue) < 1e-8)
        first = int(np.ceil((-furthest - residue) / step))
        last = int(np.floor((furthest - residue) / step))
        omega = (residue + step * np.arange(first, last + 1))[None] / data.top
        operator = Operator(model, omega, np.ones(omega.shape, dtype=bool))
        place = np.round((lines[chosen] - residue) / step).astype(int) - first
        force = np.zeros((omega.size, chosen.size), dtype=complex)
        force[place, np.arange(chosen.size)] = 1.0
        solved = operator.solve(0, operator.n[0][:, None] * force)
        solved = model.shown(omega[0][:, None], solved, force) / data.stiffness_unit
        for branch in range(-harmonics, harmonics + 1):
            row = place + branch
            inside = (row >= 0) & (row < omega.size)
            result[branch + harmonics, chosen[inside]] = solved[row[inside], np.flatnonzero(inside)]
    return result


def doubt_beyond(found: Feedback) -> float:
    """Part of the power of sidebands beyond the lines of the fit that may be wrong, apart from noise's part in it.

    What the model leaves of the lines that the record has beyond those, less noise of the level of the fit, over their
    power (where noise hides it: of all lines above the excited band, which hold sidebands only, too). Lines count by
    the power that the model sees in them. The part is positive: of what noise makes of it (normal, since many lines add
    up) its mean above 0. 1 where the model sees nothing there.
    """
    data = found.data
    has = np.abs(data.dte) > 0
    part, deviation = _left_over_seen(found, has & ~data.valid[:, :, None])
    if deviation > HIDDEN:
        part, deviation = _left_over_seen(found, has & (np.abs(data.lines) > data.excited)[:, :, None])
    if not np.isfinite(deviation):
        return 1.0
    if deviation > 0.0:
        above = part / deviation
        part += deviation * float(np.exp(norm.logpdf(above) - norm.logcdf(above)))
    return min(max(part, 0.0), 1.0)


def _left_over_seen(found: Feedback, counted: NDArray[np.bool_]) -> tuple[float, float]:
    """What the model leaves of the power of counted lines (C, S, E), and its deviation by noise; infinite for none."""
    left, level = found.refined.left[counted], found.refined.noise
    seen = np.abs(found.data.dte[counted] - left) ** 2
    power = float(np.sum(seen**2))
    if power == 0.0:
        return 0.0, np.inf
    return float(np.sum(seen * (np.abs(left) ** 2 - level))) / power, level / float(np.sqrt(power))


def followed(lines: NDArray[np.int64]) -> NDArray[np.int64]:
    """Some of the output lines, on which the drawn models are solved: evenly spread, and from the first to the second
    of these at doubled distances, as the poles of over-damped supports near zero frequency are uncertain there only."""
    step = max(1, -(-lines.size // FOLLOWED))
    near = lines[: step + 1][2 ** np.arange(int(np.log2(step)) + 1) if step > 1 else slice(0)]
    return np.unique(np.concatenate([lines[::step], near, lines[-1:]]))


def drawn_models(found: Feedback) -> list[Model]:
    """Models with parameters drawn by STEP of their covariance's root, each with the common factor of its own N."""
    model = found.model
    steps = steps_of(found.refined.root)
    return [gauged(model.moved(model.vector() + step), found.data) for step in steps]


def drawn_steps(covariance: Floats) -> Floats:
    """STEP times DRAWS draws (DRAWS, P) of parameters with this covariance (P, P), the same at each call.

    Drawn from the correlations: splines without data leave variances 1e20 times those of others, which would drown in
    the rounding of the covariance's own eigenvalues.
    """
    size = np.sqrt(np.maximum(np.diagonal(covariance), np.finfo(float).tiny))
    values, vectors = np.linalg.eigh(covariance / size / size[:, None])
    return steps_of(size[:, None] * vectors * np.sqrt(np.maximum(values, 0.0)))


def steps_of(root: Floats) -> Floats:
    """The same of covariance = `root` root^T."""
    return np.asarray(STEP * np.random.default_rng(0).standard_normal((DRAWS, root.shape[1])) @ root.T)


def along_phase(model: Model, data: ClassData, phases: int) -> tuple[Floats, Floats]:
    """Mesh stiffness [N/m] and damping [N s/m] (phases,) on uniform phases.

    k_0 and c_0 are what D tends to at frequency 0: Re D, and Im D over the angular frequency. c_0 counts the damping
    of a shaft to ground as the mesh's.
    """
    turn = np.exp(2j * np.pi * np.outer(np.arange(phases) / phases, np.arange(1, model.harmonics + 1)))
    position = data.begins
    d, _ = model.functions(position)
    # D = k_0 + j w c_0 - w^2 m + ..: straight lines through its parts.
    k_0 = float(np.polyfit(position**2, d.real, 1)[1])
    c_0 = float(np.sum(d.imag * position) / np.sum(position**2))
    stiffness = (k_0 + 2 * (turn @ model.k).real) * data.stiffness_unit
    damping = (c_0 + 2 * (turn @ model.c).real) * data.stiffness_unit / data.omega_unit
    return stiffness, damping


def coherence(found: Feedback, lines: NDArray[np.int64]) -> Floats:
    """1 - residual over response (F,), powers of the lines within half of COMPARED of each output line."""
    data = found.data
    power, left = np.zeros(data.top + 1), np.zeros(data.top + 1)
    counted = np.abs(data.dte) > 0
    at = np.abs(data.lines)
    for total, values in ((power, data.dte), (left, found.refined.left)):
        np.add.at(total, at[data.valid], np.sum(np.abs(values) ** 2 * counted, axis=2)[data.valid])
    sums = [np.concatenate([[0.0], np.cumsum(total)]) for total in (left, power)]
    low, high = np.clip(lines - COMPARED // 2, 0, data.top), np.clip(lines + COMPARED // 2, 0, data.top) + 1
    part, whole = (one[high] - one[low] for one in sums)
    return np.asarray(np.maximum(1.0 - part / np.maximum(whole, np.finfo(float).tiny), 0.0))


def unexplained(found: Feedback, band: tuple[int, int]) -> float:
    """Estimated sum over the lines k of the `band` and all branches of |error of G_l(k)|^2 [m^2/N^2].

    It is what the residuals share with the inputs, less what noise would (docs/identification.md, "How far a result
    goes"); and, where a window has more branches than equations, so that chance hides much, one deviation of chance as
    far as residuals exceed those of quiet windows. As far as they are as even as noise, what is shared must exceed that
    deviation: chance alone would make half of all records promise too little of themselves.
    """
    data, d = found.data, found.data.mesh_lines
    size = 2 * data.top + 1
    left, force = (np.zeros((size, data.dte.shape[2]), dtype=complex) for _ in range(2))
    for target, source in ((left, found.refined.left), (force, data.force)):
        target[data.lines[data.valid] + data.top] = source[data.valid]
        target[-data.lines[data.valid] + data.top] = source[data.valid].conj()
    counted = np.abs(left) > 0
    width = max(3, COMPARED // data.dte.shape[2])
    total, chance, above = 0.0, 0.0, []
    for first in range(data.top + 1, size - width + 1, width):
        rows = np.arange(first, first + width)
        middle = first + width // 2 - data.top
        reach = (band[1] + middle) // d + 1
        branch = np.arange(-reach, reach + 1)
        source = np.abs(middle + branch * d)
        branch = branch[(source >= band[0]) & (source <= band[1])]
        at = rows[:, None] + branch * d
        known = (at >= 0) & (at < size)
        inputs = force[np.where(known, at, 0)] * known[:, :, None] * counted[rows][:, None, :]
        power = np.sum(np.abs(inputs) ** 2, axis=(0, 2))
        product = np.einsum("rje,re->j", inputs.conj(), left[rows])
        noise = float(np.sum(np.abs(left[rows]) ** 2)) / max(int(counted[rows].sum()), 1)
        good = power > 0
        share = np.sum((np.abs(product[good]) ** 2 / power[good] - noise) / power[good])
        total += width * float(share)
        if good.any():
            fewer = min(int(good.sum()), int(counted[rows].sum()))
            chance += (width * noise * float(np.sum(1.0 / power[good]))) ** 2 / max(fewer, 1)
            above.append((noise, width * int(counted[rows].sum()) / float(power[good].mean())))
    if above:
        levels, weights = np.array(above).T
        quietest = np.quantile(levels, QUIET) * (1.0 + LEAST_OF_WINDOWS / np.sqrt(width * left.shape[1]))
        hidden = max(float((levels - quietest) @ weights), 0.0)
        deviation = float(np.sqrt(chance))
        hidden = min(deviation, hidden)
        total = max(total - (deviation - hidden), 0.0) + hidden
    return total / data.stiffness_unit**2


def loud_power(found: Feedback, band: tuple[int, int]) -> float:
    """Estimated sum over the lines k of the `band` and all branches of |error of G_l(k)|^2 [m^2/N^2]: what residuals
    hold at loud phases beyond the level of the others. It may be distortion of flanks whose contact moves with the
    load, which no response explains, or response that the model does not follow; a realisation does not tell."""
    if found.loud is None:
        return 0.0
    data = found.data
    own = data.valid & (np.abs(data.lines) >= band[0]) & (np.abs(data.lines) <= band[1])
    counted = data.weight[:, None, None] ** 2 * (own[:, :, None] & (np.abs(data.dte) > 0))
    left, force = (float(np.sum(counted * np.abs(x) ** 2)) for x in (found.refined.left, data.force))
    return found.loud.excess * left / force * (band[1] - band[0] + 1) / data.stiffness_unit**2


def doubt_of(apart: float, chance: float) -> list[str]:
    """The warning, if any, of a part of the response that no mesh force explains, beside what chance makes of it."""
    if apart <= max(UNEXPLAINED, 2 * chance):
        return []
    return [
        f"{apart:.1%} of the response is in the residual and follows the force: a varying mesh force alone does not"
        " explain this record"
    ]
