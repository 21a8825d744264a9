"""Replaces the scalars of a model's table by array variables (FMI 3.0, `build --arrays`).

The library defines the arrays and their value references (`VariableTable::array`); this module merges the attributes of their elements.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

from build_fmu.model.describe import Array, Description, Unknown, Variable


def with_arrays(model: Description) -> Description:
    """Returns the description with an array variable for the elements of each array."""
    scalars = {variable.name: variable for variable in model.variables}
    names = _names(model.arrays, scalars)
    array_of = {element: name for array, name in zip(model.arrays, names, strict=True) for element in array.elements}
    merged = {
        array.elements[0]: _merged(array, name, [scalars[element] for element in array.elements], array_of)
        for array, name in zip(model.arrays, names, strict=True)
    }
    variables = [merged.get(v.name, v) for v in model.variables if v.name in merged or v.name not in array_of]
    states = [scalars[scalars[row.name].derivative].name for row in model.derivatives]
    found = replace(
        model,
        variables=variables,
        outputs=_rows(model.outputs, array_of),
        derivatives=_rows(model.derivatives, array_of),
        initial_unknowns=_rows(model.initial_unknowns, array_of),
    )
    _check_states(found, states, {name: array.elements for array, name in zip(model.arrays, names, strict=True)})
    return found


def _names(arrays: Sequence[Array], scalars: dict[str, Variable]) -> list[str]:
    """Returns unique names: inputs end in `_input`, others in their suffix, where another array has the same name."""
    count = Counter(array.name for array in arrays)
    names = []
    for array in arrays:
        kind = "_input" if scalars[array.elements[0]].causality == "input" else array.suffix
        names.append(array.name + (kind if count[array.name] > 1 else ""))
    assert len({*names, *scalars}) == len(names) + len(scalars), "two variables have the same name"
    return names


def _merged(array: Array, name: str, elements: list[Variable], array_of: dict[str, str]) -> Variable:
    first = elements[0]

    def common(field: str) -> Any:
        values = {getattr(v, field) for v in elements}
        return values.pop() if len(values) == 1 else None

    listed = ", ".join(v.name for v in elements) if len(array.dimensions) == 1 else f"{first.name} to {elements[-1].name} by rows"
    return replace(
        first,
        name=name,
        value_reference=array.value_reference,
        dimensions=tuple(array.dimensions),
        start=None if first.start is None else tuple(v.start for v in elements),
        derivative=None if first.derivative is None else array_of[first.derivative],
        description=f"{first.description if common('description') else ''} [{listed}]".strip(),
        **{field: common(field) for field in ("unit", "display_unit", "quantity", "min", "max", "nominal")},
    )


def _rows(rows: Iterable[Unknown], array_of: dict[str, str]) -> list[Unknown]:
    """Merges the rows of the elements of each array, with the union of their dependencies."""
    found: dict[str, Unknown] = {}
    for row in rows:
        name = array_of.get(row.name, row.name)
        before = found.get(name, Unknown(name, [], []))
        if row.dependencies is None or before.dependencies is None:
            found[name] = Unknown(name)
            continue
        kinds = dict(zip(before.dependencies, before.kinds, strict=True))
        for known, kind in zip(row.dependencies, row.kinds or ["dependent"] * len(row.dependencies), strict=True):
            known = array_of.get(known, known)
            kinds[known] = kind if kinds.get(known, kind) == kind else "dependent"
        found[name] = Unknown(name, list(kinds), list(kinds.values()))
    return list(found.values())


def _check_states(model: Description, states: list[str], elements: dict[str, list[str]]) -> None:
    """The order of the states is that of the elements of the arrays."""
    derivative = {v.name: v.derivative for v in model.variables}
    listed = [scalar for row in model.derivatives for scalar in elements.get(derivative[row.name], [derivative[row.name]])]
    assert listed == states, "arrays change the order of the states"
