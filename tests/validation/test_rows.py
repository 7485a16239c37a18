"""Every row of `gearbench validate`, as a test (long: run with `-m validation`)."""

import pytest

from gearbench.commands.house.checks import Check, checks, run


@pytest.mark.validation
@pytest.mark.parametrize("check", checks(), ids=lambda check: check.name)
def test_reach(check: Check) -> None:
    (result,) = run([check])
    if result.outcome == "not-run":
        pytest.skip(result.note)
    assert result.outcome == "pass", f"{check.what}: got {result.got:g}, reach {check.reach:g} {check.unit}"
