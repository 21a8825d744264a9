"""Reads the modelDescription.xml of an FMU, by FMPy."""

from __future__ import annotations

from pathlib import Path

from build_fmu.errors import UserError


def read_description(fmu: Path):
    """Returns FMPy's description of an FMI 2.0 co-simulation FMU; raises UserError for anything else."""
    import fmpy
    from fmpy.model_description import ValidationError

    if not fmu.is_file():
        raise UserError(f"FMU '{fmu}' does not exist")
    try:
        description = fmpy.read_model_description(str(fmu))
    except ValidationError as error:
        raise UserError(f"'{fmu}' has an invalid modelDescription.xml: {error.problems[0]}") from None
    except Exception as error:  # a damaged zip or XML fails in many ways
        raise UserError(f"'{fmu}' is not a readable FMU: {error}") from None
    if description.fmiVersion != "2.0" or description.coSimulation is None:
        raise UserError(f"'{fmu}' is not an FMI 2.0 co-simulation FMU")
    return description
