"""The sets of which K is the product: free, unilateral and bounded rows, and friction cones."""

from __future__ import annotations

import numbers
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from ..checks import Array, frozen, vector
from ..errors import InputError


def _count(name: str, n: object) -> int:
    if isinstance(n, bool) or not isinstance(n, numbers.Integral) or n < 0:
        raise InputError(f"{name}(n): n = {n!r}; give the number of rows as an integer, zero or more")
    return int(n)


@dataclass(frozen=True)
class Free:
    """R^n: n bilateral rows, whose impulse may have either sign and whose velocity must vanish.

    n: number of rows.
    """

    n: int = 1

    def __post_init__(self) -> None:
        object.__setattr__(self, "n", _count("Free", self.n))

    @property
    def rows(self) -> int:
        """Number of rows of A that the cone covers."""
        return self.n


@dataclass(frozen=True)
class NonNegative:
    """R+^n: n unilateral rows without friction; x >= 0 pushes apart, u >= 0 separates.

    n: number of rows.
    """

    n: int = 1

    def __post_init__(self) -> None:
        object.__setattr__(self, "n", _count("NonNegative", self.n))

    @property
    def rows(self) -> int:
        """Number of rows of A that the cone covers."""
        return self.n


@dataclass(frozen=True, eq=False, init=False)
class Interval:
    """[lo, hi] row by row: motors and joint friction of limited effort.

    lo, hi: bounds of the impulse (N s), scalars or vectors of one length; -inf and inf mean no bound.
    Raises InputError for lo > hi or NaN, naming the row.
    """

    lo: Array
    hi: Array

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
    def rows(self) -> int:
        """Number of rows of A that the cone covers."""
        return len(self.lo)

    def __repr__(self) -> str:
        return f"Interval({self.rows} rows)"


@dataclass(frozen=True, eq=False, init=False)
class Friction:
    """Circular friction cones {(n, t1, t2): |t| <= mu n}, three rows per contact in the order n, t1, t2.

    Friction(0.3)          one contact with mu = 0.3
    Friction([0.3, 0.5])   two contacts
    Friction(0.3, n=100)   a hundred contacts with the same mu
    Friction(100)          an integer counts contacts; their mu comes from the `mu` of `solve` or `Problem`

    mu: friction coefficients (dimensionless), finite and not negative; else InputError names the contact.
    """

    n: int
    mu: Array | None

    def __init__(self, mu: ArrayLike | None = None, *, n: int | None = None) -> None:
        if isinstance(mu, numbers.Integral) and not isinstance(mu, bool) and n is None:
            mu, n = None, int(mu)
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

    def __repr__(self) -> str:
        if self.mu is None:
            return f"Friction(n={self.n})"
        if self.n == 0 or np.all(self.mu == self.mu[0]):
            return f"Friction({self.mu[0] if self.n else 0.0:g}, n={self.n})"
        return f"Friction(mu in [{self.mu.min():g}, {self.mu.max():g}], n={self.n})"


Cone = Free | NonNegative | Interval | Friction
_BY_NAME = {"free": Free, "nonnegative": NonNegative, "friction": Friction}


def normalise(cones: str | Cone | Iterable[Cone], rows: int, mu: ArrayLike | None = None) -> tuple[Cone, ...]:
    """The cones as a tuple whose friction cones all carry their coefficients.

    cones: cone objects in row order, one of them, or "free", "nonnegative" or "friction" for all rows.
    rows: number of rows of A. mu: one coefficient, or one per contact, for friction cones without their own.
    """
    if isinstance(cones, str):
        if cones not in _BY_NAME:
            known = ", ".join(repr(name) for name in _BY_NAME)
            raise InputError(
                f"cones = {cones!r}; a name must be one of {known}, or give a list of cone objects"
            )
        if cones == "friction" and rows % 3:
            raise InputError(f"cones = 'friction': A has {rows} rows, which is no multiple of three")
        cones = (_BY_NAME[cones](n=rows // 3 if cones == "friction" else rows),)
    elif isinstance(cones, Cone):
        cones = (cones,)
    try:
        listed = tuple(cones)
    except TypeError:
        raise InputError(
            f"cones is a {type(cones).__name__}; give a list of cone objects or a name"
        ) from None
    for i, cone in enumerate(listed):
        if not isinstance(cone, Cone):
            raise InputError(
                f"cones[{i}] is a {type(cone).__name__}; it must be Free, NonNegative, Interval or Friction"
            )
    total = sum(cone.rows for cone in listed)
    if total != rows:
        raise InputError(
            f"the cones have {total} rows in all but A has {rows} (a friction cone takes three rows)"
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
    """The coefficients of all contacts in row order."""
    parts = [cone.mu for cone in cones if isinstance(cone, Friction) and cone.mu is not None]
    return np.concatenate(parts) if parts else np.empty(0)


def to_core(cones: Iterable[Cone]) -> _core.SetProduct:
    product = _core.SetProduct()
    for cone in cones:
        match cone:
            case Free(n=n):
                product.add("free", n, [])
            case NonNegative(n=n):
                product.add("nonnegative", n, [])
            case Interval(lo=lo, hi=hi):
                product.add("interval", len(lo), [lo, hi])
            case Friction(mu=mu) if mu is not None:
                product.add("friction", len(mu), [mu])
    return product


def from_core(sets: Iterable[tuple[Any, ...]]) -> tuple[Cone, ...]:
    """The cones of (name, count, parameters ...), as a problem of the core lists them."""
    made: list[Cone] = []
    for kind, count, *parameters in sets:
        match kind:
            case "free":
                made.append(Free(count))
            case "nonnegative":
                made.append(NonNegative(count))
            case "interval":
                made.append(Interval(*parameters))
            case _:
                made.append(Friction(*parameters))
    return tuple(made)
