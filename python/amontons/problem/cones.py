"""The sets of which K is the product: bilateral, unilateral and bounded rows, and friction cones.

A cone object is a run of equal sets of the core, whose name is `kind` and whose parameters, one array each
with one entry per set, are `parameters`; `moments` tells whether rows after the third are moments.
"""

from __future__ import annotations

import numbers
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from ..checks import Array, frozen, integer, sequence, shown, vector
from ..errors import InputError


def _count(name: str, n: object) -> int:
    if isinstance(n, bool) or not isinstance(n, numbers.Integral) or n < 0:
        raise InputError(f"{name}(n): n = {shown(n)}; give the number of rows as an integer, zero or more")
    return integer(f"{name}(n): n", n, 0)


class Cone:
    """Base of all sets, so that a list of several kinds has a type."""

    kind: ClassVar[str]
    moments: ClassVar[bool] = False

    @property
    def rows(self) -> int:
        """Number of rows of A that the cone covers."""
        raise NotImplementedError

    @property
    def parameters(self) -> tuple[Array, ...]:
        """One array each with one entry per set."""
        return ()


@dataclass(frozen=True)
class _Rows(Cone):
    """n rows of one kind without parameters."""

    n: int = 1

    def __post_init__(self) -> None:
        object.__setattr__(self, "n", _count(type(self).__name__, self.n))

    @property
    def rows(self) -> int:
        """Number of rows of A that the cone covers."""
        return self.n


class Bilateral(_Rows):
    """R^n: n bilateral rows, whose impulse may have either sign and whose velocity must vanish.

    n: number of rows.

    >>> vi.solve([[2.0]], [-4.0], vi.Bilateral()).x
    array([2.])
    """

    kind = "bilateral"


class NonNegative(_Rows):
    """R+^n: n unilateral rows without friction; x >= 0 pushes apart, u >= 0 separates.

    n: number of rows.

    >>> vi.solve([[2.0]], [4.0], vi.NonNegative()).x  # it separates
    array([0.])
    """

    kind = "nonnegative"


@dataclass(frozen=True, eq=False, init=False)
class Interval(Cone):
    """[lo, hi] row by row: motors and joint friction of limited effort.

    lo, hi: bounds of the impulse (N s), scalars or vectors of one length; -inf and inf mean no bound.
    Raises InputError for lo > hi or NaN, naming the row.

    >>> vi.solve([[2.0]], [-4.0], vi.Interval(-1, 1)).x
    array([1.])
    """

    lo: Array
    hi: Array
    kind: ClassVar[str] = "interval"
    moments: ClassVar[bool] = False

    def __init__(self, lo: ArrayLike, hi: ArrayLike) -> None:
        lower, upper = vector("Interval: lo", lo), vector("Interval: hi", hi)
        if len(lower) != len(upper) and 1 not in (len(lower), len(upper)):
            raise InputError(
                f"Interval: lo has {len(lower)} entries and hi {len(upper)}; give one of each per row"
            )
        lower, upper = (np.ascontiguousarray(a) for a in np.broadcast_arrays(lower, upper))
        _core.SetProduct().add("interval", len(lower), [lower, upper])
        object.__setattr__(self, "lo", frozen(lower))
        object.__setattr__(self, "hi", frozen(upper))

    @property
    def n(self) -> int:
        """Number of intervals."""
        return len(self.lo)

    @property
    def rows(self) -> int:
        """Number of rows of A that the cone covers."""
        return len(self.lo)

    @property
    def parameters(self) -> tuple[Array, ...]:
        """lo, hi"""
        return (self.lo, self.hi)

    def __repr__(self) -> str:
        return f"Interval({self.rows} rows)"


