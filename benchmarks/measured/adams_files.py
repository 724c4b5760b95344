"""Results and models of Adams, and the programs that state the parameters of the same cases."""

from __future__ import annotations

import ast
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

Array = np.ndarray[Any, Any]
G = 9.80665  # m/s^2, of all cases


@dataclass(frozen=True)
class Part:
    """A body: mass (kg), principal moments (kg m^2), position (m) and axes of its centre, velocity (m/s)."""

    mass: float
    moments: tuple[float, ...]
    position: Array
    rotation: Rotation
    velocity: Array = field(default_factory=lambda: np.zeros(3))


@dataclass(frozen=True)
class Connection:
    """A joint or force between a part and another (or the ground, ""): `kind`, the frame on the part, the
    point on the other side, and numbers by name."""

    kind: str
    part: str
    other: str
    point: Array
    rotation: Rotation
    far: Array
    numbers: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Case:
    """A mechanism and what Adams computed of it; `results` by quantity, (n, columns) with times (s) first."""

    name: str
    parts: dict[str, Part]
    connections: dict[str, Connection]
    results: dict[str, Array]
    tolerances: dict[str, float]
    """by quantity: rms errors that the other engine's authors allow it"""
    their_step: float | None = None
    """s, of the other engine in that test"""

    def at(self, quantity: str, times: Array) -> Array:
        """Columns of a quantity at these times, by cubic splines."""
        table = self.results[quantity]
        return CubicSpline(table[:, 0], table[:, 1:])(times)


def read_results(folder: Path) -> dict[str, dict[str, Array]]:
    """Tables by case and quantity: of all files NAME_CaseNN_ADAMS_QUANTITY.txt of a folder."""
    found: dict[str, dict[str, Array]] = {}
    for path in sorted(folder.glob("*_ADAMS_*.txt")):
        case, _, quantity = path.stem.partition("_ADAMS_")
        found.setdefault(case, {})[quantity] = np.loadtxt(path, skiprows=3, ndmin=2)
    return found


def read_cases(folder: Path) -> tuple[list[Case], list[str]]:
    """All cases with results; and those whose mechanism is not read, with the reason."""
    calls = read_programs(folder / "cases")
    cases, unread = [], []
    for name, results in read_results(folder).items():
        model = folder / f"test_{name}.adm"
        if name in calls and calls[name].kind in FROM_CALL:
            parts, connections = FROM_CALL[calls[name].kind](calls[name])
        elif model.exists():
            try:
                parts, connections = read_adm(model.read_text())
            except ValueError as error:
                unread.append(f"{name}: {error}")
                continue
        else:
            unread.append(f"{name}: no test_{name}.adm and no call in cases")
            continue
        call = calls.get(name)
        step = re.search(STEP, call.text) if call else None
        tolerances = call.tolerances if call else {}
        cases.append(Case(name, parts, connections, results, tolerances, float(step[1]) if step else None))
    return cases, unread


# ---- programs ------------------------------------------------------------------------------------------


STEP = r"sim_step = ([\d.e+-]+);"


@dataclass(frozen=True)
class Call:
    """How a program makes a case: the kind of its test, the arguments, and numbers that it sets."""

    kind: str
    arguments: list[Any]
    text: str
    tolerances: dict[str, float]

    def number(self, pattern: str) -> list[float]:
        """The numbers of the first match of a pattern with one group."""
        found = re.search(pattern, self.text)
        if found is None:
            raise ValueError(f"no {pattern} in the program of {self.kind}")
        return [float(x) for x in found[1].split(",")]

    def part(self, position: Array, rotation: Rotation, velocity: Array | None = None) -> Part:
        (mass,) = self.number(r"double mass = ([\d.]+)")
        moments = self.number(r"inertiaXX\(([^)]*)\)")
        return Part(mass, tuple(moments), position, rotation, np.zeros(3) if velocity is None else velocity)


