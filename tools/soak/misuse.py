"""Every public function and class with one argument that it cannot mean, found by its signature.

A call is made that is good; then one or two of its arguments, whatever the signature lists, become something
else, now and then something that they can mean. The answer is a result, or an InputError that says what is
wrong; after it everything still works.
"""

from __future__ import annotations

import contextlib
import inspect
import itertools
import math
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import amontons
import numpy as np
import scipy.sparse as sp
from amontons import shapes

from .family import Case, Failure, Family, Measures
from .mutate.raw import Rng, pick

Call = tuple[Callable[..., Any], dict[str, Any]]
"""A function and good arguments by name."""


class Strange:
    """What no function expects."""

    def __repr__(self) -> str:
        return "Strange()"


class Unshown:
    def __repr__(self) -> str:
        raise RuntimeError("this object cannot be shown")


BAD: list[Callable[[], Any]] = [
    lambda: math.nan, lambda: math.inf, lambda: -math.inf, lambda: 1e300, lambda: -1e300, lambda: 1e200,
    lambda: 5e-324, lambda: -1, lambda: 0, lambda: -0.0, lambda: 2**31, lambda: 2**63, lambda: 2**64,
    lambda: -(2**63) - 1, lambda: 10**400, lambda: -(10**5000), lambda: Fraction(10**400, 3), lambda: 1 + 2j,
    lambda: True, lambda: None, lambda: "", lambda: "x", lambda: "\ud800", lambda: "%s%n", lambda: b"x",
    lambda: [], lambda: (), lambda: {}, lambda: set(), lambda: [[]], lambda: [None], lambda: ["a", "b", "c"],
    lambda: (1, 2), lambda: (1, 2, 3), lambda: (1.0, 2.0, math.nan), lambda: (1e200, 0, 0), lambda: (0, 0, 0),
    lambda: (10**400, 0, 0), lambda: (1, 2, 3, 4), lambda: [(1, 2, 3), (1, 2)], lambda: itertools.count(),
    lambda: (x for x in (0.1, 0.1, 0.1)), lambda: Strange(), lambda: Unshown(), lambda: object, lambda: len,
    lambda: np.nan, lambda: np.float16(1), lambda: np.int8(-1), lambda: np.uint64(2**64 - 1),
    lambda: np.longdouble("1e4000"), lambda: np.array([]), lambda: np.zeros((0, 3)),
    lambda: np.ones(3, complex),
    lambda: np.ones((3, 3)), lambda: np.full(3, np.nan), lambda: np.array(["a"]), lambda: np.array([None]),
    lambda: np.ma.masked, lambda: np.ones((2, 2, 2)), lambda: np.eye(3)[::-1], lambda: np.datetime64("2020"),
    lambda: sp.csr_array((3, 3)), lambda: slice(None), lambda: range(3), lambda: type("X", (float,), {})(1.0),
    lambda: NotImplemented, lambda: ..., lambda: [1] * 100_000, lambda: "x" * 100_000,
]  # fmt: skip

FINE: list[Any] = [1, 2, 0.01, True, False, None]
"""What some parameter of most functions can mean, so that they go on with it."""

VECTOR = (0.1, 0.2, 0.3)
CORNERS = [[x, y, z] for x in (0.0, 0.1) for y in (0.0, 0.1) for z in (0.0, 0.1)]
FRAME = amontons.Transform()


def world() -> amontons.ModelBuilder:
    """Two bodies with a hinge and an actuator, above a floor."""
    builder = amontons.ModelBuilder()
    builder.add_geom(None, shapes.Plane())
    builder.add_body("a", shape=shapes.Sphere(0.1), density=1000, position=(0, 0, 0.5))
    builder.add_body("b", shape=shapes.Box((0.1, 0.1, 0.1)), density=1000, position=(1, 0, 0.5))
    builder.add_revolute_joint("a", "b", point=(0.5, 0, 0.5), axis=(0, 1, 0), name="j")
    builder.add_site("a", name="s")
    return builder


