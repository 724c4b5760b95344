"""The variational inequality as one object, and the functions on it."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Sequence
from os import PathLike
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from .. import _core, step_counts
from ..checks import Array, chosen, frozen, sequence, text, vector
from ..errors import InputError
from ..guidance import former_names
from ..hooks import supplied_by
from . import cones as cones_
from . import iterate as iterate_
from . import matrices, operators, options, units
from .cones import Cone
from .iterate import Iterate
from .solution import Solution, from_core

logger = logging.getLogger(__name__)

Callback = Callable[[_core.IterationRecord], object]


@supplied_by("amontons.io")
def write_file(
    problem: Problem,
    path: str | PathLike[str],
    *,
    solution: Solution | ArrayLike | None,
    storage: str,
    form: str,
) -> None:
    """Function behind `Problem.write`; amontons.io supplies it."""
    raise NotImplementedError


@former_names(saxce="de_saxce")
class Problem:
    """Find x in K with -(A x + b) in the normal cone of K at x; the impulses of one time step.

    A: (m, m) symmetric positive semidefinite, impulses (N s) to velocities (m/s): a SciPy sparse matrix or
        array with both triangles, a dense array, a LinearOperator, `Factored` or `Contacts`.
    b: (m,) velocities of the constraints without impulses (m/s), u = A x + b.
    cones: cone objects in row order (`Bilateral`, `NonNegative`, `Interval`, `Friction`, `EllipticFriction`,
        `RollingFriction`), or one name for all rows: "bilateral", "nonnegative", "friction". Rows of moments
        take N m s in x and rad/s in u.
    mu: friction coefficients, one or one per contact, for friction cones that do not carry theirs.
    name, description, source: free text; notes: what a reader changed or wants to say.
    f: (6 n,) generalised impulse of the free motion when A is `Factored` (b already contains D M^-1 f); kept
        for files in body space, never used by a solve.
    guesses: known approximate x, each (m,).
    law: "coulomb", true Coulomb friction by the correction of De Saxce (1992); or "associated", its convex
        relaxation, in which sliding contacts separate with u_n = mu |u_t|. It is the law by which the problem
        is used to solve and to compute residuals unless another is given; without friction both are the same.

    Raises InputError that names what is wrong: shapes, NaN, an unsymmetric or indefinite matrix (where its
    diagonal shows it), negative mu, cones that do not add up to m rows.

    >>> problem = vi.Problem(np.eye(3), [-1, -2, 0], "friction", mu=0.5)
    >>> solution = problem.solve(tolerance=1e-10)
    >>> problem.residual(solution.x) <= 1e-10
    True
    """

    def __init__(
        self,
        A: Any,
        b: ArrayLike,
        cones: str | Cone | Iterable[Cone],
        *,
        mu: ArrayLike | None = None,
        name: str = "",
        description: str = "",
        source: str = "",
        notes: Sequence[str] = (),
        f: ArrayLike | None = None,
        guesses: Sequence[ArrayLike] = (),
        law: str = "coulomb",
    ) -> None:
        core_law = chosen("law", law, options.LAWS, options.LAW_TERMS)
        self._A = matrices.canonical(A)
        rows = self._A.shape[0]
        right = vector("b", b)
        if len(right) != rows:
            raise InputError(f"b has {len(right)} entries but A has {rows} rows")
        self._cones: tuple[Cone, ...] | None = cones_.normalise(cones, rows, mu)
        self._scale = S = units.scale_of(self._A, self._cones)
        self._b: Array | None = None if S is None else right.copy()
        core_b = right if S is None else S * right
        self._core = _core.Problem(units.scaled(self._A, S), core_b, cones_.to_core(self._cones, S), core_law)
        self.name, self.description, self.source = (
            text(what, value)
            for what, value in (("name", name), ("description", description), ("source", source))
        )
        self.notes = tuple(text(f"notes[{i}]", x) for i, x in enumerate(sequence("notes", notes)))
        self.f = None if f is None else vector("f", f)
        self.guesses = tuple(vector(f"guesses[{i}]", x) for i, x in enumerate(sequence("guesses", guesses)))
        for i, x in enumerate(self.guesses):
            if len(x) != rows:
                raise InputError(f"guesses[{i}] has {len(x)} entries but A has {rows} rows")

    @classmethod
    def _from_core(cls, core: _core.Problem, *, name: str, description: str, source: str) -> Problem:
        """The problem that the core made and keeps: shared, and read back only on request."""
        problem = cls.__new__(cls)
        problem._core, problem._A, problem._cones = core, None, None
        problem._scale = S = problem.A.moment_scale() if core.has_moments else None
        problem._b = None if S is None else core.b / S
        problem.name, problem.description, problem.source = name, description, source
        problem.notes, problem.f, problem.guesses = (), None, ()
        return problem

    @property
    def A(self) -> Any:
        """(m, m) the operator: CSR array, dense array, Factored, Contacts or the linear map given."""
        if self._A is None:
            self._A = operators.from_core(self._core)
        return self._A

    @property
    def b(self) -> Array:
        """(m,) constraint velocities without impulses (m/s)."""
        return frozen(self._core.b if self._b is None else self._b)

    @property
    def cones(self) -> list[Cone]:
        """The sets of K in row order; friction cones carry their coefficients."""
        if self._cones is None:
            self._cones = cones_.from_core(self._core.sets(), self._scale)
        return list(self._cones)

    @property
    def law(self) -> str:
        """The law by which the problem is solved and judged, "coulomb" or "associated": of the step of a
        simulation that of the simulation."""
        return self._core.law.name

    def _law(self, law: str | None) -> _core.Law:
        """The law that was asked for, or else that of the problem."""
        return self._core.law if law is None else chosen("law", law, options.LAWS, options.LAW_TERMS)

    @property
    def mu(self) -> Array:
        """(contacts,) coefficients of sliding in row order; of anisotropic ones that along tangent 1."""
        return cones_.friction_coefficients(self.cones)

    @property
    def rows(self) -> int:
        """m"""
        return self._core.rows

    @property
    def contacts(self) -> int:
        """Number of friction cones."""
        return len(self.mu)

    def _to_core(self, what: str, x: ArrayLike) -> Array:
        """x of the user as the core has it, moments over lengths."""
        values = vector(what, x)
        # A wrong length is the core's to complain about.
        return values if self._scale is None or len(values) != self.rows else values / self._scale

    def _from_units(self, x: Array) -> Array:
        """x of the core as the user has it: moments times lengths."""
        return x if self._scale is None else frozen(x * self._scale)

    def _product(self, x: Array) -> Array:
        """A x"""
        y = self._core.product(self._to_core("x", x))
        return y if self._scale is None else y / self._scale

    def solve(
        self,
        *,
        law: str | None = None,
        method: str = "auto",
        x0: ArrayLike | None = None,
        tolerance: float = 1e-6,
        max_iterations: int | None = None,
        deadline: float | None = None,
        history: bool = False,
        callback: Callback | None = None,
        threads: int | None = None,
        device: str = "cpu",
        iterate: Iterate | None = None,
        **method_options: Any,
    ) -> Solution:
        """Solve the problem under its law, or the given `law`; arguments as in `amontons.vi.solve`.

        iterate: the vectors of "p-spg-fb" and "apgd", an `amontons.vi.Iterate` of this problem; "auto"
        uses one of the two.

        >>> problem = vi.read_problem(examples.path("plates.hdf5"))
        >>> problem.solve(tolerance=1e-8).converged
        True
        """
        method = options.require_method(method)
        opts = options.core_options(
            method,
            law=law,
            tolerance=tolerance,
            max_iterations=max_iterations,
            deadline=deadline,
            history=history,
            threads=threads,
            method_options=method_options,
        )
        opts.iterates = self._iterates(method, device, iterate)
        if callback is not None and not callable(callback):
            raise InputError(f"callback is a {type(callback).__name__}; it must be callable with one record")
        start = None if x0 is None else self._to_core("x0", x0)
        result = _core.solve(self._core, method, opts, start, callback)
        solution = from_core(result, history, self._scale, asked_for=device)
        step_counts.saw(solution.residual, missed=not solution.converged)
        logger.debug(
            "%s: %s after %d iterations of %s, residual %.1e",
            self.name or "problem", solution.status, solution.iterations, solution.method, solution.residual,
        )  # fmt: skip
        return solution

    def _iterates(self, method: str, device: str, iterate: Iterate | None) -> _core.IterateSource | None:
        """Where first-order methods take their iterates from; InputError where that cannot be."""
        if iterate is not None:
            if not isinstance(device, str) or device != "cpu":
                raise InputError("device and iterate exclude each other; leave one of them out")
            return iterate_.source_of_iterate(iterate, method, self._scale is not None)
        source = iterate_.source_of_device(device, 0)
        if source is None or method not in iterate_.METHODS:
            return None
        if not _core.DeviceLayout.fits(self._core):
            raise InputError(
                f"device {device!r}: its passes know bodies (A of Contacts or Factored), circular friction "
                "cones of three rows and single rows; this problem has others, solve it without device"
            )
        return source

    def residual(self, x: ArrayLike, *, law: str | None = None, norm: str = "natural") -> float:
        """The residual of x under the law of the problem, or the `law` given; see `amontons.vi.residual`."""
        return self._core.residual(self._to_core("x", x), self._law(law), chosen("norm", norm, options.NORMS))

    def project(self, x: ArrayLike) -> Array:
        """Pi_K(x), (m,): the nearest point of each cone, in the metric of `P`.

        P is one number per cone but for moments, which count divided by a length: the projection of a cone
        without moments is the Euclidean one.
        """
        return self._from_units(self._core.project(self._to_core("x", x)))

    @property
    def P(self) -> Array:
        """(m,) the preconditioner: the mean of diag(A) over the rows of each cone, at each of its rows.

        A moment has the value of the forces of its cone times the square of the length (m) that divides
        moments. So x - u / P is a step in impulses (N s, N m s), row by row.
        """
        blocks = self._core.preconditioner
        return frozen(blocks if self._scale is None else blocks / self._scale**2)

    def de_saxce(self, u: ArrayLike, *, law: str | None = None) -> Array:
        """(m,) the term of De Saxce (m/s) that makes Coulomb's law of the variational inequality.

        g = u + de_saxce(u) has to be in the dual cone. In the normal row of a contact the term is mu |u_t|.
        With anisotropic and rolling friction it is the support of the set per unit of normal force. It is
        zero in all other rows, and everywhere under `associated`.

        u: (m,) velocities A x + b (m/s, rad/s). law: None for that of the problem.
        """
        values = vector("u", u)
        if self._scale is not None and len(values) == self.rows:
            values = values * self._scale
        return frozen(self._core.de_saxce(values, self._law(law)))

    def natural_map(self, x: ArrayLike, *, law: str | None = None) -> Array:
        """(m,) x - project(x - g / P), g = u + de_saxce(u), u = A x + b: zero exactly at a solution.

        The residual is its norm sqrt(sum(P r^2)) over that at x = 0. Formed without the cancellation that the
        formula has where x is large. law: None for that of the problem.
        """
        return self._from_units(self._core.natural_map(self._to_core("x", x), self._law(law)))

    def write(
        self,
        path: str | PathLike[str],
        *,
        solution: Solution | ArrayLike | None = None,
        storage: str = "csc",
        form: str = "auto",
    ) -> None:
        """Write the problem to a file: FCLIB (.hdf5, .h5), Matrix Market (.mtx and .npz) or NumPy (.npz).

        solution: a Solution or x, (m,), stored with the problem in FCLIB files.
        storage: "csc", "csr" or "triplet", how FCLIB files store matrices.
        form: "global" (M, H, f, w) or "local" (W, q) for FCLIB; "auto" is global for factored operators
        without compliance, else local.
        Raises FileError for what the format cannot hold; no partial file is left behind.
        """
        write_file(self, path, solution=solution, storage=storage, form=form)

    def __repr__(self) -> str:
        title = f" {self.name!r}" if self.name else ""
        cones = ", ".join(map(repr, self.cones)) or "none"
        kind = repr(self.A) if not isinstance(self.A, np.ndarray) else "dense"
        if hasattr(self.A, "nnz"):
            kind = f"sparse, {self.A.nnz} entries"
        return f"amontons.vi.Problem{title}\n  rows:  {self.rows}\n  A:     {kind}\n  cones: {cones}"


class Violations(NamedTuple):
    """Violations in physical terms; all zero at a solution.

    >>> problem = vi.Problem(np.eye(3), [-1, -2, 0], "friction", mu=0.5)
    >>> vi.violations(problem, np.zeros(3)).penetration_velocity
    1.0
    """

    penetration_velocity: float
    """max of -u_n over contacts and unilateral rows, and of |u| over bilateral rows (m/s)"""
    cone: float
    """max distance of x to its cone (N s); moments count divided by the length of their units"""
    complementarity: float
    """max |<x, u>| over blocks, u with the De Saxce term under coulomb (J)"""
    energy: float
    """1/2 e'A e of the step e that the natural map would take (J)"""


