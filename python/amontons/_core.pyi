"""
The C++ core of amontons. Use the package `amontons`, which checks and documents its arguments.
"""

from collections.abc import Callable, Sequence
import enum
from typing import Annotated, overload

import numpy
from numpy.typing import NDArray


class InputError(ValueError):
    pass

def instruction_set() -> str:
    """The kernels that this processor runs: baseline, avx2 or avx512."""

def compiler() -> str:
    """Name and version of the compiler that made this module."""

def policy() -> dict:
    """The tuned numbers of the core by name; counts are integers."""

def set_policy(name: str, value: float) -> None:
    """
    Sets a tuned number of this process, while nothing is solved. benchmarks/sensitivity.py alone calls it.
    """

class SetProduct:
    """A product of small sets, in the order in which they are added."""

    def __init__(self) -> None: ...

    def add(self, name: str, count: int, parameters: Sequence[Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]]) -> None:
        """
        Blocks of the set of that name, with one array of `count` entries per parameter.
        """

    @property
    def rows(self) -> int: ...

    @property
    def blocks(self) -> int: ...

    @property
    def contacts(self) -> int: ...

    def project(self, x: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]:
        """Euclidean projection on the product."""

    def distance(self, x: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> float:
        """Euclidean distance to the product."""

class Operator:
    """A symmetric positive semidefinite map, one of four kinds."""

    @property
    def rows(self) -> int: ...

    def product(self, x: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]:
        """A x."""

    def diagonal(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]: ...

    def stored(self) -> tuple: ...

def sparse_operator(indptr: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C', device='cpu', writable=False)], indices: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C', device='cpu', writable=False)], data: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> Operator: ...

def dense_operator(a: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)]) -> Operator: ...

def callback_operator(function: Callable, diagonal: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> Operator: ...

def body_operator(inverse_mass: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], inverse_inertia: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], body_a: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C', device='cpu', writable=False)], body_b: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C', device='cpu', writable=False)], jacobian_a: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], jacobian_b: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], compliance: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> Operator: ...

def contact_operator(inverse_mass: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], inverse_inertia: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], body_a: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C', device='cpu', writable=False)], body_b: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C', device='cpu', writable=False)], r_a: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], r_b: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], normal: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], direction: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], rows: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C', device='cpu', writable=False)], moment_length: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], compliance: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], joint_body_a: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C', device='cpu', writable=False)], joint_body_b: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C', device='cpu', writable=False)], joint_jacobian_a: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], joint_jacobian_b: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], joint_compliance: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> Operator: ...

def contact_tangents(normals: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], directions: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]:
    """
    Both tangents of every contact, six numbers each; the first along the direction unless that is zero.
    """

class Law(enum.Enum):
    associated = 0

    coulomb = 1

class Norm(enum.Enum):
    natural = 0

    plain = 1

    plain_inf = 2

    siconos = 3

ASYMMETRY: float = 1e-10

class Problem:
    """A x + b over a product of sets; checked when it is made."""

    def __init__(self, A: Operator, b: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], cones: SetProduct, law: Law) -> None:
        """Takes over the operator A."""

    def project(self, x: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]:
        """Pi_K(x), Euclidean."""

    def de_saxce(self, u: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], law: Law) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]:
        """The De Saxce term."""

    def natural_map(self, x: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], law: Law) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]:
        """x - Pi_K(x - g / P)."""

    @property
    def law(self) -> Law: ...

    @property
    def rows(self) -> int: ...

    @property
    def b(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]:
        """A view; not to be written."""

    @property
    def has_moments(self) -> bool:
        """Whether a contact has moments, over its length."""

    def sets(self) -> list:
        """The sets in row order: (name, count, parameters ...)."""

    def operator_arrays(self) -> dict:
        """
        Arguments of amontons.vi.Contacts or amontons.vi.Factored, or the matrix of a step with trees.
        """

    @property
    def preconditioner(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]:
        """Mean of diag(A) of the cone block of each row."""

    def product(self, x: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]:
        """A x."""

    def residual(self, x: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], law: Law, norm: Norm) -> float: ...

    def violations(self, x: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], law: Law) -> tuple:
        """(penetration velocity, cone, complementarity, energy)."""

