"""The mesh-feedback estimator: from spectra to D, N, k(theta), c(theta), and the response that follows from them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gearbench.identification.feedback.data import SIDEBANDS, ClassData, class_data, fewer_classes, only_lines
from gearbench.identification.feedback.folding import Folding, clear_lines, folded, folded_of, folding_of, without
from gearbench.identification.feedback.functions import Fractions, Splines, common_pairs
from gearbench.identification.feedback.loud import Loud, settled
from gearbench.identification.feedback.model import Model
from gearbench.identification.feedback.phase import InZones, in_zones
from gearbench.identification.feedback.poles import linear_models
from gearbench.identification.feedback.refine import (
    SETTLED,
    Refined,
    linearised,
    output_error,
    refined,
    response,
)
from gearbench.identification.feedback.shapes import Shapes
from gearbench.identification.feedback.start import first_model
from gearbench.identification.feedback.zones import Zones
from gearbench.identification.lpm.local_solve import LpmError
from gearbench.identification.spectra.joint import Complexes, Spectra

Progress = Callable[[float, str], None]

# Harmonics of the mesh unless given; their prior keeps those that the record does not show small.
HARMONICS = 100
# Intervals of the splines that assume nothing about D and N, at most, and equations for each; decrease of the cost at
# which their rounds end, and pairs of common poles that are tried after them.
INTERVALS = 160
SUPPORT = 18
FEWEST_INTERVALS = 20
ROUGH_SETTLED = 0.2
# The same where the splines of E join them, which are further from the start.
CENTRES_SETTLED = 0.1
# Splines are trusted to no better than this part of D and N.
ROUGH = 0.01
PAIRS = 6
FITTED_POINTS = 1200
# Equations that the search for a model looks at; the last rounds take all.
SEARCHED = 6000
# A model with more parameters must improve the criterion by so much.
GAIN = 4.0
# Decrease of the cost at which rounds end while numbers of poles are compared.
COMPARED = 0.02
# The same in zones of phase, whose few numbers are known so well that less tells: of 12000 real equations one.
IN_ZONES = 1e-4
# Times that what folds back is foretold anew in the last rounds, and in the search from a model that has taken it in:
# there it begins at twice its size and swings.
FORETOLD, APPROACHED = 2, 6
# Where further pairs of poles are tried, as parts of the excited band, and their damping ratios: the lowest are those
# of over-damped supports.
PLACES = (0.01, 0.04, 0.08, 0.14, 0.2, 0.26, 0.32, 0.38, 0.44, 0.52, 0.6, 0.7, 0.85)
PLACED_DAMPING = (1.0, 1.0, *(11 * [0.03]))
# Added to the scaled Gram matrix there: the common factor of all parameters is free.
FIRMNESS = 1e-9


@dataclass(frozen=True)
class Feedback:
    """The data, and the refined model of least criterion; `zones` of phase that its mesh is told by, if it is, and
    their `gain` in twice the log evidence over harmonics; `folding` beyond half the sampling rate that was taken out of
    the data, where the model foretells any; `loud` mesh phases, where the residual has any."""

    data: ClassData
    refined: Refined
    zones: Zones | None = None
    gain: float = 0.0
    folding: Folding | None = None
    loud: Loud | None = None

    @property
    def model(self) -> Model:
        """The model, in units of the data."""
        return self.refined.model


def mesh_feedback(
    spectra: Spectra,
    excited: int,
    *,
    harmonics: int | None = None,
    sidebands: int = SIDEBANDS,
    progress: Progress | None = None,
) -> Feedback:
    """Identify the mesh-feedback model from all lines up to so many `sidebands` beyond the highest `excited` one.

    `harmonics` L of the mesh, and nothing but these; absent: zones of phase and a remainder of harmonics where they are
    more evident. Of dte from angles alone the form that also tells the centres' motion is found besides, and the one of
    least criterion returned. Raises LpmError where the record holds fewer equations than unknowns.
    """
    report = progress or (lambda part, message: None)
    data = class_data(spectra, excited, sidebands)
    count = min(harmonics if harmonics is not None else HARMONICS, data.valid.sum(axis=1).max() - 1)
    intervals = int(np.clip(data.equations / SUPPORT, FEWEST_INTERVALS, INTERVALS))
    unknowns = 4 * (intervals + 3) + 4 * count
    if data.equations < unknowns:
        raise LpmError(_too_short(spectra, excited, unknowns, data.equations))
    report(0.0, "mesh feedback: first model")
    part = fewer_classes(data, SEARCHED)
    first = first_model(part, Splines(intervals), count)
    splines = refined(first, part, ROUGH_SETTLED)
    tried = _with_poles(first, splines, part, report)
    best = _least(tried, part)
    if spectra.angle_only:
        other = with_centres(tried, part, report)
        best = min((best, other), key=lambda fit: criterion(fit, part))
    report(0.95, "mesh feedback: zones of phase")
    found = search(best, part, data, zones=harmonics is None)
    best = found.fit if found.told is None else _with_more_poles(found.told.fit, found.part)
    report(1.0, "mesh feedback: last rounds")
    return _last_rounds(best, data, found)


@dataclass(frozen=True)
class Found:
    """A `fit` in harmonics to a `part` of the data without what folds back; what is `told` in zones, if it is; and the
    `folding`, where the model foretells any."""

    fit: Refined
    part: ClassData
    told: InZones | None
    folding: Folding | None = None

    @property
    def last(self) -> Refined:
        """The fit in zones, or else that in harmonics."""
        return self.told.fit if self.told is not None else self.fit

    @property
    def value(self) -> float:
        """Schwarz's criterion with the noise that is left beside what the record tells of the mesh."""
        count = 2 * self.part.equations
        return count * float(np.log(self.last.noise)) + self.last.model.free * float(np.log(count))


