"""Sensors of a model as elements of MJCF."""

from __future__ import annotations

from xml.etree import ElementTree as ET

from ...model.coordinates import coordinate_name
from ...model.parts import OWN, WORLD
from ...model.sensing import Sensor
from ...model.transforms import Transform
from .mjcf_draft import EVERYWHERE, Draft, words
from .sensors import AT_SITES, SUMS

JOINTS = ("jointpos", "jointvel", "jointactuatorfrc", "jointlimitpos", "jointlimitvel", "jointlimitfrc")
BALLS = ("ballquat", "ballangvel")


def write_sensors(draft: Draft, option: ET.Element) -> None:
    """option: the element that holds the magnetic field, of which MuJoCo has one."""
    fields = [sensor.field for sensor in draft.model.sensors if sensor.kind == "magnetometer"]
    if fields:
        option.set("magnetic", words(fields[0]))
    for sensor in draft.model.sensors:
        made = ET.Element(sensor.kind, name=sensor.name)
        lost = _looks_at(draft, made, sensor)
        if sensor.kind == "magnetometer" and sensor.field != fields[0]:
            lost = "a second magnetic field"
        if lost:
            draft.lose(f'sensor "{sensor.name}"', lost, "none")
            continue
        if sensor.cutoff:
            made.set("cutoff", words(sensor.cutoff))
        draft.sections["sensor"].append(made)


def _looks_at(draft: Draft, made: ET.Element, sensor: Sensor) -> str:
    """Sets what a sensor is on; why it cannot be, if so."""
    kind = sensor.kind
    if kind == "clock":
        return ""
    if kind in JOINTS or kind in BALLS:
        joints = draft.model.joints
        names = {coordinate_name(joints[j], d): name for (j, d), name in draft.names.items()}
        made.set("joint", names.get(sensor.source, ""))
        return "" if sensor.source in names else "a coordinate that is none here"
    for part in ("actuator", "tendon"):
        if kind.startswith(part):
            made.set(part, sensor.source)
            written = {element.get("name") for element in draft.sections[part]}
            return "" if sensor.source in written else f"the {part} is lost"
    if kind in SUMS and not _is_subtree(draft, sensor):
        return "of parts that are no body with all that hangs on it"
    if kind.startswith("subtree"):
        made.set("body", draft.at(sensor.body, sensor.link)[0].get("name", "world"))
        return ""
    shape = sensor.shape if kind == "touch" else None
    if kind == "touch" and shape is None:
        shape = EVERYWHERE
    if kind in AT_SITES:
        made.set("site", draft.site(sensor.body, sensor.frame, f"{sensor.name} site", shape, sensor.link))
        return ""
    _set_frame(draft, made, "obj", sensor.body, sensor.frame, f"{sensor.name} site", sensor.link)
    _refer(draft, made, sensor)
    return ""


def _set_frame(
    draft: Draft, made: ET.Element, what: str, body: int, frame: Transform, wanted: str, link: int = OWN
) -> None:
    """A frame: that of a body of the file itself, else a site."""
    element, own = draft.at(body, link)
    if frame == own:
        made.set(f"{what}type", "xbody")
        made.set(f"{what}name", element.get("name", "world"))
        return
    made.set(f"{what}type", "site")
    made.set(f"{what}name", draft.site(body, frame, wanted, link=link))


def _refer(draft: Draft, made: ET.Element, sensor: Sensor) -> None:
    if sensor.reference is None:
        return
    wanted = f"{sensor.name} reference"
    if sensor.kind == "insidesite":
        made.set("site", draft.site(sensor.reference, sensor.reference_frame, wanted, sensor.shape))
    else:
        _set_frame(draft, made, "ref", sensor.reference, sensor.reference_frame, wanted)


def _is_subtree(draft: Draft, sensor: Sensor) -> bool:
    """Whether the parts of a sensor are one body of the file with all that hangs on it."""
    if (sensor.body, sensor.link) not in draft.elements:
        return False
    top = draft.elements[sensor.body, sensor.link]
    below = {id(element) for element in top.iter()}
    parts = [part for part, element in draft.elements.items() if id(element) in below]
    bodies = {body for body, link in parts if link == OWN and body != WORLD}
    links = {link for body, link in parts if link != OWN and body not in bodies}
    return set(sensor.bodies) == bodies and set(sensor.links) == links