class IterateSource:
    """Where first-order methods take their iterates from."""

    def __init__(self, name: str, make: Callable, with_layout: bool, least_contacts: int, as_method: bool = False) -> None: ...

class PairSearch:
    """Who finds boxes that overlap, in place of the library."""

    def __init__(self, find: Callable, least: int, memory: object | None = None) -> None: ...

class DeviceLayout:
    """The arrays of the passes, as a device reads them."""

    def __init__(self, problem: Problem, threads: int = 0, memory: object | None = None) -> None: ...

    def fill(self, problem: Problem, threads: int = 0) -> None:
        """Another problem in the same memory."""

    @staticmethod
    def fits(problem: Problem) -> bool:
        """
        Whether it has bodies, circular friction cones and single rows, and nothing else.
        """

    @property
    def contacts(self) -> int: ...

    @property
    def rows(self) -> int:
        """Single rows."""

    @property
    def bodies(self) -> int:
        """That impulses move."""

    @property
    def stride(self) -> int: ...

    @property
    def row_stride(self) -> int: ...

    @property
    def line_stride(self) -> int: ...

    @property
    def stored(self) -> bool:
        """Contacts are rows of D."""

    @property
    def compliant(self) -> bool: ...

    @property
    def size(self) -> int:
        """Of a vector of the passes."""

    def arrays(self) -> dict:
        """Views by name; include/amontons/solvers/first_order/device_layout.hpp."""

    def changed(self) -> list[str]:
        """Names of the arrays that differ from those of the problem before."""

    def start(self, x0: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]:
        """Pi_K of x0, (m,), in the order and the axes of the passes, (size,)."""

    def to_user(self, held: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]:
        """The way back: (m,) of (size,)."""

class Options:
    """Options of a solve; x0 and callback are arguments of solve()."""

    def __init__(self) -> None: ...

    @property
    def law(self) -> Law | None: ...

    @law.setter
    def law(self, arg: Law | None, /) -> None: ...

    @property
    def tolerance(self) -> float: ...

    @tolerance.setter
    def tolerance(self, arg: float, /) -> None: ...

    @property
    def max_iterations(self) -> int: ...

    @max_iterations.setter
    def max_iterations(self, arg: int, /) -> None: ...

    @property
    def deadline(self) -> float: ...

    @deadline.setter
    def deadline(self, arg: float, /) -> None: ...

    @property
    def history(self) -> bool: ...

    @history.setter
    def history(self, arg: bool, /) -> None: ...

    @property
    def threads(self) -> int: ...

    @threads.setter
    def threads(self, arg: int, /) -> None: ...

    @property
    def iterates(self) -> IterateSource: ...

    @iterates.setter
    def iterates(self, arg: IterateSource | None, /) -> None: ...

    @property
    def alpha_min(self) -> float: ...

    @alpha_min.setter
    def alpha_min(self, arg: float, /) -> None: ...

    @property
    def alpha_max(self) -> float: ...

    @alpha_max.setter
    def alpha_max(self, arg: float, /) -> None: ...

    @property
    def sigma_min(self) -> float: ...

    @sigma_min.setter
    def sigma_min(self, arg: float, /) -> None: ...

    @property
    def sigma_max(self) -> float: ...

    @sigma_max.setter
    def sigma_max(self, arg: float, /) -> None: ...

    @property
    def memory(self) -> int: ...

    @memory.setter
    def memory(self, arg: int, /) -> None: ...

    @property
    def gamma(self) -> float: ...

    @gamma.setter
    def gamma(self, arg: float, /) -> None: ...

    @property
    def tau_g(self) -> float: ...

    @tau_g.setter
    def tau_g(self, arg: float, /) -> None: ...

    @property
    def sor_omega(self) -> float: ...

    @sor_omega.setter
    def sor_omega(self, arg: float, /) -> None: ...

    @property
    def jacobi_omega(self) -> float: ...

    @jacobi_omega.setter
    def jacobi_omega(self, arg: float, /) -> None: ...