def read_programs(folder: Path) -> dict[str, Call]:
    """The call of each case: the one that follows the line with its name."""
    found: dict[str, Call] = {}
    for path in sorted(folder.glob("*.txt")):
        text = path.read_text()
        for name in re.finditer(r'test_name = "(\w+_Case\w+)"', text):
            call = re.compile(r"\bTest(\w+)\(").search(text, name.end())
            if call is None:
                continue
            kind = re.sub(r"_Case.*", "", name[1])
            tolerances = _tolerances(text[name.end() :])
            # A case that is run in several formulations: the first one's call, and all tolerances.
            found.setdefault(name[1], Call(kind, _arguments(text, call.end()), text, {}))
            for quantity, value in tolerances.items():
                known = found[name[1]].tolerances
                known[quantity] = max(value, known.get(quantity, 0.0))
    return found


def _tolerances(text: str) -> dict[str, float]:
    """By quantity, up to the next case."""
    own = re.split(r'test_name = "\w+_Case', text)[0]
    return {q: float(v) for q, v in re.findall(r'ValidateReference\([^;]*?"(\w+)", ([\d.e+-]+)\)', own)}


_NAMES = {
    "QUNIT": Rotation.identity(), "CH_PI": np.pi, "CH_PI_2": np.pi / 2, "CH_PI_4": np.pi / 4,
    "ChVector3d": lambda *x: np.array(x, dtype=float), "ChCoordsys": lambda p, r: (p, r),
    **{f"QuatFromAngle{axis}": lambda a, axis=axis: Rotation.from_euler(axis.lower(), a) for axis in "XYZ"},
}  # fmt: skip


def _arguments(text: str, start: int) -> list[Any]:
    """The values of the arguments of a call; those that are no vector, rotation or number are their text."""
    depth, end = 1, start
    while depth:
        depth += {"(": 1, ")": -1}.get(text[end], 0)
        end += 1
    source = re.sub(r"<>|\s+", " ", text[start : end - 1]).replace("::", ".")
    tuple_of = ast.parse(f"({source},)", mode="eval").body
    assert isinstance(tuple_of, ast.Tuple)
    return [_value(node) for node in tuple_of.elts]


def _value(node: ast.expr) -> Any:
    match node:
        case ast.Constant(value=value):
            return value
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return -_value(operand)
        case ast.BinOp(left=left, op=ast.Div(), right=right):
            return _value(left) / _value(right)
        case ast.Name(id=name) if name in _NAMES:
            return _NAMES[name]
        case ast.Call(func=ast.Name(id=name), args=args) if name in _NAMES:
            return _NAMES[name](*map(_value, args))
    return ast.unparse(node)


Mechanism = tuple[dict[str, Part], dict[str, Connection]]


def _actuator(call: Call) -> Mechanism:
    rotation, speed = call.arguments[:2]
    axis = rotation.apply([0, 0, 1])
    part, zero = call.part(np.zeros(3), rotation, speed * axis), np.zeros(3)
    joint = Connection("prismatic", "part", "", zero, rotation, zero, {"speed": speed})
    return {"part": part}, {"joint": joint}


def _revolute_spherical(call: Call) -> Mechanism:
    """A rod that turns about an axis of the ground and ends in a ball on the part."""
    ground, axis, point, (position, rotation) = call.arguments[:4]
    frame = Rotation.align_vectors([axis], [[0, 0, 1]])[0]
    part = call.part(position, rotation)
    return {"part": part}, {"joint": Connection("rod", "part", "", point, frame, ground)}


def _rotational_spring(call: Call) -> Mechanism:
    point, rotation, kind = call.arguments[:3]
    part = call.part(point + rotation.apply([2, 0, 0]), rotation)
    numbers = {"damping": call.number(r"SetDampingCoefficient\(([\d.]+)\)")[0]}
    if kind == 1:
        numbers["stiffness"] = call.number(r"SetSpringCoefficient\(([\d.]+)\)")[0]
    else:  # torque (k + k' |angle|) angle
        numbers["stiffness"] = call.number(r"spring_coef = ([\d.]+)")[0]
        numbers["stiffening"] = call.number(r"spring_nonlin_coef = ([\d.]+)")[0]
    return {"part": part}, {"joint": Connection("revolute", "part", "", point, rotation, point, numbers)}


def _spring(call: Call) -> Mechanism:
    ground, point, (position, rotation), stiffness, damping = call.arguments[:5]
    numbers = {"stiffness": stiffness, "damping": damping}
    part = call.part(position, rotation)
    return {"part": part}, {"spring": Connection("spring", "part", "", point, rotation, ground, numbers)}