@dataclass(frozen=True, eq=False, init=False)
class Friction(Cone):
    """Circular friction cones {(n, t1, t2): |t| <= mu n}, three rows per contact in the order n, t1, t2.

    mu: friction coefficients (dimensionless), finite and not negative; else InputError names the contact.
    n: number of contacts, always by name: Friction(1) is one contact with mu = 1.

    >>> vi.Friction([0.3, 0.5]).n, vi.Friction(0.3, n=100).n
    (2, 100)
    >>> later = vi.Friction(n=100)  # mu comes from the `mu` of `solve` or `Problem`
    >>> vi.solve(np.eye(3), [-1, -2, 0], vi.Friction(0.5)).x.round(5)
    array([1. , 0.5, 0. ])
    """

    n: int
    mu: Array | None
    kind: ClassVar[str] = "friction"
    moments: ClassVar[bool] = False

    def __init__(self, mu: ArrayLike | None = None, *, n: int | None = None) -> None:
        values = None
        if mu is not None:
            values = vector("Friction: mu", mu, " with one entry per contact")
            if n is not None and len(values) == 1:
                values = np.full(_count("Friction", n), values[0])
            _core.SetProduct().add("friction", len(values), [values])
            if n is not None and len(values) != n:
                raise InputError(f"Friction: mu has {len(values)} entries but n = {n}")
        elif n is None:
            raise InputError("Friction needs the coefficients mu or the number of contacts n")
        object.__setattr__(self, "n", _count("Friction", n) if values is None else len(values))
        object.__setattr__(self, "mu", None if values is None else frozen(values))

    @property
    def rows(self) -> int:
        """Number of rows of A that the cone covers, three per contact."""
        return 3 * self.n

    @property
    def parameters(self) -> tuple[Array, ...]:
        """mu, once it is known"""
        return () if self.mu is None else (self.mu,)

    def __repr__(self) -> str:
        if self.mu is None:
            return f"Friction(n={self.n})"
        if self.n == 0 or np.all(self.mu == self.mu[0]):
            return f"Friction({self.mu[0] if self.n else 0.0:g}, n={self.n})"
        return f"Friction(mu in [{self.mu.min():g}, {self.mu.max():g}], n={self.n})"


def _per_contact(
    what: str, n: int | None, columns: dict[str, tuple[ArrayLike, int]]
) -> tuple[int, list[Array]]:
    """The number of contacts and each value, given with its width, as (n,) or (n, 2)."""
    arrays = []
    for name, (values, width) in columns.items():
        try:
            array = np.asarray(values, dtype=np.float64)
        except Exception:  # NumPy asks the object, which may raise anything
            raise InputError(f"{what}: {name} must be numbers") from None
        if array.ndim < 2 and width == 2:
            array = np.stack([array, array], axis=-1)  # the same along both tangents
        array = np.atleast_1d(array) if width == 1 else np.atleast_2d(array)
        if array.ndim != width or (width == 2 and array.shape[1] != 2):
            one = "one number per contact" + (", or two, (n, 2)" if width == 2 else "")
            raise InputError(f"{what}: {name} has shape {np.shape(values)}; give {one}")
        arrays.append(array)
    lengths = {len(array) for array in arrays} - {1}
    count = _count(what, n) if n is not None else lengths.pop() if lengths else 1
    for name, array in zip(columns, arrays, strict=True):
        if len(array) not in (1, count):
            raise InputError(f"{what}: {name} has {len(array)} entries but there are {count} contacts")
    return count, [np.broadcast_to(array, (count, *array.shape[1:])).copy() for array in arrays]


def _spread(name: str, values: Array) -> str:
    low, high = values.min(initial=np.inf), values.max(initial=-np.inf)
    return f"{name}={low:g}" if low == high else f"{name} in [{low:g}, {high:g}]"