def search(best: Refined, part: ClassData, data: ClassData, *, zones: bool) -> Found:
    """What the record tells in `zones`, or harmonics, from the fit `best` to a `part` of it, without what folds back.

    A fit to a record that was not filtered takes in what folds back, and foretells something else then. Hence one to
    the record without the folded lines is found as well, beginning on lines that next to nothing folds onto, and speaks
    if it leaves less.
    """
    found = Found(best, part, in_zones(best, part, IN_ZONES) if zones else None)
    lines = folded_of(best, data)
    if lines is None:
        return found
    taken, clean = _approached(best, data, lines)
    value = criterion(taken, clean)
    other = Found(taken, clean, in_zones(taken, clean, IN_ZONES) if zones else None)
    if min(value - criterion(best, part), other.value - found.value) >= 0.0:
        return replace(found, folding=folding_of(found.last, data, 0.0))
    other = replace(other, folding=folding_of(other.last, data, 1.0))
    # Zones foretell it better than harmonics, and switches that begin with what these leave stay where they are.
    for _ in range(FORETOLD if zones else 0):
        if other.folding is None:
            break
        clean = fewer_classes(other.folding.removed(data), SEARCHED)
        taken = refined(other.fit.model, clean, COMPARED)
        before, other = other, Found(taken, clean, in_zones(taken, clean, IN_ZONES), other.folding)
        other = replace(other, folding=folding_of(other.last, data, 1.0))
        if other.folding is None or other.folding.like(before.folding, other.last.noise):
            break
    return other


def _approached(best: Refined, data: ClassData, lines: Complexes) -> tuple[Refined, ClassData]:
    """The fit to part of the data without folded lines, and that part, beginning with `best`, which may have taken in
    the folded `lines` (C, S, E) that it foretells: it is fitted first to lines that next to nothing folds onto."""
    clear = fewer_classes(only_lines(data, clear_lines(lines, data, best.noise)), SEARCHED)
    taken, tried = refined(best.model, clear, COMPARED), []
    # Lines that are subtracted as foretold are approached step by step, those that the model shows at once.
    for _ in range(1 if data.folds_inside else APPROACHED):
        clean = fewer_classes(without(data, folded(response(taken.model, data), data)), SEARCHED)
        taken = refined(taken.model, clean, COMPARED)
        tried.append((taken, clean))
    return min(tried, key=lambda each: criterion(*each))


def _last_rounds(best: Refined, data: ClassData, found: Found) -> Feedback:
    """The fit refined on all `data`, with what folds back foretold by ever better models."""
    folding, told = found.folding, found.told
    clean = folding.removed(data) if folding is not None else data
    ends, mesh = (SETTLED, None) if told is None else (IN_ZONES, best.mesh)
    last = refined(best.model, clean, ends, mesh)
    believed = float(folding.part > 0.5) if folding is not None else 0.0
    for _ in range(FORETOLD if folding is not None else 0):
        before, folding = folding, folding_of(last, data, believed)
        if folding is None or folding.like(before, last.noise):
            break
        clean = folding.removed(data)
        last = refined(last.model, clean, ends, last.mesh if told is not None else None)
    last, loud = settled(last, clean)
    last = folding.counted(last) if folding is not None else last
    return Feedback(clean, last, told.zones if told else None, told.gain if told else 0.0, folding, loud)


def _with_more_poles(best: Refined, part: ClassData) -> Refined:
    """The fit in zones with ever more pairs of poles as long as the criterion falls: those that the variance of
    harmonics hid."""
    assert best.mesh is not None
    zones = best.mesh.shapes.without_remainder()
    for _ in range(best.model.basis.pairs.shape[0], PAIRS):
        begun = min(extended(best.model, part, zones), key=lambda model: output_error(model, part))
        trial = refined(begun, part, COMPARED, best.mesh)
        if criterion(trial, part) > criterion(best, part) - GAIN:
            break
        best = trial
    return best