class IterationRecord:
    """
    An iteration, as the callback of a solve gets it.

    >>> def stop(record):
    ...     return record.iteration >= 3
    >>> problem = vi.read_problem(examples.path("wall_impact.hdf5"))
    >>> problem.solve(method="apgd", callback=stop).iterations
    3
    """

    @property
    def iteration(self) -> int:
        """0 for the starting point"""

    @property
    def products(self) -> int:
        """products with A so far"""

    @property
    def time(self) -> float:
        """s since the start of the solve"""

    @property
    def residual(self) -> float:
        """natural residual of the current iterate"""

    @property
    def best_residual(self) -> float:
        """natural residual of the best iterate so far"""

    @property
    def objective(self) -> float:
        """1/2 x'Ax + b'x of the current iterate (J)"""

    @property
    def step(self) -> float:
        """step size, penalty or step length of the method; 0 if none"""

    @property
    def backtracks(self) -> int:
        """backtracking steps of the line search"""

    def __repr__(self) -> str: ...

class Result:
    """A solution; the arrays view its memory."""

    @property
    def x(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]: ...

    @property
    def u(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]: ...

    @property
    def status(self) -> str: ...

    @property
    def residual(self) -> float: ...

    @property
    def objective(self) -> float: ...

    @property
    def iterations(self) -> int: ...

    @property
    def products(self) -> int: ...

    @property
    def work(self) -> float: ...

    @property
    def factorizations(self) -> int: ...

    @property
    def time(self) -> float: ...

    @property
    def method(self) -> str: ...

    @property
    def device(self) -> str: ...

    @property
    def reason(self) -> str: ...

    @property
    def phases(self) -> list: ...

    @property
    def history(self) -> Annotated[NDArray[numpy.uint8], dict(shape=(None,))]: ...

def solve(problem: Problem, method: str, options: Options, x0: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)] | None = None, callback: object | None = None) -> Result: ...

def method_names() -> list[str]: ...

class Shape:
    """A collision shape; checked when it is made."""

    @staticmethod
    def of(kind: str, values: dict) -> Shape:
        """A shape of a few lengths, by name."""

    @staticmethod
    def hull(vertices: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], triangles: Annotated[NDArray[numpy.int32], dict(shape=(None, None), order='C', device='cpu', writable=False)]) -> Shape: ...

    @staticmethod
    def mesh(vertices: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], triangles: Annotated[NDArray[numpy.int32], dict(shape=(None, None), order='C', device='cpu', writable=False)]) -> Shape: ...

    @staticmethod
    def height_field(heights: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], size_x: float, size_y: float) -> Shape: ...

    @property
    def kind(self) -> str: ...

    @property
    def values(self) -> dict:
        """What it was made of, by name."""

    @property
    def key(self) -> int:
        """Equal for shapes that share their data; 0 for one of a few lengths."""

    def mass_properties(self, density: float) -> tuple[float, list[float], list[list[float]]]:
        """Mass, centre, inertia about the centre."""

    def cast_ray(self, origin: Sequence[float], direction: Sequence[float]) -> tuple[float, list[float]]:
        """Distance, normal; in the frame of the shape."""

    def bounds(self, position: Sequence[float], orientation: Sequence[float]) -> tuple[list[float], list[float]]:
        """Corners of the box around it, world axes."""

def moved_solid(solid: tuple[float, Sequence[float], Sequence[Sequence[float]]], frame: tuple[Sequence[float], Sequence[float]]) -> tuple[float, list[float], list[list[float]]]:
    """(mass, centre, inertia) seen from the parent of the frame."""

def sum_of_solids(a: tuple[float, Sequence[float], Sequence[Sequence[float]]], b: tuple[float, Sequence[float], Sequence[Sequence[float]]]) -> tuple[float, list[float], list[list[float]]]:
    """(mass, centre, inertia) of both as one."""

def collide(shape_a: Shape, position_a: Sequence[float], orientation_a: Sequence[float], shape_b: Shape, position_b: Sequence[float], orientation_b: Sequence[float], margin: float) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]:
    """(n, 7): point, normal from B to A, gap."""

def broad_phase(lower: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], upper: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], fixed: Annotated[NDArray[numpy.bool_], dict(shape=(None,), order='C', device='cpu', writable=False)], radii: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], travels: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], outside: PairSearch | None = None) -> Annotated[NDArray[numpy.int32], dict(shape=(None, None))]:
    """
    (k, 2): the pairs of boxes that overlap, with balls in their middles that may touch. A ball with a bound has the box of its travel.
    """

