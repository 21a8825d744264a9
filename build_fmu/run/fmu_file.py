"""Reads the modelDescription.xml of an FMU, by FMPy."""

from __future__ import annotations

from pathlib import Path

from build_fmu.errors import UserError

# the types of variables in FMI 3.0 that FMI 2.0 has, too, by their names there
FMI3_TYPES = {"Real": "Float64", "Integer": "Int32", "Boolean": "Boolean", "String": "String"}


def read_description(fmu: Path):
    """Returns FMPy's description of a co-simulation FMU of FMI 2.0 or 3.0; raises UserError for anything else.

    Types have their names in FMI 2.0.
    """
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
    if not description.fmiVersion.startswith(("2.0", "3.0")) or description.coSimulation is None:
        raise UserError(f"'{fmu}' is not a co-simulation FMU of FMI 2.0 or 3.0")
    if description.fmiVersion.startswith("3.0"):
        names = {new: old for old, new in FMI3_TYPES.items()}
        for variable in description.modelVariables:
            if variable.dimensions:
                raise UserError(f"'{fmu}': variable '{variable.name}' is an array, which is not supported; build the FMU without --arrays")
            if variable.type not in names:
                kind, known = variable.type, ", ".join(names)
                raise UserError(f"'{fmu}': variable '{variable.name}' of type {kind} is not supported; supported: {known}")
            variable.type = names[variable.type]
    return description
