"""modelDescription.xml: valid by the schema and by FMPy's rules, and exactly the table."""

import copy
import struct
from pathlib import Path

import fmpy
import pytest
from fmpy.model_description import read_model_description
from hypothesis import given
from hypothesis import strategies as st
from lxml import etree

from build_fmu.errors import UserError
from build_fmu.fmu.description import model_description, real
from build_fmu.fmu.description3 import model_description as model_description3
from build_fmu.model.describe import from_table

SCHEMA = Path(fmpy.__file__).parent / "schema" / "fmi2" / "fmi2ModelDescription.xsd"


@pytest.fixture
def root(crane):
    return etree.fromstring(model_description(crane))


def test_schema(root):
    schema = etree.XMLSchema(file=str(SCHEMA))
    assert schema.validate(root), schema.error_log


def test_fmpy_accepts_names_structure_and_units(crane, tmp_path):
    file = tmp_path / "modelDescription.xml"
    file.write_bytes(model_description(crane))
    read = read_model_description(str(file), validate=True, validate_variable_names=True, validate_model_structure=True)
    assert read.coSimulation.modelIdentifier == "crane"
    assert read.modelExchange is None
    assert [v.name for v in read.modelVariables] == [v.name for v in crane.variables]


def test_nothing_depends_on_the_day(crane, monkeypatch):
    monkeypatch.delenv("SOURCE_DATE_EPOCH", raising=False)
    assert b"generationDateAndTime" not in model_description(crane)
    assert model_description(crane) == model_description(copy.deepcopy(crane))


@pytest.mark.parametrize("write", [model_description, model_description3], ids=["fmi2", "fmi3"])
def test_the_date_is_that_of_the_environment(crane, monkeypatch, write):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "951868799")  # the last second of a leap day
    root = etree.fromstring(write(crane))
    assert root.get("generationDateAndTime") == "2000-02-29T23:59:59Z"
    version = root.get("fmiVersion")[0]
    schema = etree.XMLSchema(file=str(SCHEMA).replace("fmi2", f"fmi{version}"))
    assert schema.validate(root), schema.error_log


@pytest.mark.parametrize("write", [model_description, model_description3], ids=["fmi2", "fmi3"])
def test_the_origin_is_that_of_the_model_file(table, write):
    origin = {"version": "2.1 <beta>", "author": 'A. & "B."', "license": "CC-BY-4.0", "copyright": "© 2026"}
    root = etree.fromstring(write(from_table({**table, "origin": origin}, [])))
    assert {field: root.get(field) for field in origin} == origin
    schema = etree.XMLSchema(file=str(SCHEMA).replace("fmi2", f"fmi{root.get('fmiVersion')[0]}"))
    assert schema.validate(root), schema.error_log
    assert etree.fromstring(write(from_table(table, []))).get("author") is None


@pytest.mark.parametrize("write", [model_description, model_description3], ids=["fmi2", "fmi3"])
def test_a_character_that_xml_does_not_have_is_an_error(table, write):
    for character, name in (("\a", "0007"), ("\uffff", "FFFF")):
        with pytest.raises(UserError, match=rf"author of the FMU contains the character U\+{name}, which XML does not allow"):
            write(from_table({**table, "origin": {"author": f"A{character}"}}, []))
    write(from_table({**table, "origin": {"author": "A\tB\nC \U0001f916"}}, []))


@pytest.mark.parametrize("text", ["today", "1.5", "1" * 30])
def test_a_wrong_date_is_an_error(crane, monkeypatch, text):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", text)
    with pytest.raises(UserError, match=f"SOURCE_DATE_EPOCH is '{text}', not a number of seconds since 1970"):
        model_description(crane)


def test_there_is_no_time_variable(root):
    assert not root.findall(".//ScalarVariable[@causality='independent']")


def test_start_values_round_trip(crane, root):
    for variable, element in zip(crane.variables, root.iter("ScalarVariable"), strict=True):
        text = element[0].get("start")
        if variable.start is None:
            assert text is None
        elif variable.type == "Real":
            assert float(text) == variable.start
        elif variable.type == "Boolean":
            assert text == ("true" if variable.start else "false")
        else:
            assert text == str(variable.start)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_real_numbers_round_trip_bit_for_bit(number):
    assert struct.pack("d", float(real(number))) == struct.pack("d", number)


def test_infinite_limits_use_the_schema_spelling():
    assert (real(float("inf")), real(float("-inf"))) == ("INF", "-INF")


def test_inputs_carry_no_initial(root):
    inputs = root.findall(".//ScalarVariable[@causality='input']")
    assert inputs and all("initial" not in element.attrib for element in inputs)


def test_dependencies_are_ascending_indices_of_the_named_variables(crane, root):
    names = [v.name for v in crane.variables]
    for rows, tag in ((crane.outputs, "Outputs"), (crane.initial_unknowns, "InitialUnknowns")):
        for row, element in zip(rows, root.find(f"ModelStructure/{tag}"), strict=True):
            indices = [int(i) for i in element.get("dependencies").split()]
            assert names[int(element.get("index")) - 1] == row.name
            assert indices == sorted(indices)
            assert {names[i - 1] for i in indices} == set(row.dependencies)


def test_absent_dependencies_stay_absent_and_empty_ones_stay_empty(table):
    del table["outputs"][0]["dependencies"]
    root = etree.fromstring(model_description(from_table(table, [])))
    first, second = root.find("ModelStructure/Outputs")[:2]
    assert "dependencies" not in first.attrib
    assert second.get("dependencies") == ""


def test_text_is_escaped(table):
    table["description"] = 'a "b" <c> & d'
    table["variables"][0]["description"] = 'τ < 5 & "more"'
    root = etree.fromstring(model_description(from_table(table, [])))
    assert root.get("description") == 'a "b" <c> & d'
    assert root.find("ModelVariables")[0].get("description") == 'τ < 5 & "more"'


def test_display_units(root):
    unit = root.find("UnitDefinitions/Unit[@name='rad/s']")
    assert dict(unit.find("BaseUnit").attrib) == {"s": "-1", "rad": "1"}
    assert float(unit.find("DisplayUnit").get("factor")) == 57.29577951308232
