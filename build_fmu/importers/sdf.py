"""Reads a model of an SDF file: restated as a URDF, and its closed loops, springs and gravity."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path

import numpy as np

from build_fmu.importers.draft import Draft, DraftTie
from build_fmu.importers.sdf_file import Sdf
from build_fmu.importers.urdf import draft_of


def read(path: Path, options: Namespace) -> Draft:
    """Returns the draft; raises UserError with file, line and element."""
    sdf = Sdf(path, options)
    draft, layout = draft_of(sdf, options)
    for joint in sdf.closing:
        fields: dict[str, object] = {"type": joint.kind}
        for side, link, pose in zip("ab", joint.links, joint.poses, strict=True):
            own = layout.own[link] @ pose
            fields |= {f"link_{side}": layout.called[link], f"point_{side}": [float(x) for x in own[:3, 3]]}
            if joint.kind != "spherical":
                axis = own[:3, :3] @ joint.axis
                fields[f"axis_{side}"] = [float(x) for x in axis]
            if joint.kind in ("prismatic", "fixed"):
                fields[f"x_{side}"] = [float(x) for x in own[:3, :3] @ _across(joint.axis)]
        draft.loops.append(DraftTie(layout.names.take(joint.name), fields))
    draft.lost = sdf.lost + draft.lost
    draft.doubts += sdf.doubts
    return draft


def _across(axis: np.ndarray) -> np.ndarray:
    """Returns a direction that is not parallel to the axis."""
    return np.eye(3)[int(np.argmin(np.abs(axis)))]