@dataclass(frozen=True, eq=False, init=False)
class EllipticFriction(Cone):
    """Elliptic friction cones, anisotropic, with optional torsion and rolling:
    (f_1/mu_1)^2 + (f_2/mu_2)^2 + (m_n/torsion)^2 + (m_1/rolling_1)^2 + (m_2/rolling_2)^2 <= f_n^2.

    Rows per contact: f_n, f_1, f_2 (normal and both tangents); with torsion also the moment about the normal,
    m_n; with rolling also the moments about both tangents, m_1 and m_2: three, four or six.

    mu: coefficients of sliding (dimensionless): one, (n,), or (n, 2) along both tangents. torsion: (m), one
        or (n,). rolling: (m), one, (n,), or (n, 2) about both tangents. n: number of contacts where all are
        single numbers. All finite and not negative, else InputError; zero lets its row carry nothing.

    >>> vi.EllipticFriction([[0.3, 0.6]])  # one contact, mu along tangent 1 and 2
    EllipticFriction(mu in [0.3, 0.6], n=1)
    >>> vi.EllipticFriction(0.5, torsion=0.01, n=100).n  # four rows each
    100
    >>> vi.EllipticFriction([0.3, 0.5], rolling=1e-3).n  # six rows each, without resistance to torsion
    2
    """

    n: int
    mu: Array
    """(n, 2)"""
    torsion: Array | None
    """(n,), m"""
    rolling: Array | None
    """(n, 2), m"""

    def __init__(
        self,
        mu: ArrayLike,
        torsion: ArrayLike | None = None,
        rolling: ArrayLike | None = None,
        *,
        n: int | None = None,
    ) -> None:
        columns: dict[str, tuple[ArrayLike, int]] = {"mu": (mu, 2)}
        if torsion is not None or rolling is not None:
            columns["torsion"] = (0.0 if torsion is None else torsion, 1)
        if rolling is not None:
            columns["rolling"] = (rolling, 2)
        count, arrays = _per_contact("EllipticFriction", n, columns)
        object.__setattr__(self, "n", count)
        for name, array in zip(("mu", "torsion", "rolling"), [*arrays, None, None], strict=False):
            object.__setattr__(self, name, None if array is None else frozen(array))
        _core.SetProduct().add(self.kind, count, list(self.parameters))

    @property
    def block(self) -> int:
        """Rows per contact."""
        return 6 if self.rolling is not None else 4 if self.torsion is not None else 3

    @property
    def rows(self) -> int:
        """Number of rows of A that the cone covers."""
        return self.block * self.n

    @property
    def kind(self) -> str:
        """elliptic-3, elliptic-4 or elliptic-6"""
        return f"elliptic-{self.block}"

    @property
    def moments(self) -> bool:
        """Whether there are moments among the rows."""
        return self.torsion is not None

    @property
    def parameters(self) -> tuple[Array, ...]:
        """One coefficient per row after the normal."""
        parts = [self.mu, self.torsion, self.rolling]
        columns = [np.atleast_2d(part.T) for part in parts if part is not None]
        return tuple(np.ascontiguousarray(column) for column in np.concatenate(columns))

    def __repr__(self) -> str:
        parts = [("mu", self.mu), ("torsion", self.torsion), ("rolling", self.rolling)]
        told = ", ".join(_spread(name, part) for name, part in parts if part is not None and self.n)
        return f"EllipticFriction({told}{', ' if told else ''}n={self.n})"


@dataclass(frozen=True, eq=False, init=False)
class RollingFriction(Cone):
    """Sliding and rolling friction side by side, |f_t| <= mu f_n and |m_t| <= rolling f_n: the set of FCLIB's
    rolling problems, five rows per contact in the order f_n, f_1, f_2, m_1, m_2.

    mu: coefficients of sliding (dimensionless), one or (n,). rolling: of rolling (m), one or (n,). n: number
        of contacts where both are single numbers. Finite and not negative, else InputError.

    >>> vi.RollingFriction(0.5, 0.01)
    RollingFriction(mu=0.5, rolling=0.01, n=1)
    """

    n: int
    mu: Array
    rolling: Array
    kind: ClassVar[str] = "rolling"
    moments: ClassVar[bool] = True

    def __init__(self, mu: ArrayLike, rolling: ArrayLike, *, n: int | None = None) -> None:
        count, arrays = _per_contact("RollingFriction", n, {"mu": (mu, 1), "rolling": (rolling, 1)})
        _core.SetProduct().add("rolling", count, arrays)
        object.__setattr__(self, "n", count)
        object.__setattr__(self, "mu", frozen(arrays[0]))
        object.__setattr__(self, "rolling", frozen(arrays[1]))

    @property
    def rows(self) -> int:
        """Number of rows of A that the cone covers, five per contact."""
        return 5 * self.n

    @property
    def parameters(self) -> tuple[Array, ...]:
        """mu, rolling"""
        return (self.mu, self.rolling)

    def __repr__(self) -> str:
        told = f"{_spread('mu', self.mu)}, {_spread('rolling', self.rolling)}, " if self.n else ""
        return f"RollingFriction({told}n={self.n})"