class Motion(enum.Enum):
    dynamic = 0

    kinematic = 1

    static = 2

class FrictionRule(enum.Enum):
    geometric_mean = 0

    maximum = 1

    minimum = 2

    mean = 3

class Trees(enum.Enum):
    none = 0

    auto = 1

class MotorKind(enum.Enum):
    none = 0

    effort = 1

    velocity = 2

    position = 3

class DofKind(enum.Enum):
    hinge = 0

    slide = 1

class JointKind(enum.Enum):
    chain = 0

    distance = 1

class PathKind(enum.Enum):
    point = 0

    sphere = 1

    cylinder = 2

    pulley = 3

class TransmissionKind(enum.Enum):
    dof = 0

    tendon = 1

    wrench = 2

    slider_crank = 3

class ActivationKind(enum.Enum):
    none = 0

    integrator = 1

    filter = 2

class Look:
    """A shape, or a mesh of pictures as two packed arrays, or neither."""

    @overload
    def __init__(self) -> None: ...

    @overload
    def __init__(self, shape: Shape) -> None: ...

    @overload
    def __init__(self, vertices: str, triangles: str) -> None: ...

    @property
    def shape(self) -> Shape | None: ...

    @property
    def mesh(self) -> tuple[str, str] | None: ...

    @property
    def key(self) -> int:
        """Equal for looks that share a mesh."""

class JointEnd:
    def __init__(self, body: int, pose: tuple[Sequence[float], Sequence[float]], part: tuple[Sequence[float], Sequence[float]]) -> None: ...

def dofs_of_kind(kind: str) -> int: ...

def joint_between(kind: str, a: JointEnd, b: JointEnd, make: Callable, **given) -> object: ...

def solid_of(who: str, **given) -> tuple[float, list[float], list[list[float]]]:
    """(mass, centre, inertia) of a new body."""

def write_model(description: object) -> str:
    """Its JSON text."""

def read_model(text: str, who: str, make: Callable) -> dict:
    """
    The fields of a model in a JSON text; InputErrors begin with `who` and name the place.
    """

class Model:
    """A checked description, which never changes."""

    def __init__(self, description: object) -> None: ...

    @property
    def dofs(self) -> int: ...

    @property
    def length(self) -> float: ...

    @property
    def total_mass(self) -> float: ...

    @property
    def controls(self) -> list[tuple[int, int, int]]:
        """
        (actuator, joint, dof) of every control; without an actuator it is that of a motor.
        """

    def overlaps(self, depth: float) -> list[tuple[int, int]]:
        """
        Pairs of geoms that may touch and overlap by more in the initial state.
        """

    def may_touch(self, geom_a: int, geom_b: int) -> bool: ...

    def material(self, geom_a: int, geom_b: int, make: Callable) -> object: ...

    def first_dof(self, joint: int) -> int: ...

FARTHEST: float = 1000000000000000.0

class State:
    """A copy of all that a simulation changes."""

    def __init__(self, model: Model, time: float, steps: int, impulse_step: float, arrays: dict, last_step: float = 0.0) -> None: ...

    @property
    def time(self) -> float: ...

    @property
    def steps(self) -> int: ...

    @property
    def arrays(self) -> dict:
        """Every array by name, as copies."""

