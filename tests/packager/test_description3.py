"""modelDescription.xml of FMI 3.0: valid by the schema and by FMPy's rules, and the table of the FMI 2.0 description."""

import zipfile
from dataclasses import replace
from pathlib import Path

import fmpy
import pytest
from fmpy.model_description import read_model_description
from fmpy.validation import validate_fmu
from lxml import etree

from build_fmu.errors import UserError
from build_fmu.fmu import description
from build_fmu.fmu.build import build
from build_fmu.fmu.description3 import model_description
from build_fmu.model.describe import Unknown, describe
from build_fmu.run.fmu_file import read_description

SCHEMA = Path(fmpy.__file__).parent / "schema" / "fmi3" / "fmi3ModelDescription.xsd"


@pytest.fixture
def root(crane):
    return etree.fromstring(model_description(crane))


@pytest.fixture
def fmu(compiled, model, tmp_path):
    target = tmp_path / "crane.fmu"
    build(describe(model), model, target, fmi=3)
    return target


def test_schema(root):
    schema = etree.XMLSchema(file=str(SCHEMA))
    assert schema.validate(root), schema.error_log


def test_fmpy_accepts_names_and_structure(crane, tmp_path):
    file = tmp_path / "modelDescription.xml"
    file.write_bytes(model_description(crane))
    read = read_model_description(str(file), validate=True, validate_variable_names=True, validate_model_structure=True)
    assert [v.name for v in read.modelVariables] == ["time", *(v.name for v in crane.variables)]


def test_flags_have_their_names_in_fmi3(crane):
    model = replace(crane, capabilities={**crane.capabilities, "canGetAndSetFMUstate": True, "providesDirectionalDerivative": True})
    flags = etree.fromstring(model_description(model)).find("CoSimulation").attrib
    true = {
        "canGetAndSetFMUState",
        "canHandleVariableCommunicationStepSize",
        "providesDirectionalDerivatives",
        "providesAdjointDerivatives",
        "providesIntermediateUpdate",
        "canReturnEarlyAfterIntermediateUpdate",
    }
    assert {flag for flag, value in flags.items() if value == "true"} == true
    assert flags["canSerializeFMUState"] == "false" and flags["maxOutputDerivativeOrder"] == "0"


def test_variables_are_those_of_the_fmi2_description(crane, root):
    old = etree.fromstring(description.model_description(crane))
    types = {"Real": "Float64", "Integer": "Int32", "Boolean": "Boolean", "String": "String"}
    for scalar, variable in zip(old.iter("ScalarVariable"), root.find("ModelVariables")[1:], strict=True):
        assert variable.tag == types[scalar[0].tag]
        expected = {**scalar.attrib, **scalar[0].attrib}
        if (expected["causality"], expected.get("variability"), scalar[0].tag) == ("output", "continuous", "Real"):
            expected["intermediateUpdate"] = "true"
        start = variable.find("Start")
        assert dict(variable.attrib) | ({} if start is None else {"start": start.get("value")}) == expected


def test_the_time_is_the_independent_variable(root):
    time = root.find("ModelVariables")[0]
    assert (time.get("name"), time.get("valueReference"), time.get("causality")) == ("time", "0", "independent")
    assert len(root.findall(".//Float64[@causality='independent']")) == 1


def test_dependencies_are_ascending_value_references_with_their_kinds(crane):
    first, second, output = crane.variables[0], crane.variables[1], crane.select("output")[0]
    row = Unknown(output.name, [second.name, first.name], ["constant", "dependent"])
    model = replace(crane, outputs=[row], initial_unknowns=[row], depends_on_time=True)
    written, initially = etree.fromstring(model_description(model)).find("ModelStructure")
    pairs = [(0, "dependent"), *sorted([(second.value_reference, "constant"), (first.value_reference, "dependent")])]
    for element in (written, initially):
        assert element.get("dependencies") == " ".join(str(reference) for reference, _ in pairs)
        assert element.get("dependenciesKind") == " ".join(kind for _, kind in pairs)


def test_content_of_the_archive(fmu):
    assert validate_fmu(str(fmu)) == []
    with zipfile.ZipFile(fmu) as file:
        names = file.namelist()
        page = file.read("documentation/index.html").decode()
    assert names[:4] == ["modelDescription.xml", "documentation/diagram.png", "binaries/x86_64-linux/crane.so", "resources/model.toml"]
    assert "FMI 3.0" in page and 'src="diagram.png"' in page


def test_platform_tuples(compiled, model, tmp_path, monkeypatch):
    library = tmp_path / "library.dll"
    library.write_bytes(b"not a library")
    monkeypatch.setenv("REDYSIM_FMU_LIBRARY_WIN64", str(library))
    build(describe(model), model, tmp_path / "crane.fmu", platforms=["linux64", "win64"], fmi=3)
    with zipfile.ZipFile(tmp_path / "crane.fmu") as file:
        assert {"binaries/x86_64-linux/crane.so", "binaries/x86_64-windows/crane.dll"} < set(file.namelist())


def test_types_are_read_by_their_names_in_fmi2(fmu, crane):
    read = {v.name: v.type for v in read_description(fmu).modelVariables}
    assert read == {"time": "Real"} | {v.name: v.type for v in crane.variables}


def test_types_that_the_commands_cannot_set_are_refused(fmu, tmp_path):
    other = tmp_path / "other.fmu"
    with zipfile.ZipFile(fmu) as old, zipfile.ZipFile(other, "w") as new:
        for name in old.namelist():
            content = old.read(name)
            new.writestr(name, content.replace(b"<Int32 ", b"<UInt16 ") if name == "modelDescription.xml" else content)
    with pytest.raises(UserError, match="of type UInt16 is not supported"):
        read_description(other)
