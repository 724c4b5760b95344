"""modelDescription.xml of functional mock-up units, for FMI 2.0 and 3.0 (fmi-standard.org)."""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree import ElementTree as ET

from .variables import Variable


def description(
    variables: Sequence[Variable], *, fmi: str, name: str, identifier: str, token: str, dt: float, tool: str
) -> bytes:
    """The text of the file; a variable's value reference is its index."""
    three = fmi == "3.0"
    root = ET.Element(
        "fmiModelDescription",
        {
            "fmiVersion": fmi,
            "modelName": name,
            "instantiationToken" if three else "guid": token,
            "generationTool": tool,
            "variableNamingConvention": "flat",
        },
    )
    state = "FMUState" if three else "FMUstate"
    kind = {
        "modelIdentifier": identifier,
        "canHandleVariableCommunicationStepSize": "true",
        f"canGetAndSet{state}": "true",
        f"canSerialize{state}": "true",
    }
    ET.SubElement(root, "CoSimulation", kind | ({"fixedInternalStepSize": repr(dt)} if three else {}))
    categories = ET.SubElement(root, "LogCategories")
    for category in ("logStatusWarning", "logStatusError"):
        ET.SubElement(categories, "Category", {"name": category})
    ET.SubElement(root, "DefaultExperiment", {"startTime": "0", "stopTime": "5", "stepSize": repr(dt)})
    listed = ET.SubElement(root, "ModelVariables")
    for reference, variable in enumerate(variables):
        (_variable_3 if three else _variable_2)(listed, reference, variable)
    structure = ET.SubElement(root, "ModelStructure")
    # No output depends on an input at the same time: forces act from the next step on.
    outputs = [k for k, variable in enumerate(variables) if variable.causality == "output"]
    if three:
        for element in ("Output", "InitialUnknown"):
            for k in outputs:
                ET.SubElement(structure, element, {"valueReference": str(k), "dependencies": ""})
    elif outputs:
        for element in ("Outputs", "InitialUnknowns"):
            group = ET.SubElement(structure, element)
            for k in outputs:
                ET.SubElement(group, "Unknown", {"index": str(k + 1), "dependencies": ""})
    ET.indent(root)
    return ET.tostring(root, encoding="utf-8", xml_declaration=True) + b"\n"


def _common(reference: int, variable: Variable) -> dict[str, str]:
    given = {"name": variable.name, "valueReference": str(reference), "causality": variable.causality}
    if variable.description:
        given["description"] = variable.description
    return given | {"variability": "discrete" if variable.integer else "continuous"}


def _variable_3(listed: ET.Element, reference: int, variable: Variable) -> None:
    given = _common(reference, variable)
    if variable.causality == "input":
        given["start"] = repr(variable.start)
    ET.SubElement(listed, "Int32" if variable.integer else "Float64", given)


def _variable_2(listed: ET.Element, reference: int, variable: Variable) -> None:
    scalar = ET.SubElement(listed, "ScalarVariable", _common(reference, variable))
    start = {"start": repr(variable.start)} if variable.causality == "input" else {}
    ET.SubElement(scalar, "Integer" if variable.integer else "Real", start)
