"""The FMU of every model in models/: valid, complete, and nothing in the archive that does not belong there."""

from __future__ import annotations

import math
import re
import zipfile
from xml.etree import ElementTree as xml

import pytest

from tests.fmi.conftest import ROOT
from tests.fmi.raw import ERROR, OK, Slave

QUICK = ("four_bar", "kuka_kr5_computed_torque", "space_robot", "stick_slip")
MODELS = ["everything"] + [
    pytest.param(path.stem, marks=[] if path.stem in QUICK else pytest.mark.slow) for path in sorted((ROOT / "models").glob("*.toml"))
]
BASE = {"kg", "m", "s", "rad"}
IDENTIFIER = r"[A-Za-z_]\w*"
STRUCTURED = re.compile(rf"{IDENTIFIER}(\[\d+(,\d+)*\])?(\.{IDENTIFIER}(\[\d+(,\d+)*\])?)*")


@pytest.fixture(params=MODELS)
def name(request):
    return request.param


@pytest.fixture
def archive(name, fmu_file):
    with zipfile.ZipFile(fmu_file(name)) as opened:
        yield opened


@pytest.fixture
def description(archive):
    return xml.fromstring(archive.read("modelDescription.xml"))


def test_fmpy_and_its_schema_find_no_problem(archive):
    from fmpy.validation import validate_fmu

    assert validate_fmu(archive.filename) == []


def test_the_archive_holds_what_belongs_there(archive, description):
    identifier = description.find("CoSimulation").get("modelIdentifier")
    names = set(archive.namelist())
    assert len(names) == len(archive.namelist())
    wanted = {"modelDescription.xml", "model.png", f"binaries/linux64/{identifier}.so", "resources/model.toml", "documentation/index.html"}
    assert wanted <= names
    for name in names - wanted:
        assert re.fullmatch(r"documentation/licenses/\w+\.txt|resources/[\w.-]+\.csv", name), name
    assert "documentation/licenses/license.txt" in names
    assert all(archive.getinfo(name).file_size > 0 for name in names)


def test_units_have_base_units_and_angles_degrees(description):
    units = {unit.get("name"): unit for unit in description.iter("Unit")}
    used = {scalar[0].get("unit") for scalar in description.iter("ScalarVariable")} - {None}
    assert used == set(units), "each that is used, and no other"
    for name, unit in units.items():
        powers = unit.find("BaseUnit").attrib
        assert powers and set(powers) <= BASE and all(int(power) for power in powers.values()), name
    for scalar in description.iter("ScalarVariable"):
        unit, display = scalar[0].get("unit"), scalar[0].get("displayUnit")
        assert display in {None, *(shown.get("name") for shown in units[unit].iter("DisplayUnit"))} if unit else display is None
        if unit and unit.startswith("rad"):
            assert display == unit.replace("rad", "deg")


def test_names_are_structured_and_unique(description):
    names = [scalar.get("name") for scalar in description.iter("ScalarVariable")]
    assert len(set(names)) == len(names) and description.get("variableNamingConvention") == "structured"
    assert all(STRUCTURED.fullmatch(name) for name in names)


def test_start_values_stand_where_they_must_and_nowhere_else(description):
    for scalar in description.iter("ScalarVariable"):
        causality, variability, initial, start = (
            *(scalar.get(key) for key in ("causality", "variability", "initial")),
            scalar[0].get("start"),
        )
        legal = {
            "input": (("continuous",), None, True),
            "output": (("continuous", "discrete"), "calculated", False),
            "local": (("discrete",) if scalar[0].tag == "String" else ("continuous",), "calculated", False),
            "parameter": (("fixed", "tunable"), "exact", True),
        }[causality]
        assert variability in legal[0] and initial == legal[1] and (start is not None) == legal[2], scalar.get("name")
        if scalar[0].tag == "Real" and start is not None:
            low, high = float(scalar[0].get("min", "-inf")), float(scalar[0].get("max", "inf"))
            assert low <= float(start) <= high