@dataclass(frozen=True, eq=False, init=False)
class PlanarFriction(Cone):
    """Friction in one direction, {(n, t): |t| <= mu n}, two rows each in the order n, t.

    It is that of a journal in its bearing, or of a rope on a pulley. Then n is half the sum and t half the
    difference of both tensions, and mu = tanh(friction angle / 2).

    mu: coefficients (dimensionless), one or (n,). n: number of places where mu is one number. Finite and not
        negative, else InputError.

    >>> vi.solve(np.eye(2), [-1, -2], vi.PlanarFriction(0.5)).x.round(5)
    array([1. , 0.5])
    """

    n: int
    mu: Array
    kind: ClassVar[str] = "planar"
    moments: ClassVar[bool] = False

    def __init__(self, mu: ArrayLike, *, n: int | None = None) -> None:
        count, arrays = _per_contact("PlanarFriction", n, {"mu": (mu, 1)})
        _core.SetProduct().add("planar", count, arrays)
        object.__setattr__(self, "n", count)
        object.__setattr__(self, "mu", frozen(arrays[0]))

    @property
    def rows(self) -> int:
        """Number of rows of A that the cone covers, two each."""
        return 2 * self.n

    @property
    def parameters(self) -> tuple[Array, ...]:
        """mu"""
        return (self.mu,)

    def __repr__(self) -> str:
        told = f"{_spread('mu', self.mu)}, " if self.n else ""
        return f"PlanarFriction({told}n={self.n})"


FRICTIONAL = (Friction, EllipticFriction, RollingFriction, PlanarFriction)
_BY_NAME = {"bilateral": Bilateral, "nonnegative": NonNegative, "friction": Friction}


