"""Holds every element of a file against the rules, before MuJoCo sees it."""

from __future__ import annotations

from pathlib import Path

from ...checks import shortened
from ...errors import FileError
from ...limits import Limits
from .elements import Element, not_finite
from .issues import Issues
from .places import require_files
from .rules import MJCF, URDF, Rule, words
from .size import Budget, require_size
from .xml_lines import Faults, expand_includes, is_file, read_xml

LISTED = 100
"""Places in a message at most."""

NAMES = words(
    "name class childclass model body frame prefix file mesh hfield material joint jointinparent tendon site "
    "body1 body2 geom1 geom2 joint1 joint2 site1 site2 tendon1 tendon2 geom sidesite refsite cranksite "
    "slidersite link filename content_type type user"
)

RANGED = words("joint spatial fixed general motor position velocity intvelocity cylinder")
"""Elements whose attributes that end in "range" are a lower and an upper limit."""


def rule_of(element: Element, rules: dict[str, Rule]) -> Rule | None:
    parent = element.parent.tag if element.parent is not None else ""
    # Frames and copies group bodies and what is in them; their content follows the rules of a body.
    parent = "body" if parent in ("frame", "replicate", "worldbody") else parent
    return rules.get(f"{parent}/{element.tag}", rules.get(f"*/{element.tag}"))


def scan(root: Element, issues: Issues, folder: Path, limits: Limits, outer: tuple[Path, ...] = ()) -> None:
    """Adds what is not read to the issues; raises FileError for values that cannot be right.

    folder: that of the main file, from which attached models are found. outer: the files that attach it.
    """
    require_files(root, folder, limits)
    outer = (*outer, root.file.resolve())
    rules = URDF if root.tag == "robot" else MJCF
    wrong: list[str] = []
    found: dict[int, tuple[Element, Budget]] = {}

    def visit(element: Element) -> None:
        rule = rule_of(element, rules)
        if rule is None:
            _unknown(element, issues)
            return
        if rule.unread:
            issues.add(element, rule.unread, rule.effect)
            return
        if rule.subtree:
            return
        for attribute in element.attributes:
            _check(element, attribute, rule, issues)
        wrong.extend(f"{element.place}: {element}: {fault}" for fault in faults(element))
        if element.tag == "model":
            attached(element)
        for child in element.children:
            visit(child)

    def attached(element: Element) -> None:
        if id(element) in found:
            scan(found[id(element)][0], issues, file_of(element).parent, limits, outer)

    def file_of(element: Element) -> Path:
        return folder / element.attributes.get("file", "")

    def size_of(element: Element) -> int:
        """The elements of an attached file, which is read here."""
        file = file_of(element)
        if not is_file(file):
            wrong.append(f"{element.place}: {element}: the file {file} does not exist")
            return 0
        if file.resolve() in outer:
            raise element.fault(f"the file {file} attaches itself")
        faults: Faults = []
        budget = Budget(limits)
        other = read_xml(file, faults, budget)
        expand_includes(other, file.parent, faults, budget)
        for place, what in faults:
            issues.add(place, what, "none")
        found[id(element)] = other, budget
        return budget.elements

    require_size(root, limits, size_of)
    visit(root)
    if wrong:
        more = [f"and {len(wrong) - LISTED} more"] if len(wrong) > LISTED else []
        raise FileError("\n".join([*wrong[:LISTED], *more]))


def _unknown(element: Element, issues: Issues) -> None:
    prefix, colon, _ = element.tag.partition(":")
    if not colon:
        issues.add(element, "this element is not known")
    elif prefix == "xacro":
        issues.add(element, "a macro; run xacro first", "large")
    else:
        issues.add(element, f"an element for {prefix}, which MuJoCo does not read either", "none")


def _check(element: Element, attribute: str, rule: Rule, issues: Issues) -> None:
    if attribute in rule.checked:
        check, reason, *effect = rule.checked[attribute]
        if not check(element, attribute):
            issues.add(element, f'{attribute}="{element.attributes[attribute]}": {reason}', *effect)
    elif attribute not in rule.read | rule.ignored and not attribute.startswith("xmlns"):
        issues.add(element, f'{attribute}="{element.attributes[attribute]}": this attribute is not known')


def faults(element: Element) -> list[str]:
    """Values that no model can mean, which MuJoCo lets pass or reports without a line."""
    found = _spelling_faults(element)
    # Attributes in <default> are checked at the elements that use them.
    if any(parent.tag == "default" for parent in element.ancestors()):
        return found
    for name in ("mass", "density", "stiffness", "damping", "armature", "frictionloss", "kp", "kv"):
        if element.tag != "option" and any(x < 0 for x in (element.numbers(name) or [])[:1]):
            found.append(f'{name}="{element.attributes[name]}" is negative; it must be >= 0')
    if element.tag == "mass" and any(x < 0 for x in element.numbers("value") or []):
        found.append(f'value="{element.attributes["value"]}" is negative; a mass must be >= 0')
    if element.tag in ("geom", "pair") and any(x < 0 for x in element.numbers("friction") or []):
        found.append(f'friction="{element.attributes["friction"]}" is negative; it must be >= 0')
    return found + _limit_faults(element)


def _spelling_faults(element: Element) -> list[str]:
    """Names that break MuJoCo's parser, and attributes that are not numbers."""
    formats = [name for name in ("class", "childclass") if "%" in element.attributes.get(name, "")]
    endless = [
        name
        for name in element.attributes
        if name not in NAMES and not_finite(element, name) and not _may_be_infinite(element, name)
    ]
    return [
        f'{name}="{element.attributes[name]}" has a "%", which MuJoCo takes for a format; rename it'
        for name in formats
    ] + [f'{name}="{shortened(element.attributes[name])}" is not finite' for name in endless]


def _may_be_infinite(element: Element, name: str) -> bool:
    """Ranges, which their own check looks at, and infinite limits of URDF."""
    if element.tag != "limit":
        return name.endswith("range")
    return all(value == value for value in element.numbers(name) or [])


def _limit_faults(element: Element) -> list[str]:
    limits = [name for name in element.attributes if name.endswith("range")]
    found = []
    for name in limits:
        values = element.numbers(name) or []
        # The order does not matter for a limit that is off, and for "0 0", which means no limit in MuJoCo.
        off = element.attributes.get(name[:-5] + "limited" if name != "range" else "limited") == "false"
        if element.tag in RANGED and len(values) == 2:
            if values[0] != values[0] or values[1] != values[1]:
                found.append(f'{name}="{element.attributes[name]}" is not a number')
            elif not off and values[0] >= values[1] and any(values):
                found.append(
                    f'{name}="{element.attributes[name]}": the lower limit must be below the upper one'
                )
    return found