def test_start_values_are_those_of_the_library(fmu, name):
    with Slave(fmu(name)) as slave:
        for scalar in slave.fmu.xml.iter("ScalarVariable"):
            if scalar.get("causality") not in ("output", "local"):
                start = scalar[0].get("start")
                assert slave.get(scalar.get("name")) == (start if scalar[0].tag == "String" else float(start)), scalar.get("name")


def test_limits_are_the_smallest_and_the_largest_accepted_values(fmu, name):
    with Slave(fmu(name)) as slave:
        for scalar in slave.fmu.xml.iter("ScalarVariable"):
            if scalar.get("causality") in ("output", "local") or scalar[0].tag != "Real":
                continue
            for limit, beyond in (("min", -math.inf), ("max", math.inf)):
                value, variable = scalar[0].get(limit), scalar.get("name")
                assert slave.set(variable, float(value) if value else math.copysign(1e300, beyond)) == OK, slave.errors
                if value:
                    assert slave.set(variable, math.nextafter(float(value), beyond)) == ERROR, f"{variable} below or above {value}"


def test_each_description_says_what_no_other_says(description):
    texts = [scalar.get("description") for scalar in description.iter("ScalarVariable")]
    assert all(texts) and sorted(set(texts)) == sorted(texts)


def test_constant_dependencies_are_constant(fmu, name):
    """What is declared so in InitialUnknowns changes by the same factor whatever the change."""
    with Slave(fmu(name)) as slave:
        names = [scalar.get("name") for scalar in slave.fmu.xml.iter("ScalarVariable")]
        assert slave.setup() == OK and slave.call("EnterInitializationMode") == OK
        for row in slave.fmu.xml.findall("ModelStructure/InitialUnknowns/Unknown"):
            unknown = names[int(row.get("index")) - 1]
            if "dependenciesKind" not in row.attrib:
                continue
            assert set(row.get("dependenciesKind").split()) == {"constant"}
            for known in (names[int(index) - 1] for index in row.get("dependencies").split()):
                start, found = slave.get(known), []
                for change in (0.0, 0.25, 0.5, 1.0):
                    assert slave.set(known, start + change) == OK
                    found.append(slave.get(unknown))
                assert slave.set(known, start) == OK
                factor = found[3] - found[0]
                assert factor != 0 and all(abs(found[k] - found[0] - factor * change) < 1e-12 for k, change in ((1, 0.25), (2, 0.5))), (
                    unknown
                )


def test_the_structure_is_complete(description):
    scalars = list(description.iter("ScalarVariable"))
    outputs = [i for i, scalar in enumerate(scalars, 1) if scalar.get("causality") == "output"]
    slopes = [int(row.get("index")) for row in description.findall("ModelStructure/Derivatives/Unknown")]
    states = [int(scalars[i - 1][0].get("derivative")) for i in slopes]
    assert sorted(slopes) == [i for i, scalar in enumerate(scalars, 1) if "derivative" in scalar[0].attrib]
    assert len(set(states)) == len(states)
    local = [i for i, scalar in enumerate(scalars, 1) if scalar.get("causality") == "local" and scalar[0].tag == "Real"]
    known = [i for i in local if i in {*slopes, *states}]
    assert len(local) - len(known) == int(description.get("numberOfEventIndicators", "0")), "for model exchange alone"
    for group, unknowns in (("Outputs", outputs), ("Derivatives", slopes), ("InitialUnknowns", outputs + known)):
        rows = description.findall(f"ModelStructure/{group}/Unknown")
        assert [int(row.get("index")) for row in rows] == unknowns, "all of them, in order, once"
        for row in rows:
            if "dependencies" not in row.attrib:  # depends on all
                assert "dependenciesKind" not in row.attrib
                continue
            knowns, kinds = row.get("dependencies").split(), row.get("dependenciesKind", "").split()
            assert len(knowns) == len(set(knowns)) and len(kinds) in (0, len(knowns)) and set(kinds) <= {"constant"}
            of_state = {int(known) for known in knowns} & set(states) if group != "InitialUnknowns" else set()
            causalities = {scalars[int(known) - 1].get("causality") for known in knowns if int(known) not in of_state}
            assert causalities <= ({"input", "parameter"} if group == "InitialUnknowns" else {"input"})
