"""The passes of a first-order method: what `p-spg-fb` and `apgd` are written over."""

from __future__ import annotations

from typing import Protocol

from numpy.typing import ArrayLike

from .. import _core
from ..checks import Array
from ..errors import InputError
from ..hooks import supplied_by

METHODS = ("auto", "p-spg-fb", "apgd")
"""that take an iterate; "auto" takes one of the other two where it has one"""


class Iterate(Protocol):
    """Vectors of `p-spg-fb` and `apgd` and the passes over them, supplied by the user of `Problem.solve`.

    The methods, their limits, the best iterate, history, deadline and certificate stay those of amontons.
    They see scalars only. So the vectors may be arrays of JAX, PyTorch or CuPy, on any device.

    An iterate knows A, b, K, P and the law of its problem. P is `Problem.P`, one number per row,
    the same within a block (1/kg). Vectors are (m,): x (N s), u = A x + b (m/s), direction d (N s). g is u
    plus the De Saxce term of u: under "coulomb", mu |u_t| on the normal of each contact; under "associated",
    nothing. Pi_K is the projection on K; it is the same in the metric of P. The *squared natural map* is the
    sum over all rows of P (x - Pi_K(x - g / P))^2.

    `p-spg-fb` calls, in every iteration, direction, curvature, update. `apgd` calls start_momentum once after
    start, then momentum_direction, curvature, accelerate; a step that is refused repeats the first two with a
    smaller alpha. refresh (of apgd: refresh_momentum), keep_best, extract_best, extract and objective come in
    between. A method that is never used may be left out.

    Numbers that a pass returns are Python floats or what float() takes. Exceptions of a pass propagate.

    >>> passes = [name for name in dir(vi.Iterate) if not name.startswith("_")]
    >>> "direction" in passes and "curvature" in passes and "update" in passes
    True
    """

    def start(self, x0: Array) -> float:
        """x = Pi_K(x0), x0: (m,); u = A x + b. Returns the squared natural map at x.

        A solve may start again: what an earlier start left is to be forgotten.
        """
        ...

    def refresh(self) -> float:
        """u = A x + b from scratch, without the rounding of updates. Returns the squared natural map at x."""
        ...

    def direction(self, alpha: float) -> tuple[float, float]:
        """d = Pi_K(x - alpha g / P) - x. Returns <d, g> and <d, P d>."""
        ...

    def curvature(self) -> float:
        """<d, A d>: the one product of an iteration."""
        ...

    def update(self, lam: float) -> tuple[float, float, float]:
        """x += lam d and u += lam A d.

        Returns <s, y>, <y, y / P> and the squared natural map at the new x, where s is the change of x and y
        that of g.
        """
        ...

    def start_momentum(self) -> None:
        """y = x, the extrapolated point of the accelerated method."""
        ...

    def momentum_direction(self, alpha: float) -> tuple[float, float]:
        """d = Pi_K(y - alpha g / P) - y with g = A y + b plus the De Saxce term of x; y and x stay.

        Returns <d, P d> and <d, P (y - x)>. P may be any positive diagonal here, the same in every call.
        """
        ...

    def accelerate(self, beta: float) -> float:
        """x+ = y + d, then y = x+ + beta (x+ - x). Returns the squared natural map at x+."""
        ...

    def refresh_momentum(self) -> float:
        """refresh() for x and for y. Returns the squared natural map at x."""
        ...

    def keep_best(self) -> None:
        """The current x becomes the best one. Called in most iterations: keep it without copying."""
        ...

    def extract_best(self) -> ArrayLike:
        """The best x as a NumPy array of float64, (m,), in the order of the problem."""
        ...

    def extract(self) -> ArrayLike:
        """The current x, likewise."""
        ...

    def objective(self) -> float:
        """1/2 x'A x + b'x (J); asked for in every iteration with `history` or a `callback`."""
        ...


def source_of_iterate(iterate: Iterate, method: str, has_moments: bool) -> _core.IterateSource:
    """The source of `iterate` for the compiled module; InputError if it cannot be used."""
    if has_moments:
        raise InputError(
            "iterate: problems with moments (cones of 4 and 6 rows) do not take one; solve without it"
        )
    if method not in METHODS:
        raise InputError(f"method {method!r} has no use for an iterate; those that do are p-spg-fb and apgd")
    missing = [
        name for name in ("start", "extract", "extract_best") if not callable(getattr(iterate, name, None))
    ]
    if missing:
        raise InputError(
            f"iterate is a {type(iterate).__name__} without {missing[0]}(); see amontons.vi.Iterate"
        )
    return _core.IterateSource(type(iterate).__name__, lambda problem, law: iterate, False, 0)


def source_of_device(device: str, least_contacts: int) -> _core.IterateSource | None:
    """The iterates of a device for problems of at least so many contacts, None for "cpu".

    InputError for a device that there is not.
    """
    if isinstance(device, str) and device == "cpu":
        return None
    return source_of_name(device, least_contacts)


@supplied_by("amontons.device.found")
def source_of_name(device: str, least_contacts: int) -> _core.IterateSource:
    """`source_of_device` for all but "cpu"; amontons.device supplies it."""
    raise NotImplementedError
