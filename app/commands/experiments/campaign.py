"""`campaign CASE --vary KEY=.. --out DIR`: many members of a case, and what comes out of them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from gearbench.shell.options import CaseArgument, JsonOption, SetOption, load_case, print_json
from gearbench.shell.progress import Progress

if TYPE_CHECKING:
    import xarray as xr

    from gearbench.bench.study.indices import Effects

MOST_SENTENCES = 5

VaryOption = Annotated[
    list[str] | None,
    typer.Option(
        "--vary",
        metavar="KEY=VALUES",
        help="what varies: KEY=V1,V2,.. | LOW:HIGH:COUNT | LOW:HIGH | normal(MEAN,SD); KEY1+KEY2 move together",
    ),
]
OfOption = Annotated[
    list[str] | None, typer.Option("--of", metavar="RESULT", help="what is wanted: te-peak-to-peak, first-mode, ..")
]
SampleOption = Annotated[
    Literal["grid", "lhs", "sobol"] | None,
    typer.Option("--sample", help="every combination, a Latin hypercube, or a Sobol design; absent: grid"),
]
SizeOption = Annotated[
    int | None, typer.Option("--size", help="members of lhs; base points of sobol: keys + 2 times as many members")
]
TorqueOption = Annotated[
    float | None, typer.Option("--torque-nm", help="load of static and ISO results; absent: the case's mean")
]
AgainstOption = Annotated[
    Path | None, typer.Option("--against", metavar="RECORD", help="measured record, for the result gap")
]
WorkersOption = Annotated[
    int | None, typer.Option("--workers", min=1, help="processes (Slurm: jobs); absent: one a processor")
]
ClusterOption = Annotated[
    str | None, typer.Option("--cluster", metavar="ADDRESS", help="dask scheduler, tcp://HOST:PORT, or slurm")
]


def campaign(
    case: CaseArgument,
    vary: VaryOption = None,
    of: OfOption = None,
    out: Annotated[Path | None, typer.Option("--out", help="output folder; absent: study_NAME")] = None,
    sample: SampleOption = None,
    size: SizeOption = None,
    seed: Annotated[int | None, typer.Option("--seed", help="seed of lhs and sobol")] = None,
    torque_nm: TorqueOption = None,
    positions: Annotated[int | None, typer.Option("--positions", help="mesh phases of a mesh cycle")] = None,
    cycles: Annotated[int | None, typer.Option("--cycles", help="mesh cycles, where teeth differ")] = None,
    against: AgainstOption = None,
    workers: WorkersOption = None,
    cluster: ClusterOption = None,
    force: Annotated[
        bool, typer.Option("--force", help="replace what another study or other sources left in the folder")
    ] = False,
    settings: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Compute many members of a case: grids, Latin hypercubes, Sobol designs; table, indices, pictures, report.

    Resumes in its own folder. What is not given here is taken from the case's table "study". docs/campaigns.md lists
    the results.
    """
    loaded = load_case(case, settings)
    import gearbench as gb
    from gearbench.words.study import effects_from, failures

    folder = out or Path(f"study_{re.sub(r'[^A-Za-z0-9._-]+', '_', loaded.name)}")
    with Progress(f"campaign {loaded.name}") as progress:
        table = gb.campaign(
            case, folder, vary or (), of=split(of), sample=sample, size=size, seed=seed, torque=torque_nm,
            positions=positions, cycles=cycles, against=against, settings=settings or (),
            workers=workers, cluster=cluster, force=force,
            progress=progress,
        )  # fmt: skip
    effects = effects_from((folder / "effects.csv").read_text(encoding="utf-8"))
    summary = study_summary(table, effects, folder)
    if as_json:
        print_json(summary)
    else:
        typer.echo("\n".join(_lines(table, effects, summary, folder)))
    if summary["failed"] == summary["members"]:
        from gearbench.shell.failure import InputError

        raise InputError(f"no member has a result: {failures(table)[0][0]}")


def split(of: list[str] | None) -> list[str]:
    """Names given one by one or with commas."""
    return [name.strip() for text in of or () for name in text.split(",") if name.strip()]


def study_summary(table: xr.Dataset, effects: Sequence[Effects], folder: Path) -> dict[str, Any]:
    """Members, failures, and each result's range and indices."""
    from gearbench.bench.study.table import named
    from gearbench.words.study import failures

    good = table["sentence"].values == ""
    results: dict[str, dict[str, Any]] = {}
    for name in named(table, "result"):
        values = table[name].values[good]
        spread = {"least": values.min(), "mean": values.mean(), "most": values.max()} if values.size else {}
        results[name] = {"unit": table[name].attrs["units"], **{key: float(one) for key, one in spread.items()}}
    for one in effects:
        results[one.result]["effects"] = [asdict(each) for each in one.each]
    return {
        "folder": str(folder),
        "members": int(table.sizes["member"]),
        "failed": int((~good).sum()),
        "factors": named(table, "factor"),
        "results": results,
        "sentences": dict(failures(table)),
    }


def _lines(table: xr.Dataset, effects: Sequence[Effects], summary: dict[str, Any], folder: Path) -> list[str]:
    from gearbench.words.study import best, decider, failures, span_line

    lines = [span_line(table, name) for name in summary["results"]]
    lines += [line for one in effects if (line := decider(one))]
    first = next(iter(summary["results"]))
    lines += [line for line in [best(table, first, summary["factors"])] if line]
    said = failures(table)
    if summary["failed"]:
        lines.append(f"{summary['failed']} of {summary['members']} members failed:")
        lines += [f"  {count} x {sentence}" for sentence, count in said[:MOST_SENTENCES]]
        lines += [f"  and {len(said) - MOST_SENTENCES} other sentences"] if len(said) > MOST_SENTENCES else []
    return [*lines, f"{folder}: report.html, study.csv, study.nc, effects.csv"]
