"""The local polynomial method on systems that it can represent exactly, and its refusals."""

import numpy as np
import pytest
from shared.ptv import periodic_filter, spectra_of

from gearbench.identification.lpm.estimate import LpmResult, local_polynomial, plan_centres
from gearbench.identification.lpm.gram import gram_of, gram_table, grams
from gearbench.identification.lpm.local_solve import LpmError, solve_windows
from gearbench.identification.lpm.regression import Regression, Window, prepare
from gearbench.identification.lpm.rows import WindowRows
from gearbench.identification.spectra.joint import Spectra

HIGHEST = 120


def polynomial_spectra(
    *,
    experiments: int,
    mesh_lines: int,
    harmonics: int,
    order: int,
    operating: float = 0.0,
    transient: float = 0.0,
    start: np.ndarray | None = None,
    grid: int = 1,
    seed: int = 0,
) -> tuple[Spectra, np.ndarray]:
    """Spectra of Y(k) = sum_l Gs_l(k) U(k - l d) with polynomial Gs_l, and the true G_l(k) (2L+1, lines 0..K).

    Written straight from the definition, line by line. `operating` adds the same response at mesh harmonics to all
    experiments, `transient` one polynomial in k to each; `start`: mesh phase of each record's first sample.
    """
    rng = np.random.default_rng(seed)
    d, top = mesh_lines, HIGHEST
    coefficients = rng.standard_normal((harmonics + 1, order + 1)) + 1j * rng.standard_normal(
        (harmonics + 1, order + 1)
    )
    coefficients[0] = coefficients[0].real  # G_0(-k) = conj G_0(k)

    def shifted(branch: int, line: int) -> complex:
        """Gs_l(k) = sum_p c_lp (j k / K)^p with c_{-l} = conj c_l: a real system."""
        c = coefficients[abs(branch)]
        c = c if branch >= 0 else c.conj()
        return complex(sum(c[p] * (1j * line / top) ** p for p in range(order + 1)))

    phases = np.zeros(experiments) if start is None else start
    force = rng.standard_normal((experiments, top + 1)) + 1j * rng.standard_normal((experiments, top + 1))
    force[:, np.arange(top + 1) % grid != grid - 1] = 0.0
    force[:, 0] = 700.0  # the mean force: its response is the same in all records, part of the operating one
    both = np.concatenate([force[:, :0:-1].conj(), force], axis=1)
    response = np.zeros((experiments, top + 1), dtype=complex)
    for line in range(top + 1):
        for branch in range(-harmonics, harmonics + 1):
            source = line - branch * d
            if abs(source) <= top:
                turn = np.exp(2j * np.pi * branch * phases)
                response[:, line] += shifted(branch, line) * turn * both[:, source + top]
    lines = np.arange(top + 1)
    for m in range(top // d + 1):
        response[:, m * d] += operating * (m + 1j) * np.exp(2j * np.pi * m * phases)
    leak = rng.standard_normal((experiments, 2)) + 1j * rng.standard_normal((experiments, 2))
    response += transient * (leak[:, :1] + leak[:, 1:] * lines / top)
    truth = np.array(
        [[shifted(branch, int(k) + branch * d) for k in lines] for branch in range(-harmonics, harmonics + 1)]
    )
    return Spectra(force, response, 1.0, d, phases, steady=transient == 0.0), truth


def worst(result: LpmResult, truth: np.ndarray) -> float:
    return float(np.abs(result.htf - truth[:, result.lines]).max() / np.abs(truth).max())


LINES = np.arange(30, 80, 2)


@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize("mesh_lines", [1, 2, 5])
def test_polynomial_system_is_recovered_to_rounding(mesh_lines: int, order: int) -> None:
    spectra, truth = polynomial_spectra(experiments=6, mesh_lines=mesh_lines, harmonics=3, order=order, operating=40.0)
    result = local_polynomial(spectra, LINES, Window(3, order, 6, transient=False))
    assert worst(result, truth) < 1e-10
    assert result.residual < 1e-10


@pytest.mark.parametrize("experiments", [1, 4])
def test_transients_are_told_apart(experiments: int) -> None:
    spectra, truth = polynomial_spectra(
        experiments=experiments, mesh_lines=4, harmonics=2, order=1, operating=40.0, transient=30.0
    )
    window = Window(2, 1, 14, transient=True)
    result = local_polynomial(spectra, LINES, window)
    assert worst(result, truth) < 1e-10
    assert result.unknowns == (1 + 1) * (5 + experiments)
    # The same without transient columns is wrong by far: they matter here.
    assert worst(local_polynomial(spectra, LINES, Window(2, 1, 14, transient=False)), truth) > 0.1


@pytest.mark.parametrize("transient", [False, True])
def test_branches_refer_to_the_mesh_phase_of_each_record(transient: bool) -> None:
    start = np.array([0.0, 0.21, 0.77, 5.4, -0.3, 0.5])
    spectra, truth = polynomial_spectra(
        experiments=6, mesh_lines=4, harmonics=2, order=1, operating=40.0, transient=3.0 * transient, start=start
    )
    assert worst(local_polynomial(spectra, LINES, Window(2, 1, 8, transient)), truth) < 1e-10


def test_odd_grid_leaves_even_rows_out() -> None:
    spectra, truth = polynomial_spectra(experiments=4, mesh_lines=4, harmonics=2, order=1, grid=2)
    # What appears on rows that no input reaches (noise, even distortion) is not the linear model's residual.
    spectra.dte[:, 1::2][:, spectra.force[0, 1::2] == 0] += 100.0
    result = local_polynomial(spectra, LINES, Window(2, 1, 8, transient=False))
    assert worst(result, truth) < 1e-10
    assert result.residual < 1e-10
    regression = prepare(spectra, transient=False, reach=8)
    # Of the 17 lines around line 50 (even, no multiple of 4 is odd) 8 are odd: 8 x 4 equations.
    assert WindowRows(regression, np.array([50]), Window(2, 1, 8, transient=False)).equations.tolist() == [8 * 4]


def test_branch_zero_alone_is_the_time_invariant_case() -> None:
    spectra, truth = polynomial_spectra(experiments=1, mesh_lines=7, harmonics=0, order=2, operating=3.0)
    result = local_polynomial(spectra, LINES, Window(0, 2, 6, transient=False))
    assert result.htf.shape == (1, LINES.size)
    assert worst(result, truth) < 1e-10


def test_time_domain_filter_is_identified() -> None:
    """An LPTV filter run in time: ITF against its closed form, phase included; its G_l are smooth, not polynomial."""
    system = periodic_filter(3, 32)
    force = np.random.default_rng(5).standard_normal((4, 4096))
    spectra = spectra_of(force, system.response(force), 128)
    result = local_polynomial(spectra, np.arange(20, 1000, 20), Window(3, 2, 6, transient=False))
    wanted = system.htf(result.lines / 4096, 3)
    assert np.abs(result.htf - wanted).max() < 1e-4 * np.abs(wanted).max()


def test_filter_from_rest_needs_the_transient() -> None:
    system = periodic_filter(2, 32)
    force = np.random.default_rng(6).standard_normal((5, 4096))
    spectra = spectra_of(force, system.from_rest(force), 128, steady=False)
    lines = np.arange(20, 1000, 20)
    wanted = system.htf(lines / 4096, 2)
    errors = [
        np.abs(local_polynomial(spectra, lines, Window(2, 3, 9, transient)).htf - wanted).max()
        for transient in (True, False)
    ]
    assert errors[0] < 1e-5 * np.abs(wanted).max()
    assert errors[1] > 100 * errors[0]


def fitted(regression: Regression, window: Window, centre: int) -> tuple[np.ndarray, np.ndarray, float]:
    """Coefficients and residual power from `solve_windows`, coefficients by dense least squares."""
    gram = gram_of(gram_table(regression, centre, centre, window), 0, window)
    rows = WindowRows(regression, np.array([centre]), window)
    fit = solve_windows(rows, gram[None], want_roots=[0], want_condition=[0])
    matrix = rows.matrix().reshape(-1, window.unknowns)
    dense = np.linalg.lstsq(matrix, rows.data.ravel(), rcond=None)[0]
    scaled = matrix / np.linalg.norm(matrix, axis=0)
    assert fit.condition[0] == pytest.approx(np.linalg.cond(scaled), rel=0.1)
    inverse = np.linalg.pinv(matrix.conj().T @ matrix)
    assert fit.roots[0].conj().T @ fit.roots[0] == pytest.approx(inverse, abs=1e-10 * np.abs(inverse).max())
    return fit.coefficients.ravel(), dense, float(fit.residual[0])


@pytest.mark.parametrize("transient", [False, True])
def test_shared_gram_matrices_solve_the_written_down_regression(transient: bool) -> None:
    system = periodic_filter(4, 16)
    rng = np.random.default_rng(7)
    force = rng.standard_normal((3, 256))
    spectra = spectra_of(force, system.response(force) + rng.standard_normal((3, 256)), 16, steady=not transient)
    window = Window(2, 1, 9, transient)
    regression = prepare(spectra, transient=transient, reach=32)
    centres = [37 + 16 * index for index in range(4)]
    table = gram_table(regression, centres[0], centres[-1], window)
    found: dict[int, np.ndarray] = {}
    for indices, _, many in grams(regression, centres, window):
        found |= dict(zip(indices, many, strict=True))
    for index in range(4):
        centre = centres[index]
        rows = WindowRows(regression, np.array([centre]), window)
        matrix = rows.matrix().reshape(-1, window.unknowns)
        gram = gram_of(table, index, window)
        assert found[index] == pytest.approx(gram, abs=1e-12 * np.abs(gram).max())
        if transient:
            taken = rows.transient_products()[0]
            gram = gram - taken.conj().T @ taken
        assert gram == pytest.approx(matrix.conj().T @ matrix, abs=1e-10 * np.abs(gram).max())
        normal, dense, residual = fitted(regression, window, centre)
        assert normal == pytest.approx(dense, abs=1e-10 * np.abs(dense).max())
        left = rows.data.ravel() - matrix @ dense
        assert residual == pytest.approx(np.linalg.norm(left) ** 2, rel=1e-9)
        # Every nuisance direction costs one equation: rank of the projected space.
        assert rows.equations.tolist() == [_rank_of_rows(regression, centre, window)]


def _rank_of_rows(regression: Regression, centre: int, window: Window) -> int:
    """Dimension of the space of data that survive dropped rows and projection, by brute force."""
    shape = (regression.experiments, window.width)
    kept = np.ones(shape)
    kept[: regression.operating_rows_lost, (centre + np.arange(-9, 10)) % 16 == 0] = 0.0
    rows = np.eye(kept.size) * kept.ravel()
    source = WindowRows(regression, np.array([centre]), window)
    projected = [source.project(r.reshape(1, *shape).astype(complex)).ravel() for r in rows]
    return int(np.linalg.matrix_rank(np.array(projected), tol=1e-9))


@pytest.mark.parametrize("distance", [1e-3, 1e-6])
def test_nearly_dependent_inputs(distance: float) -> None:
    """Condition number 1 / distance: the corrected normal equations up to 1e5, singular values beyond."""
    spectra, truth = polynomial_spectra(experiments=6, mesh_lines=2, harmonics=1, order=0)
    close = spectra.force.copy()
    close[:, 1:] = close[:, 1:2] + distance * close[:, 1:]
    close[:, 0] = 0.0
    both = np.concatenate([close[:, :0:-1].conj(), close], axis=1)
    response = np.zeros_like(close)
    for branch in (-1, 0, 1):
        for line in range(HIGHEST + 1):
            source = line - 2 * branch
            if abs(source) <= HIGHEST:
                response[:, line] += truth[branch + 1, 0] * both[:, source + HIGHEST]
    bad = Spectra(close, response, 1.0, 2, np.zeros(6), True)
    result = local_polynomial(bad, np.arange(40, 60), Window(1, 0, 2, transient=False))
    assert result.condition > 0.3 / distance
    # Rounding times condition number; once more the condition number without the correction.
    assert np.abs(result.htf - truth[:, :1]).max() < 3e-14 / distance * np.abs(truth).max()


def test_dependent_inputs_are_refused() -> None:
    spectra, _ = polynomial_spectra(experiments=6, mesh_lines=2, harmonics=1, order=0)
    same = np.repeat(spectra.force[:, 1:2], HIGHEST + 1, axis=1)
    bad = Spectra(same, spectra.dte, 1.0, 2, np.zeros(6), True)
    with pytest.raises(LpmError, match=r"numerically dependent.*condition number.*random phases.*harmonics = 1"):
        local_polynomial(bad, LINES, Window(1, 0, 2, transient=False))


def test_under_determined_request_is_refused_with_the_numbers() -> None:
    spectra, _ = polynomial_spectra(experiments=1, mesh_lines=2, harmonics=2, order=1)
    with pytest.raises(LpmError) as refusal:
        local_polynomial(spectra, LINES, Window(4, 1, 5, transient=True))
    sentence = str(refusal.value)
    # 2 (2 4 + 1) = 18 unknowns; of 11 lines 5 or 6 are mesh harmonics, and 2 equations go to the transient.
    assert "L = 4" in sentence and "18 unknowns and 2 of transients" in sentence
    assert "leave 3 equations" in sentence or "leave 4 equations" in sentence
    assert "window n = " in sentence and "realisations" in sentence


def test_what_the_refusal_calls_sufficient_suffices() -> None:
    spectra, _ = polynomial_spectra(experiments=2, mesh_lines=3, harmonics=2, order=1)
    with pytest.raises(LpmError) as refusal:
        local_polynomial(spectra, LINES, Window(4, 1, 3, transient=False))
    wanted = int(str(refusal.value).split("window n = ")[1].split(",")[0])
    local_polynomial(spectra, LINES, Window(4, 1, wanted, transient=False))


def test_sidebands_beyond_the_spectra_are_refused() -> None:
    spectra, _ = polynomial_spectra(experiments=6, mesh_lines=10, harmonics=1, order=0)
    with pytest.raises(LpmError, match=r"sidebands of 78 Hz at 138 Hz.*120 Hz; at most 4 fit"):
        local_polynomial(spectra, LINES, Window(6, 0, 2, transient=False))


def test_each_needed_row_is_served_once_inside_its_window() -> None:
    rows = np.array([0, 1, 2, 5, 6, 7, 8, 30, 31, 33, 40])
    plan = plan_centres(rows, Window(1, 1, 6, transient=False), highest=42)
    assert np.concatenate([served for _, served in plan]).tolist() == rows.tolist()
    for centre, served in plan[:-1]:
        assert np.abs(served - centre).max() <= 2
    assert plan[-1][0] == 36  # the last window must not reach beyond the spectra
