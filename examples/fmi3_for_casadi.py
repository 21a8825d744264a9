"""FMUs of FMI 3.0 for CasADi."""

import xml.etree.ElementTree as ElementTree
from pathlib import Path


def readable(folder: Path) -> str:
    """Removes what CasADi 3.8 cannot read from an unpacked FMU: Strings, initial unknowns that depend on everything."""
    tree = ElementTree.parse(folder / "modelDescription.xml")
    for group, tag in (("ModelVariables", "String"), ("ModelStructure", "InitialUnknown")):
        parent = tree.find(group)
        for element in parent.findall(tag):
            parent.remove(element)
    tree.write(folder / "modelDescription.xml")
    return str(folder)
