"""What is said of excitation periods that hold no whole number of mesh periods."""

import pytest

from gearbench.identification import SpectraError
from gearbench.identification.spectra.joint import joint_periods


@pytest.mark.parametrize(
    ("periods", "mesh_frequency", "said"),
    [
        (1, 37.3, "record 10 excitation periods, which hold 373 mesh periods, or an excitation period of 37 or 38"),
        (15, 37.3, "give a multiple of 10 excitation periods, which hold 373 mesh periods"),
        (4, 0.3, "record 10 excitation periods, which hold 3 mesh periods, or longer ones"),
    ],
)
def test_the_way_out_is_said(periods: int, mesh_frequency: float, said: str) -> None:
    with pytest.raises(SpectraError, match="needs a whole number of them") as error:
        joint_periods(8192, 8192.0, periods, 1 / mesh_frequency)
    assert said in str(error.value)


def test_ten_periods_are_one_joint_period() -> None:
    assert joint_periods(8192, 8192.0, 10, 1 / 37.3) == (10, 373)
