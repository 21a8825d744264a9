"""The cases of model files, run in parallel."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import replace
from pathlib import Path

from build_fmu.errors import UserError
from build_fmu.model.describe import describe
from build_fmu.stress.cases import GROUPS, Case, catalogue
from build_fmu.stress.run import Verdict, run_case

Work = Sequence[tuple[str, Case]]  # names of models, and cases


def work_of(files: Sequence[Path], words: Sequence[str]) -> Work:
    """Returns the cases of the model files in the groups that match a word, or in all groups; `describe` checks the files first."""
    wanted = [group for group in GROUPS if not words or any(word in group for word in words)]
    if not wanted:
        raise UserError(f"no group of cases matches '{words[0]}'; available: {', '.join(GROUPS)}")
    found = []
    for file in files:
        table = describe(file)
        experiment, tables = table.default_experiment, tuple(file.parent / name for name in table.resources)
        cases = catalogue(tomllib.loads(file.read_text(encoding="utf-8-sig")), experiment["stop_time"], experiment["step_size"])
        found += [(file.stem, replace(case, files=tables)) for case in cases if case.group in wanted]
    return found


def run_all(work: Work, seconds: float, method: str | None, jobs: int) -> Iterator[tuple[int, Verdict]]:
    """Yields the number and the verdict of each case when it has finished."""
    with ThreadPoolExecutor(jobs) as pool:
        futures = {pool.submit(run_case, model, case, seconds, method): i for i, (model, case) in enumerate(work)}
        try:
            for future in as_completed(futures):
                yield futures[future], future.result()
        finally:
            pool.shutdown(wait=False, cancel_futures=True)