def _least(tried: list[Refined], part: ClassData) -> Refined:
    """The fit of least criterion; further ones must improve it by GAIN."""
    best = tried[0]
    for fit in tried[1:]:
        if criterion(fit, part) < criterion(best, part) - GAIN:
            best = fit
    return best


def _with_poles(first: Model, splines: Refined, part: ClassData, report: Progress) -> list[Refined]:
    """The `splines`, and partial fractions of ever more poles as long as the criterion falls."""
    best, tried = splines, [splines]
    for pairs in range(1, PAIRS + 1):
        report(pairs / (PAIRS + 1), f"mesh feedback: {pairs} pair(s) of poles")
        found = isinstance(best.model.basis, Fractions)
        trial = refined(further(best.model, part) if found else begin(first, splines, part, pairs), part, COMPARED)
        tried.append(trial)
        if criterion(trial, part) < criterion(best, part) - GAIN:
            best = trial
        elif found:
            break
    return tried


def with_centres(tried: list[Refined], part: ClassData, report: Progress) -> Refined:
    """The fit of least criterion that shows N Y + E U, as angles do of a rig whose centres move, from the fits `tried`
    of the form without E: splines again, then partial fractions of ever more poles.

    Poles that are added one at a time may end in poor minima, as E takes what the first pair does not explain. Hence
    those of the splines, and of the fits without E, are refined beside them.
    """
    model = tried[0].model
    none = np.zeros_like(model.n)
    rough = best = refined(Model(model.basis, model.d, model.n, model.k, model.c, none), part, CENTRES_SETTLED)
    for pairs in range(1, PAIRS + 1):
        report(pairs / (PAIRS + 1), f"mesh feedback from angles: {pairs} pair(s) of poles")
        begun = [rational(rough, part, pairs)]
        begun += [_halfway(fit.model) for fit in tried if fit.model.basis.pairs.shape[0] == pairs]
        found = isinstance(best.model.basis, Fractions)
        if found:
            begun.append(min(extended(best.model, part), key=lambda model: output_error(model, part)))
        trial = min((refined(one, part, COMPARED) for one in begun), key=lambda fit: criterion(fit, part))
        if criterion(trial, part) < criterion(best, part) - GAIN:
            best = trial
        elif found:
            break
    return best


def _halfway(model: Model) -> Model:
    """With N midway between 1 and that of a form without E, in partial fractions: about its root, as N comes twice."""
    n = 0.5 * model.n
    n[0] += 0.5
    return Model(model.basis, model.d, n, model.k, model.c, np.zeros_like(n))


def _too_short(spectra: Spectra, excited: int, unknowns: int, equations: float) -> str:
    """The sentence for a record of too few equations: its length, and about how many mesh periods would do.

    Of E realisations of d mesh periods E d - 1 parts of d are left of the lines without the operating response.
    """
    d, runs = spectra.mesh_lines, spectra.realisations
    needed = max(d + 1, int(np.ceil((unknowns * d / max(excited, 1) + 1) / runs)))
    return (
        f"under-determined: {runs} realisation(s) of {spectra.duration:.4g} s hold {d} mesh period(s) each,"
        f" {equations:.0f} equations beside the operating response for {unknowns} unknowns of the mesh-feedback model;"
        f" about {needed} mesh periods ({needed * spectra.duration / d:.3g} s) are needed: record longer or more"
        " realisations, or give fewer harmonics"
    )


def begin(first: Model, splines: Refined, data: ClassData, pairs: int) -> Model:
    """The model with `pairs` pairs of poles of least output error, of those that follow from the refined `splines` and
    from the equations with the harmonics of these or of the `first` model."""
    begun = [rational(splines, data, pairs)]
    for model in (splines.model, first):
        begun += linear_models(model, data, pairs)
    return min(begun, key=lambda model: output_error(model, data))


def further(model: Model, data: ClassData) -> Model:
    """The model with one more pair of poles of least output error: one added to its own, or all of them from the
    equations with its harmonics."""
    begun = [*extended(model, data), *linear_models(model, data, model.basis.pairs.shape[0] + 1)]
    return min(begun, key=lambda model: output_error(model, data))


def criterion(fit: Refined, data: ClassData) -> float:
    """Schwarz's criterion (1978): twice the equations times the log of their residual, plus the parameters of D and N
    times the log of twice the equations. Pairs that it does without are poles in noise, whose variance is large.

    The mesh's harmonics are the same for all that are compared, and held by their prior.
    """
    count = 2 * data.equations
    return count * float(np.log(fit.noise * fit.freedom)) + fit.model.free * float(np.log(count))


