"""A parameter sweep on a Dask cluster: every combination of values is a run of the FMU; the result is one Parquet table.

python examples/sweep.py MODEL.toml --vary elbow.damping=0,0.1,1 --vary shoulder.q0=0:1:11 -o sweep.parquet
python examples/sweep.py MODEL.toml --vary ... --scheduler tcp://host:8786      workers on other machines

A value list is a,b,c or first:last:count. The table contains the final value, minimum and maximum of the selected outputs. Runs of a
lost worker are repeated by another one; the message of a failed run is in the column `error`. Needs
`pip install 'build-fmu[sweep]'`.
"""

from __future__ import annotations

import argparse
import itertools
import tempfile
from pathlib import Path

import numpy as np

from build_fmu import Session, Settings, UserError, build, describe, simulate

RETRIES = 5  # of a run if its worker is lost


def values_of(text: str) -> tuple[str, list[float]]:
    """Reads NAME=a,b,c or NAME=first:last:count."""
    name, equals, values = text.partition("=")
    try:
        if values.count(":") == 2:
            first, last, count = values.split(":")
            return name, [float(x) for x in np.linspace(float(first), float(last), int(count))]
        return name, [float(value) for value in values.split(",")]
    except ValueError:
        raise UserError(f"'{text}' is not a list of values; use NAME=1,2,3 or NAME=0:1:11") from None


def one_run(fmu: bytes, point: dict[str, float], stop: float | None, outputs: list[str]) -> dict[str, float | str]:
    """Runs the FMU at one point. The FMU is passed as bytes, so a worker needs no files."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "model.fmu"
        file.write_bytes(fmu)
        try:
            with Session(file) as session:
                result = simulate(session, Settings(stop, None, None, [f"{name}={value!r}" for name, value in point.items()], (), outputs))
        except UserError as error:
            return {**point, "error": str(error)}
    row: dict[str, float | str] = {**point, "error": ""}
    for name in result.names:
        column = result[name]
        row |= {f"{name} end": float(column[-1]), f"{name} min": float(column.min()), f"{name} max": float(column.max())}
    return row


def sweep(client, fmu: bytes, points: list[dict[str, float]], stop: float | None, outputs: list[str], tell=print) -> list[dict]:
    """Returns one row per point, in order; `tell` receives a progress line at each tenth."""
    from dask.distributed import as_completed

    shared = client.scatter(fmu, broadcast=True, hash=True)
    futures = {client.submit(one_run, shared, point, stop, outputs, retries=RETRIES, pure=False): i for i, point in enumerate(points)}
    rows: list[dict] = [{} for _ in points]
    for done, (future, row) in enumerate(as_completed(futures, with_results=True), start=1):
        rows[futures[future]] = row
        if done * 10 // len(points) > (done - 1) * 10 // len(points) or done == len(points):
            tell(f"{done} of {len(points)} runs")
    return rows


def write(target: Path, rows: list[dict]) -> None:
    """Writes the rows as Parquet; a failed run has empty cells and an error message."""
    import pyarrow
    import pyarrow.parquet

    names = list(dict.fromkeys(name for row in rows for name in row if name != "error"))
    columns = {name: pyarrow.array([row.get(name) for row in rows], pyarrow.float64()) for name in names}
    columns["error"] = pyarrow.array([row["error"] for row in rows], pyarrow.string())
    pyarrow.parquet.write_table(pyarrow.table(columns), target)


def main() -> None:
    parser = argparse.ArgumentParser(description="Run an FMU at every combination of parameter values.")
    parser.add_argument("model", type=Path, help="model file (.toml) or FMU")
    parser.add_argument("--vary", action="append", required=True, metavar="NAME=VALUES", help="a,b,c or first:last:count; repeatable")
    parser.add_argument("--output", nargs="+", default=["*.q", "energy.balance"], help="outputs to record, * allowed")
    parser.add_argument("--stop", type=float, help="stop time in s")
    parser.add_argument("--scheduler", help="address of a Dask scheduler (default: local workers)")
    parser.add_argument("--workers", type=int, help="number of local workers (default: one per processor)")
    parser.add_argument("-o", "--table", type=Path, default=Path("sweep.parquet"), help="table to write")
    options = parser.parse_args()
    try:
        from dask.distributed import Client, LocalCluster
    except ImportError:
        raise SystemExit("the sweep needs Dask and pyarrow: pip install 'build-fmu[sweep]'") from None
    try:
        fmu = packed(options.model)
        axes = dict(map(values_of, options.vary))
    except UserError as error:
        raise SystemExit(str(error)) from None
    points = [dict(zip(axes, values, strict=True)) for values in itertools.product(*axes.values())]
    cluster = None if options.scheduler else LocalCluster(n_workers=options.workers, threads_per_worker=1, dashboard_address=None)
    with Client(options.scheduler or cluster) as client:
        rows = sweep(client, fmu, points, options.stop, options.output)
    if cluster:
        cluster.close()
    write(options.table, rows)
    failed = [row["error"] for row in rows if row["error"]]
    print(f"{options.table}  {len(rows)} runs, {len(failed)} failed" + (f", the first: {failed[0]}" if failed else ""))


def packed(model: Path) -> bytes:
    """Returns the bytes of an FMU, built first if a model file is given."""
    if model.suffix == ".fmu":
        return model.read_bytes()
    with tempfile.TemporaryDirectory() as folder:
        fmu = Path(folder) / "model.fmu"
        build(describe(model), model, fmu)
        return fmu.read_bytes()


if __name__ == "__main__":
    main()
