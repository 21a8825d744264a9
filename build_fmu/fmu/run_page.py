"""The page documentation/run.html of an FMU, which plays its default experiment without inputs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from build_fmu.errors import UserError
from build_fmu.fmu.archive import Entry, write_archive
from build_fmu.model.describe import Description
from build_fmu.run.session import Session
from build_fmu.run.simulate import Settings, select_outputs, simulate
from build_fmu.show.page import page
from build_fmu.show.runs import about, run_of

PICTURES = 250  # rows of the run
MOST_LINKS = 60
MOST_STEPS = 20_000  # of the solver; longer runs are omitted
SHOWN = ("q", "qd", "angle", "quaternion", "kinetic", "potential", "total", "gap", "steps")


def attached_page(model: Description, entries: Callable[[], Sequence[Entry]]) -> tuple[bytes | None, str]:
    """Returns the page, or None and the reason. `entries` returns the files of the FMU. Equal entries give an equal page on one machine."""
    if len(model.drawing["links"]) > MOST_LINKS:
        return None, f"the model has more than {MOST_LINKS} links"
    span = model.default_experiment.get("stop_time", 1.0)
    step = span / PICTURES
    with TemporaryDirectory() as folder:
        fmu = Path(folder) / "model.fmu"
        write_archive(fmu, entries())
        try:
            with Session(fmu) as session:
                names = [name for name in select_outputs(session, ()) if name.rpartition(".")[2].partition("[")[0] in SHOWN]
                result = simulate(session, Settings(span, step, None, (), (), names), _patience(session))
        except _TooLong:
            return None, f"its simulation takes more than {MOST_STEPS} solver steps"
        except UserError as error:
            return None, f"its simulation failed: {error}"
        moved = [name for name in (*result.names, *result.inputs) if name.endswith(".q") or ".quaternion[" in name]
        if not any(np.ptp(result[name]) > 1e-9 for name in moved):
            return None, ""  # no motion without inputs, as in an inverse model
        shown = run_of(session, result)
        text, _ = page(model.model_name, f"{about(model, shown, None)} · default experiment without inputs", shown, model)
    return text.encode(), ""


class _TooLong(Exception):
    pass


def _patience(session: Session):
    """Returns a function that stops a run by the number of solver steps, which is reproducible, unlike the time."""
    if "solver.steps" not in session.variables:
        return lambda _time: None

    def reached(_time: float) -> None:
        if session.read(["solver.steps"])[0] > MOST_STEPS:
            raise _TooLong

    return reached