def normalise(cones: str | Cone | Iterable[Cone], rows: int, mu: ArrayLike | None = None) -> tuple[Cone, ...]:
    """The cones as a tuple whose friction cones all carry their coefficients.

    cones: cone objects in row order, one of them, or "bilateral", "nonnegative" or "friction" for all rows.
    rows: number of rows of A. mu: one coefficient, or one per contact, for friction cones without their own.
    """
    if isinstance(cones, str):
        if cones not in _BY_NAME:
            known = ", ".join(repr(name) for name in _BY_NAME)
            raise InputError(
                f"cones = {shown(cones)}; a name must be one of {known}, or give a list of cone objects"
            )
        if cones == "friction" and rows % 3:
            raise InputError(f"cones = 'friction': A has {rows} rows, which is no multiple of three")
        cones = (_BY_NAME[cones](n=rows // 3 if cones == "friction" else rows),)
    elif isinstance(cones, Cone):
        cones = (cones,)
    try:
        listed = sequence("cones", cones)
    except InputError:
        raise InputError(
            f"cones is a {type(cones).__name__}; give a list of cone objects or a name"
        ) from None
    for i, cone in enumerate(listed):
        if not isinstance(cone, Cone):
            raise InputError(
                f"cones[{i}] is a {type(cone).__name__}; it must be Bilateral, NonNegative, Interval, "
                "Friction, EllipticFriction, RollingFriction or PlanarFriction"
            )
    total = sum(cone.rows for cone in listed)
    if total != rows:
        raise InputError(
            f"the cones have {total} rows in all but A has {rows} (a friction cone takes three rows, "
            "EllipticFriction three, four or six, RollingFriction five, PlanarFriction two)"
        )
    return _with_friction(listed, mu)


def _with_friction(cones: Sequence[Cone], mu: ArrayLike | None) -> tuple[Cone, ...]:
    friction = [cone for cone in cones if isinstance(cone, Friction)]
    if mu is None:
        if any(cone.mu is None for cone in friction):
            raise InputError("no friction coefficient: give mu=, or Friction(mu) with its own")
        return tuple(cones)
    if not friction:
        raise InputError("mu is given but no cone is a friction cone; drop mu or give cones='friction'")
    if any(cone.mu is not None for cone in friction):
        raise InputError("mu is given twice: in a Friction cone and as mu=; keep one of them")
    contacts = sum(cone.n for cone in friction)
    values = vector("mu", mu, " with one entry per contact")
    if len(values) == 1:
        values = np.full(contacts, values[0])
    if len(values) != contacts:
        raise InputError(
            f"mu has {len(values)} entries but there are {contacts} contacts; give one per contact"
        )
    _core.SetProduct().add("friction", len(values), [values])
    filled: list[Cone] = []
    used = 0
    for cone in cones:
        if isinstance(cone, Friction):
            filled.append(Friction(values[used : used + cone.n]))
            used += cone.n
        else:
            filled.append(cone)
    return tuple(filled)


def friction_coefficients(cones: Iterable[Cone]) -> Array:
    """The coefficients of sliding of all contacts in row order, of anisotropic ones that along tangent 1."""
    parts = [cone.parameters[0] for cone in cones if isinstance(cone, FRICTIONAL)]
    return np.concatenate(parts) if parts else np.empty(0)


def _lengths(cone: Cone, row: int, scale: Array | None) -> Array | float:
    """The length of the moments of each contact of a cone that starts at a row."""
    if scale is None or not cone.moments or cone.n == 0:
        return 1.0
    return scale[row + 3 : row + cone.rows : cone.rows // cone.n]


def _of_moments(cone: Cone, k: int) -> bool:
    """Whether parameter k is in metres."""
    return cone.moments and k >= (1 if isinstance(cone, RollingFriction) else 2)


def to_core(cones: Iterable[Cone], scale: Array | None = None) -> _core.SetProduct:
    """The product of the cones; scale: of the rows, see amontons.problem.units."""
    product, row = _core.SetProduct(), 0
    for cone in cones:
        length = _lengths(cone, row, scale)
        columns = [p / length if _of_moments(cone, k) else p for k, p in enumerate(cone.parameters)]
        product.add(cone.kind, cone.n, columns)
        row += cone.rows
    return product


def _made(kind: str, count: int, parameters: Sequence[Any]) -> Cone:
    match kind:
        case "bilateral":
            return Bilateral(count)
        case "nonnegative":
            return NonNegative(count)
        case "interval":
            return Interval(*parameters)
        case "friction":
            return Friction(*parameters)
        case "planar":
            return PlanarFriction(*parameters)
        case "rolling":
            return RollingFriction(*parameters)
        case _:
            torsion = parameters[2] if len(parameters) > 2 else None
            rolling = np.stack(parameters[3:], axis=1) if len(parameters) > 3 else None
            return EllipticFriction(np.stack(parameters[:2], axis=1), torsion, rolling)


def from_core(sets: Iterable[tuple[Any, ...]], scale: Array | None = None) -> tuple[Cone, ...]:
    """The cones of (name, count, parameters ...), as a problem of the core lists them."""
    made: list[Cone] = []
    row = 0
    for kind, count, *parameters in sets:
        cone = _made(kind, count, parameters)
        if cone.moments and scale is not None:
            length = _lengths(cone, row, scale)
            in_metres = [p * length if _of_moments(cone, k) else p for k, p in enumerate(parameters)]
            cone = _made(kind, count, in_metres)
        made.append(cone)
        row += cone.rows
    return tuple(made)
