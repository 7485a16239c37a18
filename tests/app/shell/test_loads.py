"""How several loads are given, and questions about a case on stderr."""

from __future__ import annotations

import pytest

from gearbench.shell.failure import InputError
from gearbench.shell.options import expand_lists, load_case


@pytest.mark.parametrize("given", [["--torque-nm", "50,100"], ["--torque-nm=50, 100"]])
def test_commas_between_loads_are_explained(given: list[str]) -> None:
    with pytest.raises(InputError, match="spaces between them: --torque-nm 50 100"):
        expand_lists(given, ["--torque-nm"])
    assert expand_lists(["--set", "rig.driver.pitch_error_um=[1,2]"], ["--torque-nm"])[-1].endswith("[1,2]")


def test_a_smelling_value_is_questioned_once_on_stderr(capsys: pytest.CaptureFixture[str]) -> None:
    load_case("quick_lumped", ["rig.driver.face_width_mm=0.02"])
    assert capsys.readouterr().err.count("face_width_mm = 0.02 is unusual") == 1
