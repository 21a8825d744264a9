"""Attributes of MJCF elements that the importer converts, lists elsewhere, or that have no effect on the motion."""

from __future__ import annotations

from collections.abc import Iterator

from lxml import etree

from build_fmu.errors import did_you_mean
from build_fmu.importers.mjcf_file import ACTUATORS, FILE, SHARED, Mjcf

PLACE = "pos quat axisangle euler xyaxes zaxis "
SHAPE = PLACE + "name class type size fromto mesh material rgba group user "
OF_ACTUATOR = (
    "name class group user joint jointinparent tendon site body refsite slidersite cranksite cranklength gear lengthrange "
    "ctrlrange ctrllimited forcerange forcelimited armature damping "
)
# of the laws, which are listed as a whole
OF_LAWS = (
    "dyntype gaintype biastype dynprm gainprm biasprm actdim actearly actlimited actrange inheritrange kp ki kv dampratio timeconst "
    "area diameter bias range force scale lmin lmax vmax fpmax fvmax gain input imax slewmax ffrange posrange velrange "
    "delay interp nsample motorconst resistance inductance nominal saturation cogging controller lugre thermal plugin instance"
)
OF_TENDON = "name class group user width material rgba margin range limited frictionloss armature stiffness damping springlength"
KNOWN = {
    "compiler": "angle eulerseq autolimits coordinate meshdir assetdir texturedir strippath discardvisual fusestatic usethread convexhull "
    "inertiafromgeom inertiagrouprange boundmass boundinertia balanceinertia settotalmass fitaabb exactmeshinertia alignfree saveinertial "
    "savecanonical savecompiled conflict passthrough",
    "option": "gravity timestep wind density viscosity magnetic integrator cone jacobian solver iterations tolerance ls_iterations "
    "ls_tolerance noslip_iterations noslip_tolerance mpr_iterations mpr_tolerance ccd_iterations ccd_tolerance sdf_iterations "
    "sdf_initpoints impratio apirate sleep_tolerance o_margin o_friction",
    "flag": "gravity constraint equality frictionloss limit spring damper actuation contact passive clampctrl warmstart filterparent "
    "refsafe sensor midphase eulerdamp autoreset nativeccd multiccd island energy fwdinv invdiscrete override sleep diagexact "
    "ipc speculative",
    "body": PLACE + "name childclass mocap gravcomp user sleep simple fuse",
    "joint": "name class type pos axis range limited ref springref stiffness damping armature frictionloss group user springdamper "
    "actuatorfrcrange actuatorfrclimited margin align",
    "freejoint": "name group align",
    "frame": PLACE + "name childclass",
    "inertial": PLACE + "mass diaginertia fullinertia",
    "geom": SHAPE + "mass density shellinertia contype conaffinity condim priority friction margin gap hfield fitscale fluidshape "
    "fluidcoef castshadow",
    "site": SHAPE,
    "asset/mesh": "name class file scale refpos refquat inertia maxhullvert smoothnormal normal texcoord content_type material vertex face "
    "builtin params",
    "default/mesh": "scale inertia maxhullvert",
    "connect": "name class active body1 body2 anchor site1 site2",
    "weld": "name class active body1 body2 anchor relpose torquescale site1 site2",
    "equality/joint": "name class active joint1 joint2 polycoef",
    "equality/tendon": "name class active tendon1 tendon2 polycoef",
    "default/equality": "active",
    "default/tendon": OF_TENDON,
    "tendon/fixed": OF_TENDON,
    "fixed/joint": "joint coef",
    "key": "name time qpos qvel act ctrl mpos mquat",
    "motor": OF_ACTUATOR,
} | {tag: OF_ACTUATOR + OF_LAWS for tag in ACTUATORS if tag != "motor"}
SECTIONS = ("compiler", "option", "default", "asset", "worldbody", "keyframe", *SHARED)
BOOLEAN, WITH_AUTO = ("true", "false"), ("true", "false", "auto")
GEOMS = ("plane", "hfield", "sphere", "capsule", "ellipsoid", "cylinder", "box", "mesh", "sdf")
OF_RANGES = dict.fromkeys(("limited", "actuatorfrclimited"), WITH_AUTO)
# attributes that are one of a few words
KEYWORDS = {
    "compiler": {"angle": ("radian", "degree"), "coordinate": ("local", "global"), "inertiafromgeom": WITH_AUTO}
    | dict.fromkeys(("autolimits", "strippath", "fusestatic", "balanceinertia", "exactmeshinertia", "alignfree"), BOOLEAN),
    "flag": dict.fromkeys(KNOWN["flag"].split(), ("enable", "disable")),
    "body": {"mocap": BOOLEAN},
    "joint": OF_RANGES | {"align": WITH_AUTO, "active": BOOLEAN},
    "freejoint": {"align": WITH_AUTO},
    "geom": {"type": GEOMS, "shellinertia": BOOLEAN},
    "mesh": {"inertia": ("legacy", "exact", "convex", "shell")},
    "tendon": OF_RANGES | {"active": BOOLEAN},
    "fixed": OF_RANGES,
    "spatial": OF_RANGES,
} | dict.fromkeys(("equality", "connect", "weld"), {"active": BOOLEAN})
KEYWORDS |= dict.fromkeys(ACTUATORS, dict.fromkeys(("ctrllimited", "forcelimited", "actlimited"), WITH_AUTO))


def check_keywords(mj: Mjcf) -> None:
    """Raises UserError at the first attribute that is another word than the ones that MuJoCo accepts."""
    for section in mj.root:
        for element in section.iter(*KEYWORDS) if section.tag in SECTIONS else ():
            for key, words in KEYWORDS[element.tag].items():
                value = element.get(key)
                if value is not None and value not in words:
                    hint = did_you_mean(value, words)
                    raise mj.error(element, f"'{key}' of <{element.tag}> must be {' or '.join(words)}, got '{value}'{hint}")


def unknown_attributes(root: etree._Element) -> Iterator[tuple[etree._Element, str, list[str]]]:
    """Yields element, attribute and the known attributes of its kind for each attribute that is not known."""
    for section in root:
        for element in section.iter(etree.Element) if section.tag in SECTIONS else ():
            above = "" if element is section else element.getparent().tag
            known = KNOWN.get(f"{above}/{element.tag}") or KNOWN.get(element.tag)
            if known is None or above == "spatial":
                continue
            for key in element.attrib:
                if key not in known.split() and key != FILE and not key.startswith("sol"):
                    yield element, key, known.split()
