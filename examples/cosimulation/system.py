"""A system of FMUs as one .ssp file (System Structure and Parameterization 1.0): components and connections."""

from __future__ import annotations

import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path
from zipfile import ZipFile

import fmpy

from build_fmu.cli import main as build_fmu

HERE = Path(__file__).parent
MODEL = HERE.parents[1] / "models" / "kuka_kr5.toml"
JOINTS = [f"joint{i}" for i in range(1, 7)]
STEP, STOP = 0.001, 2.0  # s
SSD, SSC = "http://ssp-standard.org/SSP1/SystemStructureDescription", "http://ssp-standard.org/SSP1/SystemStructureCommon"

Wire = tuple[tuple[str, str], tuple[str, str]]  # ((element, output), (element, input))
# for each joint
WIRES = [
    (("arm", "q"), ("controller", "q")),
    (("arm", "qd"), ("controller", "qd")),
    (("arm", "q"), ("weight", "q")),
    (("weight", "tau"), ("controller", "weight")),
    (("controller", "demand"), ("drive", "demand")),
    (("drive", "torque"), ("arm", "tau")),
]
WATCHED = [("arm", "q"), ("controller", "reference"), ("controller", "demand"), ("drive", "torque")]


def make_fmus(folder: Path) -> dict[str, Path]:
    """Builds the FMUs: the arm, its inverse for the gravity torques, the controller and the drive."""
    folder.mkdir(parents=True, exist_ok=True)
    for options in ([], ["--inverse"]):
        if build_fmu(["build", "--no-show", *options, str(MODEL), "-o", str(folder)]) != 0:
            raise SystemExit(1)
    for program in ("controller", "drive"):
        subprocess.run([sys.executable, "-m", "pythonfmu", "build", "-f", HERE / f"{program}.py", "-d", folder], check=True)
    files = {"arm": "kuka_kr5.fmu", "weight": "kuka_kr5_inverse.fmu", "controller": "Controller.fmu", "drive": "Drive.fmu"}
    return {name: folder / file for name, file in files.items()}


def connections() -> list[Wire]:
    """All connections of all joints."""
    return [((a, f"{joint}.{output}"), (b, f"{joint}.{given}")) for (a, output), (b, given) in WIRES for joint in JOINTS]


def watched() -> list[tuple[str, str]]:
    return [(element, f"{joint}.{kind}") for element, kind in WATCHED for joint in JOINTS]


def structure(name: str, fmus: dict[str, Path], wires: list[Wire], watched: list[tuple[str, str]], stop: float) -> bytes:
    """Returns SystemStructure.ssd: each element with its connected or watched connectors."""
    ET.register_namespace("ssd", SSD)
    ET.register_namespace("ssc", SSC)
    root = ET.Element(f"{{{SSD}}}SystemStructureDescription", version="1.0", name=name)
    system = ET.SubElement(root, f"{{{SSD}}}System", name=name)
    elements = ET.SubElement(system, f"{{{SSD}}}Elements")
    outputs = list(dict.fromkeys([*(source for source, _ in wires), *watched]))
    for element, file in fmus.items():
        component = ET.SubElement(
            elements, f"{{{SSD}}}Component", name=element, type="application/x-fmu-sharedlibrary", source=f"resources/{file.name}"
        )
        connectors = ET.SubElement(component, f"{{{SSD}}}Connectors")
        for kind, ends in (("output", outputs), ("input", [sink for _, sink in wires])):
            for variable in (variable for owner, variable in ends if owner == element):
                connector = ET.SubElement(connectors, f"{{{SSD}}}Connector", name=variable, kind=kind)
                ET.SubElement(connector, f"{{{SSC}}}Real")
    lines = ET.SubElement(system, f"{{{SSD}}}Connections")
    for (start, output), (end, given) in wires:
        ET.SubElement(lines, f"{{{SSD}}}Connection", startElement=start, startConnector=output, endElement=end, endConnector=given)
    ET.SubElement(root, f"{{{SSD}}}DefaultExperiment", startTime="0", stopTime=str(stop))
    ET.indent(root)
    return ET.tostring(root, encoding="UTF-8", xml_declaration=True)


def pack(target: Path, fmus: dict[str, Path], wires: list[Wire], watched: list[tuple[str, str]], stop: float) -> None:
    """Writes the .ssp: the structure and the FMUs in resources/. It is validated against the schema of FMPy."""
    from fmpy.ssp.ssd import read_ssd

    with ZipFile(target, "w") as archive:
        archive.writestr("SystemStructure.ssd", structure(target.stem, fmus, wires, watched, stop))
        for file in fmus.values():
            archive.write(file, f"resources/{file.name}")
    read_ssd(str(target), validate=True)


def unpack(file: Path, folder: Path) -> Path:
    """Extracts the archive for masters that read a folder."""
    return Path(fmpy.extract(str(file), str(folder)))