def solve(
    A: Any,
    b: ArrayLike,
    cones: str | Cone | Iterable[Cone],
    *,
    mu: ArrayLike | None = None,
    law: str = "coulomb",
    method: str = "auto",
    x0: ArrayLike | None = None,
    tolerance: float = 1e-6,
    max_iterations: int | None = None,
    deadline: float | None = None,
    history: bool = False,
    callback: Callback | None = None,
    threads: int | None = None,
    device: str = "cpu",
    **method_options: Any,
) -> Solution:
    """Solve the variational inequality of A, b and cones: u = A x + b, x in K, -u in the normal cone at x.

    A, b, cones, mu: see `Problem`; build one to solve it more than once.
    law: "coulomb", true Coulomb friction by the correction of De Saxce (1992); or "associated", the convex
        relaxation, in which sliding contacts separate with u_n = mu |u_t|.
    method: "auto" or one of `amontons.vi.methods()`. The result names the method that was used, and why.
    x0: (m,) warm start (N s); used if its residual is at most three times the residual of x = 0.
    tolerance: natural residual to reach, relative to that of x = 0; zero runs to the limits.
    max_iterations: None for the method's own. deadline: wall clock (s), None for none.
    history: record every iteration. callback: called with an IterationRecord per iteration; a true result
        stops the solve. Exceptions of the callback, or of A's product, propagate.
    threads: number of threads, None for one per core where the problem is large enough; the result does not
        depend on it.
    device: where "p-spg-fb" and "apgd" run, by a name of `amontons.devices()`; "gpu" is the first
        GPU. "auto" takes one of the two there; other methods run on the CPU, and `Solution.device` and
        `Solution.reason` say so. Results agree with those of the CPU to rounding.
    method_options: alpha_min, alpha_max, sigma_min, sigma_max, memory, gamma of "p-spg-fb" and
        "p-spg-fb-literal"; omega of "gauss-seidel" and "jacobi".

    Returns a Solution, also without convergence: its status says why, its x is the best iterate. Ctrl-C
    gives status "interrupted". Raises InputError for input that can be corrected.

    >>> vi.solve(np.eye(3), [-1, -2, 0], "friction", mu=0.5).x.round(5)
    array([1. , 0.5, 0. ])
    """
    return Problem(A, b, cones, mu=mu, law=law).solve(
        method=method,
        x0=x0,
        tolerance=tolerance,
        max_iterations=max_iterations,
        deadline=deadline,
        history=history,
        callback=callback,
        threads=threads,
        device=device,
        **method_options,
    )


