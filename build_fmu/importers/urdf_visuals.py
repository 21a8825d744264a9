"""Converts <visual> elements of a URDF to [[shape]] tables, which are drawn and have no effect on the motion."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

from lxml import etree

from build_fmu.errors import UserError, listed
from build_fmu.importers.draft import DraftTie
from build_fmu.importers.masses import without_mass
from build_fmu.importers.packages import places_of
from build_fmu.importers.rigid import position_and_angles
from build_fmu.importers.solids import Solid
from build_fmu.importers.urdf_file import Urdf

SIZES = {"sphere": ("radius",), "cylinder": ("radius", "length"), "capsule": ("radius", "length")}


def add_shapes(urdf: Urdf, layout) -> None:
    """Fills the shapes of layout.draft and reports those that cannot be converted. Files of meshes are absolute paths."""
    omitted, missing = Counter(), []
    named = {material.get("name"): colour for material in urdf.root.iter("material") if (colour := _rgba(urdf, material))}
    for link in urdf.root.findall("link"):
        name = link.attrib["name"]
        for visual in link.findall("visual"):
            pose = layout.own[name] @ urdf.pose(visual)
            material = visual.find("material")
            colour = None if material is None else _rgba(urdf, material) or named.get(material.get("name"))
            for shape in visual.iterfind("geometry/*"):
                fields = fields_of(urdf, shape, omitted)
                if fields is None:
                    continue
                if fields.get("file") == "":
                    missing.append(shape.attrib["filename"])
                    continue
                position, angles = position_and_angles(pose)
                placed = {key: values for key, values in (("position", position), ("rpy", angles)) if any(values)}
                fields = {"link": layout.called[name], **fields, **placed, **({"color": colour} if colour else {})}
                layout.draft.shapes.append(DraftTie("", fields))
    layout.draft.lost += [f"<visual>: {count} {what}" for what, count in omitted.items()]
    if missing:
        layout.draft.lost.append(f"{len(missing)} <visual> meshes: files not found: {listed(sorted(set(missing)))}")


def solids_of(urdf: Urdf, layout) -> dict[str, list[Solid]]:
    """Returns the <collision> shapes of each link of the model or, without any, its <visual> shapes. Reports masses that files lack."""
    found, missing, omitted = {}, [], Counter()
    empty = {link.name for link in without_mass(layout.draft.links)}
    for link in urdf.root.findall("link"):
        name, tag = link.attrib["name"], "collision" if link.find("collision") is not None else "visual"
        own = found.setdefault(layout.called[name], [])
        for element in link.findall(tag):
            pose = layout.own[name] @ urdf.pose(element)
            for shape in element.iterfind("geometry/*"):
                fields = fields_of(urdf, shape, omitted if layout.called[name] in empty else Counter())
                if fields and fields.get("file") != "":
                    own.append(Solid(fields["kind"], fields.get("size", [1.0]), pose, fields.get("file", "")))
                elif fields and layout.called[name] in empty:
                    missing.append(shape.attrib["filename"])
    layout.draft.lost += [f"mass of {count} {what}" for what, count in omitted.items()]
    if missing:
        layout.draft.lost.append(f"mass of {len(missing)} meshes: files not found: {listed(sorted(set(missing)))}")
    return found


def fields_of(urdf: Urdf, shape: etree._Element, omitted: Counter[str]) -> dict[str, object] | None:
    """Returns kind, size and file (empty if it does not exist); None, counted in `omitted`, if the shape is not supported or wrong."""
    try:
        fields = _fields(urdf, shape)
    except UserError as error:
        omitted[f"<{shape.tag}> shapes: {error}"] += 1
        return None
    if fields is None:
        omitted[f"<{shape.tag}> shapes"] += 1
    return fields


def _fields(urdf: Urdf, shape: etree._Element) -> dict[str, object] | None:
    if shape.tag == "mesh":
        file = mesh_file(urdf.text(shape, "filename"), urdf.path)
        scale = urdf.numbers(shape, "scale", 3, "1 1 1")
        return {"kind": "mesh", "file": str(file or ""), **({"size": scale} if scale != [1, 1, 1] else {})}
    if shape.tag == "box":
        size = urdf.numbers(shape, "size", 3, "")
    elif shape.tag in SIZES:
        size = [urdf.amount(shape, key, "") for key in SIZES[shape.tag]]
    else:
        return None
    if min(size) <= 0:
        raise urdf.error(shape, f"the size of <{shape.tag}> must be > 0, got {min(size):g}")
    return {"kind": shape.tag, "size": size}


def mesh_file(name: str, urdf: Path) -> Path | None:
    """Returns the file of a mesh: relative to the URDF, or in a package (`places_of`)."""
    folder = urdf.resolve().parent
    scheme, _, rest = name.rpartition("://")
    if scheme in ("package", "model"):
        package, _, inner = rest.partition("/")
        places = [place / inner for place in places_of(package, folder)] + [place / inner for place in (folder, *folder.parents[:2])]
    else:
        places = [Path(rest) if Path(rest).is_absolute() else folder / rest]
    return next((place for place in places if place.is_file()), None)


def _rgba(urdf: Urdf, material: etree._Element) -> list[float] | None:
    colour = material.find("color")
    if colour is None:
        return None
    rgba = [min(max(part, 0.0), 1.0) for part in urdf.numbers(colour, "rgba", 4, "")]
    return rgba[:3] if rgba[3] == 1 else rgba
