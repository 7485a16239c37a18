"""What varies in a case: the words of --vary, the table [study], and what a dotted key is."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gearbench.cases import case_path
from gearbench.rig import CaseError, Study, dump_case, read_case
from gearbench.rig.casefile.keys import key_of_case
from gearbench.rig.study import Axis, parse_axis

RELIEF, OTHER, BAND = "rig.driver.tip_relief_um", "rig.driven.tip_relief_um", "experiment.multisine.band_hz"


@pytest.mark.parametrize(
    ("text", "axis"),
    [
        (f"{RELIEF}=0,5,10.5", Axis((RELIEF,), "levels", ("0", "5", "10.5"))),
        (f" {RELIEF} = 0:40:5", Axis((RELIEF,), "range", low=0.0, high=40.0, count=5)),
        (f"{RELIEF}=-1e1:40", Axis((RELIEF,), "interval", low=-10.0, high=40.0)),
        (f"{RELIEF}=normal(20, 3)", Axis((RELIEF,), "normal", low=20.0, high=3.0)),
        (f"{RELIEF}+{OTHER}=1:2", Axis((RELIEF, OTHER), "interval", low=1.0, high=2.0)),
        ('rig.driver=a.toml,"b,c.toml"', Axis(("rig.driver",), "levels", ("a.toml", '"b,c.toml"'))),
        (f"{BAND}=[1,2],[3,4]", Axis((BAND,), "levels", ("[1,2]", "[3,4]"))),
    ],
)
def test_words_become_an_axis(text: str, axis: Axis) -> None:
    assert parse_axis(text) == axis


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "must read"),
        (RELIEF, "must read KEY=V1,V2"),
        (f"{RELIEF}=", "must read"),
        ("rig driver=1,2", "must read"),
        (f"{RELIEF}=1,,2", "an empty value"),
        (f"{RELIEF}=1,1", "names a value twice"),
        (f"{RELIEF}+{RELIEF}=1,2", "names a key twice"),
        (f"{RELIEF}=5:1:3", "5 must be less than 1"),
        (f"{RELIEF}=0:1:1", "whole number from 2"),
        (f"{RELIEF}=0:1:2.5", "whole number from 2"),
        (f"{RELIEF}=0:1:2:3", "must read KEY=LOW:HIGH:COUNT"),
        (f"{RELIEF}=a:b:3", "'a' must be a number"),
        (f"{RELIEF}=0:inf:3", "finite"),
        (f"{RELIEF}=normal(1)", "normal(MEAN,SD)"),
        (f"{RELIEF}=normal(1,-2)", "greater than 0"),
    ],
)
def test_what_is_no_axis_is_refused_in_a_sentence(text: str, sentence: str) -> None:
    with pytest.raises(CaseError) as caught:
        parse_axis(text)
    assert sentence in str(caught.value) and "\n" not in str(caught.value)


# What axes are written with, and what nobody writes them with.
SIGNS = "rigdvetpsno_mal0123456789.,:=()[]{}+-*e '\"\\#\n\t\0\x85µé中\u2028😀"


@given(st.text(st.sampled_from(SIGNS), max_size=40))
@settings(max_examples=25, deadline=None)
def test_any_text_is_an_axis_or_a_sentence(text: str) -> None:
    try:
        axis = parse_axis(text)
    except CaseError as error:
        assert str(error)
    else:
        assert axis.keys and (axis.levels or axis.high)


def test_keys_say_what_they_are() -> None:
    assert key_of_case(RELIEF)[:2] == ("number", "um")
    assert key_of_case("rig.driven.teeth")[:2] == ("whole", "")
    assert key_of_case("rig.support.stiffness_n_per_m")[:2] == ("number", "N/m")
    assert key_of_case("rig.driver.pitch_error_um.3")[:2] == ("number", "um")
    assert key_of_case("rig.driver").kind == "text"


@pytest.mark.parametrize(
    ("key", "sentence"),
    [
        ("rig.driver.tip_relef_um", "did you mean tip_relief_um"),
        ("rig.drivr.teeth", "did you mean driver"),
        ("rig.driver.tip_relief", "spelt tip_relief_um"),
        ("rig.driver.teeth.x", "is a value and not a table"),
        ("rig.support", "is a table"),
    ],
)
def test_what_is_no_key_is_refused_with_the_nearest(key: str, sentence: str) -> None:
    with pytest.raises(CaseError, match=sentence):
        key_of_case(key)


STUDIES = st.builds(
    Study,
    vary=st.lists(st.sampled_from([f"{RELIEF}=1,2", "rig.driven.teeth=2:9:8", "name='a','b'"]), unique=True).map(tuple),
    of=st.lists(st.sampled_from(["te-mean", "first-mode"]), unique=True).map(tuple),
    sample=st.sampled_from(["grid", "lhs", "sobol"]),
    size=st.integers(2, 2**24),
    seed=st.integers(0, 2**63 - 1),
    torque=st.none() | st.floats(1e-3, 1e6),
    positions=st.integers(8, 65536),
    cycles=st.integers(1, 8192),
)  # fmt: skip


@given(study=STUDIES)
@settings(max_examples=30, deadline=None)
def test_a_study_survives_the_file(study: Study, tmp_path_factory: pytest.TempPathFactory) -> None:
    case = read_case(case_path("quick_lumped")).model_copy(update={"study": study})
    path = tmp_path_factory.mktemp("study") / "case.toml"
    path.write_text(dump_case(case), encoding="utf-8")
    assert read_case(path) == case


@pytest.mark.parametrize(
    ("lines", "sentence"),
    [
        ('vary = ["rig.driver.teeth=1:2:3:4"]', "study: --vary"),
        ('vary = ["rig.driver.teeth=1,2", "rig.driver.teeth=3,4"]', "varies twice"),
        ('vary = "rig.driver.teeth=1,2"', "must be a list of texts"),
        ('sample = "sobl"', "did you mean"),
        ("size = 1", "at least 2"),
        ("sise = 4", "did you mean size"),
    ],
)
def test_a_study_table_is_checked(lines: str, sentence: str, tmp_path: Path) -> None:
    path = tmp_path / "case.toml"
    path.write_text(f"{dump_case(read_case(case_path('quick_lumped')))}\n[study]\n{lines}\n", encoding="utf-8")
    with pytest.raises(CaseError, match=sentence):
        read_case(path)
