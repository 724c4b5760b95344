"""
The C++ core of amontons. Use the package `amontons`, which checks and documents its arguments.
"""

from collections.abc import Callable
import enum
from typing import Annotated

import numpy
from numpy.typing import NDArray


class InputError(ValueError):
    pass

class ConeProduct:
    """A product of small sets, in the order in which they are added."""

    def __init__(self) -> None: ...

    def add_free(self, count: int) -> None: ...

    def add_nonnegative(self, count: int) -> None: ...

    def add_interval(self, lo: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], hi: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> None: ...

    def add_friction(self, mu: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> None: ...

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
    """A symmetric positive semidefinite map, one of five kinds."""

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

def contact_operator(inverse_mass: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], inverse_inertia: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], body_a: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C', device='cpu', writable=False)], body_b: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C', device='cpu', writable=False)], r_a: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], r_b: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], normal: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], compliance: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], joint_body_a: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C', device='cpu', writable=False)], joint_body_b: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C', device='cpu', writable=False)], joint_jacobian_a: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], joint_jacobian_b: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], joint_compliance: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> Operator: ...

def asymmetry(indptr: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C', device='cpu', writable=False)], indices: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C', device='cpu', writable=False)], data: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> tuple[float, int, int, float]: ...

def contact_tangents(normals: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]:
    """Both tangents of every normal, six numbers each."""

class Law(enum.Enum):
    associated = 0

    coulomb = 1

class Norm(enum.Enum):
    natural = 0

    plain = 1

    plain_inf = 2

    siconos = 3

class Problem:
    """A x + b over a product of sets; checked when it is made."""

    def __init__(self, A: Operator, b: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], cones: ConeProduct) -> None:
        """Takes over the operator A."""

    @property
    def rows(self) -> int: ...

    @property
    def preconditioner(self) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]:
        """Mean of diag(A) per cone block."""

    def product(self, x: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)]) -> Annotated[NDArray[numpy.float64], dict(shape=(None,))]:
        """A x."""

    def residual(self, x: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], law: Law, norm: Norm) -> float: ...

    def violations(self, x: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)], law: Law) -> tuple:
        """(penetration velocity, cone, complementarity, energy)."""

class Options:
    """Options of a solve; x0 and callback are arguments of solve()."""

    def __init__(self) -> None: ...

    @property
    def law(self) -> Law: ...

    @law.setter
    def law(self, arg: Law, /) -> None: ...

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

    @property
    def admm_rho(self) -> float: ...

    @admm_rho.setter
    def admm_rho(self, arg: float, /) -> None: ...

class IterationRecord:
    """What a callback gets to see of an iteration."""

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
    def factorizations(self) -> int: ...

    @property
    def time(self) -> float: ...

    @property
    def method(self) -> str: ...

    @property
    def reason(self) -> str: ...

    @property
    def history(self) -> Annotated[NDArray[numpy.uint8], dict(shape=(None,))]: ...

def solve(problem: Problem, method: str, options: Options, x0: Annotated[NDArray[numpy.float64], dict(shape=(None,), order='C', device='cpu', writable=False)] | None = None, callback: object | None = None) -> Result: ...

def method_names() -> list[str]: ...