def residual(problem: Problem, x: ArrayLike, *, law: str | None = None, norm: str = "natural") -> float:
    """The error of x, (m,), by the one measure that every method and report uses; zero at a solution.

    law: "coulomb" or "associated", None for that of the problem.
    norm: "natural": |P^1/2 (x - Pi_K(x - u / P))| over the same at x = 0, with P the mean of diag(A) per cone
        block; "plain": |x - Pi_K(x - u)|_2; "plain_inf": its maximum norm; "siconos": the plain one over
        max(|b|, |x|, |u|). u contains the De Saxce term under coulomb. Moments count over the length (m) that
        makes their diag(A) that of the forces of their cone, spins times it.

    >>> problem = vi.Problem(np.eye(3), [-1, -2, 0], "friction", mu=0.5)
    >>> vi.residual(problem, np.zeros(3))
    1.0
    """
    return problem.residual(x, law=law, norm=norm)


def violations(problem: Problem, x: ArrayLike, *, law: str | None = None) -> Violations:
    """The violations of x, (m,), in physical units. law: None for that of the problem.

    >>> problem = vi.Problem(np.eye(3), [-1, -2, 0], "friction", mu=0.5)
    >>> vi.violations(problem, problem.solve(tolerance=1e-10).x).cone <= 1e-9
    True
    """
    return Violations(*problem._core.violations(problem._to_core("x", x), problem._law(law)))