GOOD: dict[str, Any] = {
    "name": "n", "a": "a", "b": "b", "body": "a", "shape": shapes.Sphere(0.1), "point": VECTOR,
    "axis": (0, 0, 1),     "position": VECTOR, "orientation": (1, 0, 0, 0), "rotation": (1, 0, 0, 0),
    "point_a": VECTOR, "axis_a": (0, 0, 1),     "point_b": (0.3, 0, 0), "axis_b": (1, 0, 0),
    "normal": (0, 0, 1), "direction": (0, 0, -1), "origin": VECTOR,     "radius": 0.1, "half_length": 0.2,
    "half": VECTOR, "radii": VECTOR, "vertices": CORNERS, "points": CORNERS,     "triangles": [[0, 1, 2]],
    "heights": np.zeros((3, 3)), "size_x": 1.0, "size_y": 1.0, "density": 1000.0,     "mass": 1.0,
    "inertia": VECTOR, "model": None, "dt": 0.005, "duration": 0.01, "joint": "j",
    "value": 0.1,     "A": np.eye(3), "cones": "bilateral", "n": 1, "mu": 0.3, "lo": -1.0, "hi": 1.0,
    "coefficients": None,     "inverse_mass": [1.0], "inverse_inertia": [VECTOR], "body_a": [0],
    "body_b": [-1], "x": np.zeros(3),     "jacobian_a": np.ones((1, 6)), "jacobian_b": np.zeros((1, 6)),
    "thing": "a", "dof": 0, "parent": "a",
}  # fmt: skip
"""A good value for parameters without a default, by name."""


def classes(rng: Rng) -> Call:
    """The constructor of a public class, of shapes and options too."""
    names = [n for n in amontons.__all__ if inspect.isclass(getattr(amontons, n))]
    found = [getattr(amontons, n) for n in names] + [getattr(shapes, n) for n in SHAPES]
    found = [
        c for c in found if c not in (amontons.vi.Solution, amontons.results.Rollout)
    ]  # which are results
    found = [c for c in found if not issubclass(c, BaseException) and c.__module__ != "amontons._core"]
    found = [c for c in found if not getattr(c, "_is_protocol", False)]  # which nobody constructs
    return _good(pick(rng, found))


SHAPES = [n for n in dir(shapes) if inspect.isclass(getattr(shapes, n)) and not n.startswith("_")]


def building(rng: Rng) -> Call:
    return _good(getattr(world(), str(pick(rng, _methods(amontons.ModelBuilder)))))


def simulating(rng: Rng) -> Call:
    simulation = amontons.Simulation(world().build())
    return _good(getattr(simulation, str(pick(rng, _methods(amontons.Simulation)))))


def making_simulations(rng: Rng) -> Call:
    return amontons.Simulation, {"model": world().build()}


def solving(rng: Rng) -> Call:
    arguments = {"A": np.eye(3), "b": np.array([-1.0, 0.1, 0.2]), "cones": "friction", "mu": 0.3}
    function = pick(rng, [amontons.vi.solve, amontons.vi.Problem, amontons.vi.solve])
    return function, arguments


def about_problems(rng: Rng) -> Call:
    problem = amontons.vi.Problem(np.eye(3), np.array([-1.0, 0.1, 0.2]), "friction", mu=0.3)
    function = pick(rng, [problem.solve, problem.residual, problem.write])
    arguments = {"x": np.zeros(3)} if function == problem.residual else {}
    return function, {"path": "p.npz"} if function == problem.write else arguments


def rolling_out(rng: Rng) -> Call:
    """Of simulations, which have their own options, or of states."""
    model = world().build()
    simulation = amontons.Simulation(model)
    arguments: dict[str, Any] = {"model": model, "states": [simulation, simulation.copy()], "steps": 2}
    if rng.random() < 0.5:
        arguments["states"] = [np.concatenate([simulation.q, simulation.qd])] * 2
        arguments |= {"dt": 0.01, "law": "associated", "tolerance": 1e-4, "budget": 1e-3}
    return amontons.rollout, arguments


def state(rng: Rng) -> Call:
    """Assignments to the state and the controls, and the step after them."""
    simulation = amontons.Simulation(world().build())
    names = [n for n in dir(simulation.state) if not n.startswith("_")]
    name = str(pick(rng, names))

    def assign(value: Any) -> Any:
        target = getattr(simulation.state, name)
        if isinstance(target, np.ndarray) and target.size and rng.random() < 0.7:
            try:
                target.reshape(-1)[int(rng.integers(target.size))] = value
            except Exception:  # of NumPy, which says what is wrong
                return None
        else:
            try:
                setattr(simulation.state, name, value)
            except AttributeError:  # read only
                return None
        return simulation

    return assign, {"value": 0.5}