class SimulationOptions:
    """Fields of zero that may be automatic follow from the model."""

    def __init__(self) -> None: ...

    @property
    def dt(self) -> float: ...

    @dt.setter
    def dt(self, arg: float, /) -> None: ...

    @property
    def law(self) -> Law: ...

    @law.setter
    def law(self, arg: Law, /) -> None: ...

    @property
    def method(self) -> str: ...

    @method.setter
    def method(self, arg: str, /) -> None: ...

    def set_own_method(self, function: object) -> None:
        """function(problem, x0 or None, options) -> x in the place of a method."""

    @property
    def tolerance(self) -> float: ...

    @tolerance.setter
    def tolerance(self, arg: float, /) -> None: ...

    @property
    def max_iterations(self) -> int: ...

    @max_iterations.setter
    def max_iterations(self, arg: int, /) -> None: ...

    @property
    def budget(self) -> float: ...

    @budget.setter
    def budget(self, arg: float, /) -> None: ...

    @property
    def threads(self) -> int: ...

    @threads.setter
    def threads(self, arg: int, /) -> None: ...

    @property
    def iterates(self) -> IterateSource: ...

    @iterates.setter
    def iterates(self, arg: IterateSource | None, /) -> None: ...

    @property
    def pairs(self) -> PairSearch: ...

    @pairs.setter
    def pairs(self, arg: PairSearch | None, /) -> None: ...

    @property
    def margin(self) -> float: ...

    @margin.setter
    def margin(self, arg: float, /) -> None: ...

    @property
    def recovery(self) -> str: ...

    @recovery.setter
    def recovery(self, arg: str, /) -> None: ...

    @property
    def recovery_speed(self) -> float: ...

    @recovery_speed.setter
    def recovery_speed(self, arg: float, /) -> None: ...

    @property
    def restitution_speed(self) -> float: ...

    @restitution_speed.setter
    def restitution_speed(self, arg: float, /) -> None: ...

    @property
    def warm_start(self) -> bool: ...

    @warm_start.setter
    def warm_start(self, arg: bool, /) -> None: ...

    @property
    def max_substeps(self) -> int: ...

    @max_substeps.setter
    def max_substeps(self, arg: int, /) -> None: ...

class Timings:
    @property
    def collision(self) -> float: ...

    @property
    def assembly(self) -> float: ...

    @property
    def solve(self) -> float: ...

    @property
    def integration(self) -> float: ...

    @property
    def total(self) -> float: ...

class Report:
    @property
    def time(self) -> float: ...

    @property
    def advanced(self) -> bool: ...

    @property
    def status(self) -> str: ...

    @property
    def is_sound(self) -> bool: ...

    def is_usual(self, length: float) -> bool:
        """
        Whether the step is sound and no joint stays apart by more than length / 1000: nothing to warn of.
        """

    @property
    def residual(self) -> float: ...

    @property
    def path(self) -> str: ...

    @property
    def solves(self) -> int: ...

    @property
    def iterations(self) -> int: ...

    @property
    def products(self) -> int: ...

    @property
    def factorizations(self) -> int: ...

    @property
    def contacts(self) -> int: ...

    @property
    def joint_rows(self) -> int: ...

    @property
    def substeps(self) -> int: ...

    @property
    def penetration(self) -> float: ...

    @property
    def joint_error(self) -> float: ...

    @property
    def joint_angle_error(self) -> float: ...

    @property
    def worst_joint(self) -> int: ...

    @property
    def joints_close(self) -> bool: ...

    @property
    def kinetic_energy(self) -> float: ...

    @property
    def potential_energy(self) -> float: ...

    @property
    def spring_energy(self) -> float: ...

    @property
    def energy_balance(self) -> float: ...

    @property
    def balanced(self) -> bool: ...

    @property
    def timings(self) -> Timings: ...

    @property
    def method(self) -> str: ...

class Run:
    """Steps that were made one after the other."""

    @property
    def report(self) -> Report: ...

    @property
    def steps(self) -> int: ...

    @property
    def residual(self) -> float: ...