def rational(fit: Refined, data: ClassData, pairs: int) -> Model:
    """The model with partial fractions of `pairs` common poles fitted to D, N (and E) of another one, where it knows
    them."""
    model = fit.model
    position: NDArray[np.float64] = np.linspace(max(data.lowest, 1), data.excited, FITTED_POINTS) / data.top
    values = model.basis.at(position)
    parts = [model.d, model.n, *([model.e] if model.torsional else [])]
    weights = []
    for number, coefficients in enumerate(parts):
        own = slice(number * model.d.size, (number + 1) * model.d.size)
        variance = np.einsum("fi,ij,fj->f", values, fit.covariance[own, own], values.conj(), optimize=True).real
        weights.append(1.0 / np.sqrt(np.maximum(variance, 0.0) + (ROUGH * np.abs(values @ coefficients)) ** 2))
    wanted = [np.asarray(values @ coefficients) for coefficients in parts]
    basis = Fractions.limited(common_pairs(position, wanted, weights, pairs), data.least)
    fractions = basis.at(position)
    d, n, *e = (_fitted(fractions, f, weight) for f, weight in zip(wanted, weights, strict=True))
    return Model(basis, d, n, model.k, model.c, *e)


def extended(model: Model, data: ClassData, shapes: Shapes | None = None) -> list[Model]:
    """The model with one more pair of poles where, of PLACES, it lowers the output error most to first order; and the
    same without residues, which the first refining step finds with everything else, should these lead too far. Its mesh
    may follow, in all harmonics or in the `shapes` given."""
    known, least, count = model.basis.pairs, data.least, len(PLACES)
    kept, size_of = known.shape[0], np.array(PLACES) * data.excited / data.top
    placed = np.stack([2 * np.array(PLACED_DAMPING) * size_of, size_of**2], axis=1)
    basis = Fractions.limited(np.concatenate([known, placed]), least)
    start = _widened(model, basis, kept, count)
    gram, right = linearised(start, data, shapes)
    size, pairs = start.d.size, kept + count
    new = np.array([[3 + kept + place, 3 + pairs + kept + place] for place in range(count)])
    functions = 3 if model.torsional else 2
    new = np.concatenate([first * size + new for first in range(functions)], axis=1)  # residues of D, N (and E)
    poles = functions * size + np.arange(2 * pairs).reshape(2, pairs)[:, kept:]
    others = np.setdiff1d(np.arange(right.size), np.concatenate([new.ravel(), poles.ravel()]))
    best, chosen, residues = 0.0, 0, np.zeros(2 * functions)
    for place in range(count):
        own = np.concatenate([others, new[place]])
        part = gram[np.ix_(own, own)]
        scale = np.sqrt(np.maximum(np.diagonal(part), np.finfo(float).tiny))
        part = part / scale / scale[:, None]
        part[np.diag_indices_from(part)] += FIRMNESS
        step = np.linalg.solve(part, right[own] / scale)
        gain = float(step @ (right[own] / scale))
        if gain > best:
            best, chosen, residues = gain, place, (step / scale)[-2 * functions :]
    one, models = Fractions.limited(np.concatenate([known, placed[chosen : chosen + 1]]), least), []
    for part in (1.0, 0.0):
        wide = _widened(model, one, kept, 1)
        found = zip((wide.d, wide.n, wide.e), (part * residues).reshape(functions, 2), strict=False)
        for coefficients, (constant, slope) in found:
            coefficients[3 + kept], coefficients[4 + 2 * kept] = constant, slope
        models.append(wide)
    return models


def _widened(model: Model, basis: Fractions, kept: int, more: int) -> Model:
    """The same model on a basis of `more` pairs of poles beyond its `kept` ones."""
    d, n = (_spread(x, kept, more) for x in (model.d, model.n))
    return Model(basis, d, n, model.k, model.c, _spread(model.e, kept, more) if model.torsional else model.e)


def _spread(coefficients: NDArray[np.float64], kept: int, more: int) -> NDArray[np.float64]:
    """Coefficients of `kept` pairs of poles with zeros for `more` of them."""
    head, constants, slopes = np.split(coefficients, [3, 3 + kept])
    none = np.zeros(more)
    return np.concatenate([head, constants, none, slopes, none])


def _fitted(values: Complexes, response: Complexes, weight: NDArray[np.float64]) -> NDArray[np.float64]:
    matrix, target = values * weight[:, None], response * weight
    stacked = np.concatenate([matrix.real, matrix.imag])
    return np.asarray(np.linalg.lstsq(stacked, np.concatenate([target.real, target.imag]), rcond=None)[0])