GROUPS = {
    f.__name__: f
    for f in (classes, building, simulating, making_simulations, solving, about_problems, rolling_out, state)
}
SKIPPED = {"load", "save", "write", "view", "problem"}
"""Methods that open files or windows."""


def _methods(of: type) -> list[str]:
    found = inspect.getmembers(of, lambda member: inspect.isfunction(member))
    return [n for n, _ in found if not n.startswith("_") and n not in SKIPPED]


def _good(function: Callable[..., Any]) -> Call:
    """The function with good arguments for what has no default."""
    wanted = _parameters(function)
    return function, {n: GOOD.get(n, 0.1) for n, p in wanted.items() if p.default is inspect.Parameter.empty}


def _parameters(function: Callable[..., Any]) -> dict[str, inspect.Parameter]:
    try:
        listed = inspect.signature(function).parameters
    except (ValueError, TypeError):
        return {}
    kinds = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)
    found = {n: p for n, p in listed.items() if p.kind in kinds}
    options = [p for p in listed.values() if p.kind == inspect.Parameter.VAR_KEYWORD]
    if options and (names := getattr(_unpacked(function), "__annotations__", None)):
        found |= {n: inspect.Parameter(n, kinds[1], default=None) for n in names}
    return found


def _unpacked(function: Callable[..., Any]) -> Any:
    """The TypedDict of **options: Unpack[...], by name from the module of the function."""
    text = str(inspect.get_annotations(function).get("options", ""))
    name = text.removeprefix("Unpack[").removesuffix("]")
    return getattr(inspect.getmodule(function), name, None)


def harmless(name: str, value: Any) -> Any:
    """The value, if it is not what a function rightly does for years, or what raises by itself."""
    allowed = amontons.ranges.OPTIONS.get(name)
    if name in ("duration", "steps", "repeat") and value in allowed and value > 20:
        return 20 * GOOD["dt"] if name == "duration" else 20
    return None if name == "callback" and callable(value) else value


def run(group: Callable[[Rng], Call], case: Case) -> Measures:
    rng = case.rng()
    function, arguments = group(rng)
    parameters = list(_parameters(function) | arguments)
    what = getattr(function, "__qualname__", str(function))
    for part in range(int(rng.choice([1, 1, 2]))):
        mine = case.rng(part)
        if parameters and case.kept(part):
            name = str(pick(mine, parameters))
            value = pick(mine, FINE) if mine.random() < 0.3 else pick(mine, BAD)()  # type: ignore[operator]
            arguments[name] = harmless(name, value)
            what += f" {name}={amontons.checks.shown(arguments[name])}"
    (case.folder / "call.txt").write_text(what + "\n", errors="replace")
    try:
        with contextlib.chdir(case.folder):  # for what writes files
            result = function(**arguments)
        after(result if not isinstance(function, type) or result is not None else None)
    except (amontons.InputError, amontons.SimulationError) as error:
        if len(str(error)) > 5000:
            raise Failure("endless message", f"{what}: {len(str(error))} characters") from None
        return {"outcome": "refused"}
    except Exception as error:
        error.add_note(f"call: {what}")
        raise
    return {"outcome": "accepted"}


def after(result: Any) -> None:
    """What was accepted works, and its numbers are numbers."""
    if isinstance(result, amontons.Simulation):
        result.step()
        require_finite(result.state.positions, "positions after a step")
        require_finite(result.state.linear_velocities, "velocities after a step")
    if isinstance(result, amontons.results.Rollout):
        require_finite(result.q, "coordinates of a rollout")
        require_finite(result.qd, "velocities of a rollout")
    if isinstance(result, amontons.vi.Solution):
        require_finite(result.x, "x of a solution")
    if isinstance(result, amontons.vi.Problem):
        result.solve(max_iterations=3)


def require_finite(values: Any, what: str) -> None:
    if not np.isfinite(values).all():
        raise Failure("accepted nonsense", f"{what} are not finite")


def _family(group: Callable[[Rng], Call]) -> Family:
    name = f"misuse-{group.__name__.replace('_', '-')}"
    return Family(name, "arguments that mean nothing", lambda case: run(group, case), share=0.5)


FAMILIES = [_family(group) for group in GROUPS.values()]