class Simulation:
    """A model and its state; the arrays view the state's memory."""

    def __init__(self, model: Model, options: SimulationOptions) -> None: ...

    def copy(self) -> Simulation: ...

    def assign(self, other: Simulation) -> None: ...

    def reset(self) -> None: ...

    def set_joint_coordinates(self, values: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> None: ...

    def set_time(self, time: float) -> None: ...

    def step(self) -> Report: ...

    def run(self, steps: int, seconds: float) -> Run:
        """
        At most so many steps; ends after one that is not sound, and after so many seconds.
        """

    def snapshot(self) -> State: ...

    def restore(self, state: State) -> None: ...

    def restore_last(self) -> None:
        """The state before the last step."""

    def show_middle(self) -> None:
        """Replaces velocities by those with which the next step begins."""

    def begin_with_shown(self, steady: bool) -> None:
        """
        Begins the next step with the velocities in the state; steady: as after a step with these loads.
        """

    @property
    def time(self) -> float: ...

    @property
    def steps(self) -> int: ...

    @property
    def impulse_step(self) -> float: ...

    @property
    def margin(self) -> float: ...

    @property
    def recovery_speed(self) -> float: ...

    @property
    def restitution_speed(self) -> float: ...

    @property
    def impulses(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]: ...

    def contact_arms(self) -> tuple: ...

    def contact_events(self) -> tuple: ...

    @property
    def problem(self) -> Problem | None:
        """
        The VI of the last step, shared and never changed; None before the first.
        """

    def instant(self) -> tuple[float, Annotated[NDArray[numpy.float64], dict(shape=(None,))]]:
        """
        Time and generalised coordinates to which the forces of the last step belong.
        """

    @property
    def instant_time(self) -> float: ...

    def momentum(self) -> tuple[list[float], list[float]]: ...

    @property
    def positions(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]: ...

    @property
    def orientations(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]: ...

    @property
    def linear_velocities(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]: ...

    @property
    def angular_velocities(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]: ...

    @property
    def forces(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]: ...

    @property
    def torques(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]: ...

    @property
    def joint_coordinates(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]: ...

    @property
    def joint_forces(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]: ...

    @property
    def joint_wrenches(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]: ...

    @property
    def dof_impulses(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]: ...

    @property
    def ball_impulses(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]: ...

    @property
    def coupling_impulses(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]: ...

    @property
    def tendon_impulses(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]: ...

    @property
    def rub_impulses(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]: ...

    @property
    def bond_openings(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]: ...

    @property
    def controls(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]: ...

    @property
    def held_controls(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]: ...

    @property
    def held_joint_forces(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]: ...

    @property
    def activations(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]: ...

    @property
    def actuator_impulses(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]: ...

def contact_rows(simulation: Simulation, links: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.uint8], dict(shape=(None,))]: ...

def reaction_rows(simulation: Simulation) -> Annotated[NDArray[numpy.uint8], dict(shape=(None,))]: ...

def effort_rows(simulation: Simulation) -> Annotated[NDArray[numpy.uint8], dict(shape=(None,))]: ...

def tendon_rows(simulation: Simulation) -> Annotated[NDArray[numpy.uint8], dict(shape=(None,))]: ...

def actuator_rows(simulation: Simulation) -> Annotated[NDArray[numpy.uint8], dict(shape=(None,))]: ...

def moving_rows(simulation: Simulation, bodies: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C', device='cpu', writable=False)], frames: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.uint8], dict(shape=(None,))]: ...

def cast_rays(simulation: Simulation, origins: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], directions: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], excluded: Annotated[NDArray[numpy.uint8], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> tuple:
    """Distances, geoms, normals."""

class Tree:
    """The spanning tree of a model's joints, and what follows from it."""

    def __init__(self, model: Model) -> None: ...

    @property
    def nq(self) -> int: ...

    @property
    def nv(self) -> int: ...

    @property
    def links(self) -> list: ...

    @property
    def loops(self) -> list[int]: ...

    def coordinates(self, simulation: Simulation) -> tuple: ...

    def rates(self, simulation: Simulation) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]: ...

    def set_q(self, simulation: Simulation, q: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], held: Annotated[NDArray[numpy.uint8], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> None: ...

    def set_qd(self, simulation: Simulation, qd: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], held: Annotated[NDArray[numpy.uint8], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> None: ...

    def joint_coordinates(self, simulation: Simulation) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]: ...

    def jacobian(self, simulation: Simulation, body: int, point: Sequence[float]) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]:
        """Of a point in the frame of the body."""

    def jacobians(self, simulation: Simulation, bodies: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C', device='cpu', writable=False)], points: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None, None))]: ...

    def mass_matrix(self, simulation: Simulation) -> Annotated[NDArray[numpy.float64], dict(shape=(None, None))]: ...

    def tendon_jacobian(self, simulation: Simulation, tendon: int) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]: ...

    def inverse_dynamics(self, simulation: Simulation, qdd: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]: ...

    def observe(self, simulation: Simulation, qdd: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], bodies: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C', device='cpu', writable=False)], frames: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)]) -> tuple: ...

    def generalised_forces(self, simulation: Simulation, forces: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], torques: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]: ...