FROM_CALL = {"LinActuator": _actuator, "RevSpherical": _revolute_spherical,
             "RotSpring": _rotational_spring, "TranSpring": _spring}  # fmt: skip
"""Kinds of cases that have no model of Adams here, or one of another case under their name."""


# ---- models of Adams -----------------------------------------------------------------------------------

JOINTS = {"REVOLUTE": "revolute", "CYLINDRICAL": "cylindrical", "TRANSLATIONAL": "prismatic",
          "SPHERICAL": "ball", "HOOKE": "universal", "RACKPIN": "rack"}  # fmt: skip


def read_adm(text: str) -> Mechanism:
    """Parts and joints of a model of Adams (.adm): markers are in the axes of the ground."""
    statements = _statements(text)
    markers = {
        number: (_id(fields.get("PART", "")), _vector(fields.get("QP")), _euler(fields.get("REULER")))
        for kind, number, fields in statements
        if kind == "MARKER"
    }
    parts = {}
    for kind, number, fields in statements:
        if kind == "PART" and "MASS" in fields:
            _, position, rotation = markers[_id(fields["CM"])]
            parts[number] = Part(float(fields["MASS"]), tuple(_vector(fields["IP"])), position, rotation)
    connections = {}
    for kind, number, fields in statements:
        if kind == "GCON":
            first, second, length = re.match(r"DM\((\d+), *(\d+)\)-([\d.]+)", fields["FUNCTION"]).groups()  # type: ignore[union-attr]
            found = _connection("distance", _id(first), _id(second), markers, parts)
            found.numbers["length"] = float(length)
        elif kind == "JOINT":
            names = set(fields) & set(JOINTS)
            if not names:
                raise ValueError(f"JOINT/{number}: of {', '.join(fields)} none is a joint that is read")
            found = _connection(JOINTS[names.pop()], _id(fields["I"]), _id(fields["J"]), markers, parts)
            if "PD" in fields:  # the pitch diameter: J moves along its axis by half of it per radian of I
                found.numbers["diameter"] = float(fields["PD"])
        else:
            continue
        connections[number] = found
    return parts, connections


def _connection(kind: str, i: str, j: str, markers: dict[str, Any], parts: dict[str, Part]) -> Connection:
    """Marker I is on the other side, J on the part, as in these models; turned round if I moves alone."""
    if markers[i][0] in parts and markers[j][0] not in parts:
        i, j = j, i
    part, point, rotation = markers[j]
    other, far, _ = markers[i]
    return Connection(kind, part, other if other in parts else "", point, rotation, far)


def _statements(text: str) -> list[tuple[str, str, dict[str, str]]]:
    """(kind, number, fields) of each statement; lines that begin with a comma go on with the one before."""
    lines: list[str] = []
    for line in text.splitlines():
        plain = line.partition("!")[0].strip()
        if plain.startswith(",") and lines:
            lines[-1] += plain
        elif plain:
            lines.append(plain)
    found = []
    for line in lines:
        head = re.match(r"(\w+)/(\d*)", line)
        if head is None:
            continue
        fields, last = {}, ""
        for piece in _pieces(line[head.end() :]):
            key, equals, value = piece.partition("=")
            if equals:
                last = key.strip()
                fields[last] = value.strip()
            elif last and re.match(r"[-+\d.]", piece):
                fields[last] += f",{piece}"
            else:
                fields[piece] = ""
        found.append((head[1], _id(head[2]), fields))
    return found


def _pieces(text: str) -> list[str]:
    """Parts between commas outside parentheses."""
    depth, pieces = 0, [""]
    for letter in text:
        depth += {"(": 1, ")": -1}.get(letter, 0)
        if letter == "," and not depth:
            pieces.append("")
        else:
            pieces[-1] += letter
    return [piece.strip() for piece in pieces if piece.strip()]


def _id(text: str) -> str:
    return text.strip().lstrip("0")


def _vector(text: str | None) -> Array:
    return np.array([float(x) for x in text.split(",")]) if text else np.zeros(3)


def _euler(text: str | None) -> Rotation:
    """Angles about the z, x and z axes of the body, in degrees with a D behind, else radians."""
    if not text:
        return Rotation.identity()
    angles = [
        np.radians(float(x[:-1])) if x.endswith("D") else float(x) for x in map(str.strip, text.split(","))
    ]
    return Rotation.from_euler("ZXZ", angles)
