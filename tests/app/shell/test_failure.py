"""Every error of ours that carries a sentence for the user is known to the command line."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from gearbench.shell.failure import BAD_INPUT, DEFECT, USER_ERRORS, guarded, user_errors

ROOT = Path(__file__).resolve().parents[3]
PACKAGES = ("rig", "records", "geometry", "fem", "lumped", "identification", "bench")
BASES = {"ValueError", "ImportError"}


def errors_defined(package: str) -> list[tuple[str, str]]:
    """(module, class) of the exceptions that a package derives from ValueError or ImportError."""
    found = []
    for path in sorted((ROOT / package).rglob("*.py")):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if not isinstance(node, ast.ClassDef) or node.name.startswith("_"):
                continue
            if BASES & {getattr(base, "id", "") for base in node.bases}:
                module = ".".join(path.relative_to(ROOT).with_suffix("").parts)
                found.append((f"gearbench.{module}", node.name))
    return found


@pytest.mark.parametrize("package", PACKAGES)
def test_errors_of_every_package_are_listed(package: str) -> None:
    defined = errors_defined(package)
    assert defined
    assert set(defined) <= set(USER_ERRORS)


def test_listed_errors_exist() -> None:
    for module, name in USER_ERRORS:
        assert issubclass(getattr(__import__(module, fromlist=[name]), name), ValueError | ImportError | OSError)
    assert len(user_errors()) == len(USER_ERRORS)


def test_a_missing_folder_is_bad_input_and_a_bug_is_not(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def write() -> None:
        (tmp_path / "none" / "x").write_text("x")

    def divide() -> None:
        raise ZeroDivisionError("division by zero")

    assert guarded(write) == BAD_INPUT
    assert "No such file or directory" in capsys.readouterr().err
    assert guarded(divide) == DEFECT
    assert "defect of gearbench: ZeroDivisionError" in capsys.readouterr().err