def changed_steps(before: Simulation, changes: Sequence[tuple[str, int, float]], q: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], steady: bool, threads: int) -> tuple:
    """
    States after a step, for each change (of what, entry, by) of the state before it: their rows, the largest residual and why a step failed.
    """

def run_worlds(trees: Sequence[Tree], worlds: Sequence[Simulation], controls: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu', writable=False)] | None, joint_forces: Annotated[NDArray[numpy.float64], dict(shape=(None, None, None), order='C', device='cpu', writable=False)] | None, records: int, repeat: int, threads: int) -> tuple:
    """
    Advances simulations side by side, without the GIL: q, qd, residuals and missed steps by world and record, how many records each world completed, and why it stopped.
    """

class HeldStep:
    """The last step of a simulation with its faces held."""

    def __init__(self, simulation: Simulation) -> None: ...

    def options(self, given: SimulationOptions, reach: float) -> SimulationOptions:
        """Options of simulations that make the step on these faces."""

    def close(self) -> None:
        """Ends the search for faces, which a step has found."""

    @property
    def margin(self) -> float: ...

    @property
    def determines_velocities(self) -> bool: ...

    @property
    def others(self) -> int: ...

    @property
    def residual(self) -> float: ...

class Appearance(enum.Enum):
    moving = 0

    fixed = 1

    clear = 2

    hidden = 3

class PictureCamera:
    def __init__(self) -> None: ...

    @property
    def right(self) -> list[float]: ...

    @right.setter
    def right(self, arg: Sequence[float], /) -> None: ...

    @property
    def up(self) -> list[float]: ...

    @up.setter
    def up(self, arg: Sequence[float], /) -> None: ...

    @property
    def eye(self) -> list[float]: ...

    @eye.setter
    def eye(self, arg: Sequence[float], /) -> None: ...

    @property
    def target(self) -> list[float]: ...

    @target.setter
    def target(self, arg: Sequence[float], /) -> None: ...

    @property
    def distance(self) -> float: ...

    @distance.setter
    def distance(self, arg: float, /) -> None: ...

    @property
    def pixel(self) -> float: ...

    @pixel.setter
    def pixel(self, arg: float, /) -> None: ...

    @property
    def width(self) -> int: ...

    @width.setter
    def width(self, arg: int, /) -> None: ...

    @property
    def height(self) -> int: ...

    @height.setter
    def height(self, arg: int, /) -> None: ...

    @property
    def samples(self) -> int: ...

    @samples.setter
    def samples(self, arg: int, /) -> None: ...

class PictureStyle:
    def __init__(self) -> None: ...

    @property
    def light(self) -> list[float]: ...

    @light.setter
    def light(self, arg: Sequence[float], /) -> None: ...

    @property
    def ambient(self) -> float: ...

    @ambient.setter
    def ambient(self, arg: float, /) -> None: ...

    @property
    def glass(self) -> float: ...

    @glass.setter
    def glass(self, arg: float, /) -> None: ...

    @property
    def fade(self) -> float: ...

    @fade.setter
    def fade(self, arg: float, /) -> None: ...

    @property
    def tile(self) -> float: ...

    @tile.setter
    def tile(self, arg: float, /) -> None: ...

    @property
    def floor(self) -> list[float]: ...

    @floor.setter
    def floor(self, arg: Sequence[float], /) -> None: ...

    @property
    def background(self) -> list[float]: ...

    @background.setter
    def background(self, arg: Sequence[float], /) -> None: ...

class PictureScene:
    """Surfaces, instances of them and planes."""

    def __init__(self) -> None: ...

    def add(self, vertices: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], triangles: Annotated[NDArray[numpy.int32], dict(shape=(None, None), order='C', device='cpu', writable=False)], flat: bool, closed: bool, bodies: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C', device='cpu', writable=False)], positions: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], rotations: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], scales: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], colours: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], opacity: float, appearance: Appearance) -> None:
        """A surface with its n instances."""

    def add_plane(self, body: int, position: Sequence[float], rotation: Sequence[float]) -> None: ...

    def draw(self, positions: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], orientations: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], camera: PictureCamera, style: PictureStyle, lines: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], probe: bool, threads: int) -> tuple:
        """
        Colours, and if probed the label and the depth of each sample; flat arrays.
        """
