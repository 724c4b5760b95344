"""Operators A = D M^-1 D' + E that stay factored: bodies, and the rows or contacts between them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .. import _core
from ..checks import Array, array, finite, matrix, reals, vector
from ..errors import InputError

if TYPE_CHECKING:
    import scipy.sparse as sp

Indices = NDArray[np.int32]


def _bodies(name: str, values: ArrayLike, bodies: int) -> Indices:
    given = array(name, values)
    if given.size == 0:
        return np.empty(0, dtype=np.int32)
    if given.ndim != 1 or given.dtype.kind not in "iu":
        raise InputError(f"{name} must be a vector of integers: the body of each row, -1 for the world")
    wrong = np.flatnonzero((given < -1) | (given >= bodies))
    if wrong.size:
        i = wrong[0]
        raise InputError(
            f"{name}[{i}] = {given[i]}: that body does not exist (there are {bodies}; -1 is the world)"
        )
    return np.ascontiguousarray(given, dtype=np.int32)


def _require_two_bodies(what: str, body_a: Indices, body_b: Indices) -> None:
    if len(body_a) != len(body_b):
        raise InputError(f"{what}: body_a has {len(body_a)} entries and body_b {len(body_b)}")
    same = np.flatnonzero((body_a == body_b) & (body_a >= 0))
    if same.size:
        raise InputError(
            f"{what} {same[0]} joins body {body_a[same[0]]} to itself; it needs two bodies or one"
        )


def _nonnegative(name: str, values: ArrayLike | None, count: int) -> Array:
    if values is None:
        return np.zeros(count)
    array = vector(name, values)
    if len(array) == 1:
        array = np.full(count, array[0])
    if len(array) != count:
        raise InputError(f"{name} has {len(array)} entries; it must have {count}")
    wrong = np.flatnonzero(~(array >= 0) | ~np.isfinite(array))
    if wrong.size:
        raise InputError(f"{name}[{wrong[0]}] = {array[wrong[0]]:g}; it must be finite and not negative")
    return array


def _positive_lengths(values: ArrayLike, contacts: int) -> Array:
    lengths = _nonnegative("moment_length", values, contacts)
    if not np.all(lengths > 0):
        raise InputError("moment_length must be positive")
    return lengths


def _row_counts(values: ArrayLike, contacts: int) -> Indices:
    counts = array("rows", values)
    counts = np.broadcast_to(counts, (contacts,)) if counts.ndim == 0 else counts
    if (
        counts.shape != (contacts,)
        or counts.dtype.kind not in "iu"
        or not np.isin(counts, (3, 4, 5, 6)).all()
    ):
        raise InputError("rows: give 3, 4, 5 or 6 for every contact")
    return np.ascontiguousarray(counts, dtype=np.int32)


def _inverse_inertia(values: ArrayLike, bodies: int) -> Array:
    """(n, 3, 3) or principal moments (n, 3) as (n, 6) in the order xx, yy, zz, xy, xz, yz."""
    given = reals("inverse_inertia", values)
    if given.size == 0 and bodies == 0:
        return np.empty((0, 6))
    if given.shape not in ((bodies, 3, 3), (bodies, 3)):
        raise InputError(
            f"inverse_inertia has shape {given.shape}; it must be ({bodies}, 3, 3), "
            f"or ({bodies}, 3) if diagonal"
        )
    finite("inverse_inertia", given)
    if given.ndim == 2:
        return np.hstack([given, np.zeros((bodies, 3))])
    scale = np.abs(given).max(axis=(1, 2), initial=0.0)
    skew = np.abs(given - given.transpose(0, 2, 1)).max(axis=(1, 2), initial=0.0)
    wrong = np.flatnonzero(skew > _core.ASYMMETRY * scale)
    if wrong.size:
        raise InputError(f"inverse_inertia[{wrong[0]}] is not symmetric; symmetrise it")
    wrong = np.flatnonzero(np.linalg.eigvalsh(given)[:, 0] < -1e-10 * scale)
    if wrong.size:
        raise InputError(f"inverse_inertia[{wrong[0]}] is not positive semidefinite")
    rows, columns = [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]
    return np.ascontiguousarray(given[:, rows, columns])


def balanced_length(forces: Array, moments: Array) -> Array:
    """The length (m) that brings moments with this mean of diag(A) to that of the forces; 1 where either has
    none."""
    with np.errstate(divide="ignore", invalid="ignore"):
        length = np.sqrt(forces / moments)
    return np.where(np.isfinite(length) & (length > 0), length, 1.0)


class _BodyBased(ABC):
    """Base of Factored and Contacts: the bodies, and the behaviour of a linear operator."""

    inverse_mass: Array
    """(n,) 1/m of each body (1/kg)"""
    inverse_inertia: Array
    """(n, 6) inverse inertia about the centre of mass (1/(kg m^2)): xx, yy, zz, xy, xz, yz"""
    _core_operator: _core.Operator | None = None

    def __init__(self, inverse_mass: ArrayLike, inverse_inertia: ArrayLike) -> None:
        masses = vector("inverse_mass", inverse_mass)
        self.inverse_mass = _nonnegative("inverse_mass", masses, len(masses))
        self.inverse_inertia = _inverse_inertia(inverse_inertia, len(masses))

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, NDArray[Any]]) -> Self:
        """The operator of arrays that the core made, by their names; they are not checked again."""
        made = cls.__new__(cls)
        vars(made).update(arrays)
        return made

    @abstractmethod
    def to_core(self) -> _core.Operator:
        """A new operator of the compiled module with copies of the arrays."""

    @property
    def bodies(self) -> int:
        """Number of bodies n."""
        return len(self.inverse_mass)

    @property
    @abstractmethod
    def shape(self) -> tuple[int, int]:
        """(m, m), m the number of rows."""

    @property
    def dtype(self) -> np.dtype[np.float64]:
        return np.dtype(np.float64)

    def _operator(self) -> _core.Operator:
        if self._core_operator is None:
            self._core_operator = self.to_core()
        return self._core_operator

    def matvec(self, x: ArrayLike) -> Array:
        """A x: constraint velocities (m/s), (m,), of the impulses x (N s), (m,)."""
        x, S = vector("x", x), self.moment_scale()
        if S is None or len(x) != len(S):
            return self._operator().product(x)
        return self._operator().product(x / S) / S

    def __matmul__(self, x: ArrayLike) -> Array:
        return self.matvec(x)

    def diagonal(self) -> Array:
        """diag(A), (m,)."""
        diagonal, S = self._operator().diagonal(), self.moment_scale()
        return diagonal if S is None else diagonal / S**2

    def moment_scale(self) -> Array | None:
        """By what the core divides x and multiplies u: see amontons.problem.units; None for nothing."""
        return None

    def inverse_mass_matrix(self) -> sp.csr_array:
        """M^-1, (6 n, 6 n), in blocks of (linear, angular) per body."""
        xx, yy, zz, xy, xz, yz = self.inverse_inertia.T
        blocks = np.zeros((self.bodies, 6, 6))
        blocks[:, [0, 1, 2], [0, 1, 2]] = self.inverse_mass[:, None]
        blocks[:, 3, 3], blocks[:, 4, 4], blocks[:, 5, 5] = xx, yy, zz
        blocks[:, 3, 4] = blocks[:, 4, 3] = xy
        blocks[:, 3, 5] = blocks[:, 5, 3] = xz
        blocks[:, 4, 5] = blocks[:, 5, 4] = yz
        return block_diagonal(blocks)


def block_diagonal(blocks: Array) -> sp.csr_array:
    """The sparse matrix with the given (n, k, k) diagonal blocks, without their zeros."""
    import scipy.sparse as sp

    n, k = len(blocks), blocks.shape[1]
    matrix = sp.bsr_array((blocks, np.arange(n), np.arange(n + 1)), shape=(k * n, k * n)).tocsr()
    matrix.eliminate_zeros()
    return matrix


class Factored(_BodyBased):
    """A = D M^-1 D' + diag(E) of constraint rows between at most two bodies each; A itself is never formed.

    Row i of D is `jacobian_a[i]` on the velocity of body `body_a[i]` and `jacobian_b[i]` on that of
    `body_b[i]`; velocities are (linear, angular), in whatever frame the inverse inertia is given in. The
    three rows of a friction cone are normal, tangent 1, tangent 2 and share their bodies in the same order.

    inverse_mass: (n,) 1/m (1/kg), zero for a fixed body. inverse_inertia: (n, 3, 3) symmetric, or its
    diagonal (n, 3) (1/(kg m^2)). body_a, body_b: (m,) integers, -1 for the world. jacobian_a, jacobian_b:
    (m, 6). compliance: E, (m,) or one for all, not negative, the compliance divided by the squared time step.

    Raises InputError that names the array and the index. Wrong numbers of rows, bodies that do not exist, a
    row that joins a body to itself, NaN and negative masses are refused.

    >>> rows = [(0, 0, 1, 0, 0, 0)]  # the vertical velocity of a body of 2 kg
    >>> A = vi.Factored([0.5], [np.eye(3)], [0], [-1], rows, np.zeros((1, 6)))
    >>> vi.solve(A, [-3], vi.NonNegative()).x  # stops it
    array([6.])
    """

    def __init__(
        self,
        inverse_mass: ArrayLike,
        inverse_inertia: ArrayLike,
        body_a: ArrayLike,
        body_b: ArrayLike,
        jacobian_a: ArrayLike,
        jacobian_b: ArrayLike,
        compliance: ArrayLike | None = None,
    ) -> None:
        super().__init__(inverse_mass, inverse_inertia)
        self.body_a = _bodies("body_a", body_a, self.bodies)
        self.body_b = _bodies("body_b", body_b, self.bodies)
        _require_two_bodies("row", self.body_a, self.body_b)
        m = len(self.body_a)
        self.jacobian_a = matrix("jacobian_a", jacobian_a, m, 6)
        self.jacobian_b = matrix("jacobian_b", jacobian_b, m, 6)
        self.compliance = _nonnegative("compliance", compliance, m)

    @property
    def shape(self) -> tuple[int, int]:
        """Shape (m, m), m the number of rows."""
        return (len(self.body_a), len(self.body_a))

    def to_core(self) -> _core.Operator:
        """A new operator of the compiled module with copies of the arrays."""
        return _core.body_operator(
            self.inverse_mass,
            self.inverse_inertia,
            self.body_a,
            self.body_b,
            self.jacobian_a,
            self.jacobian_b,
            self.compliance,
        )

    def jacobian(self) -> sp.csr_array:
        """D, (m, 6 n)."""
        import scipy.sparse as sp

        m = self.shape[0]
        rows, columns, values = [], [], []
        for body, jacobian in ((self.body_a, self.jacobian_a), (self.body_b, self.jacobian_b)):
            present = np.flatnonzero(body >= 0)
            rows.append(np.repeat(present, 6))
            columns.append((6 * body[present].astype(np.int64)[:, None] + np.arange(6)).ravel())
            values.append(jacobian[present].ravel())
        entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
        matrix = sp.csr_array(entries, shape=(m, 6 * self.bodies))
        matrix.eliminate_zeros()
        return matrix

    def to_sparse(self) -> sp.csr_array:
        """A as a sparse matrix, (m, m)."""
        import scipy.sparse as sp

        jacobian = self.jacobian()
        matrix = sp.csr_array(jacobian @ self.inverse_mass_matrix() @ jacobian.T)
        if self.compliance.any():
            matrix = sp.csr_array(matrix + sp.diags_array(self.compliance))
        return matrix

    def __repr__(self) -> str:
        return f"Factored({self.bodies} bodies, {self.shape[0]} rows)"


class Contacts(_BodyBased):
    """A of frictional contacts in world coordinates, then joint rows; no Jacobian of contacts is stored.

    Contact c pushes body `body_a[c]` along `normal[c]` (from body b to body a) at `r_a[c]` from its centre
    of mass, and body `body_b[c]` the opposite way at `r_b[c]`. Its rows are normal, tangent 1, tangent 2 (see
    `tangents`) and, if it has more than three, moments: about the normal (4), about both tangents (5), about
    all three (6). Inverse inertias are in world coordinates here.

    inverse_mass: (n,) (1/kg). inverse_inertia: (n, 3, 3) or (n, 3) (1/(kg m^2)). body_a, body_b: (c,)
    integers, -1 for the world. r_a, r_b: (c, 3) (m). normal: (c, 3) of unit length. compliance: (c,) or one,
    the same for all rows of a contact. direction: (c, 3) along which the first tangent lies; zeros where it
    follows from the normal alone. rows: (c,) or one, 3, 4, 5 or 6. moment_length: (c,) or one (m), by which
    solvers divide moments, and multiply spins, to have impulses and velocities like the others; None for the
    length that makes their diag(A) alike. It changes no result but the meaning of a compliance, which holds
    for moments over the length. joint_*: the rows that follow the contacts, as in `Factored`.

    Moments of x are in N m s, spins of u in rad/s.

    Raises InputError that names the array and the index.

    >>> # A body of 1 kg on the ground, 1 m above the contact.
    >>> A = vi.Contacts([1.0], [np.eye(3)], [0], [-1], [(0, 0, -1)], [(0, 0, 0)], [(0, 0, 1)])
    >>> vi.solve(A, [-1, 0, 0], "friction", mu=0.5).x.round(5)
    array([1., 0., 0.])
    """

    def __init__(
        self,
        inverse_mass: ArrayLike,
        inverse_inertia: ArrayLike,
        body_a: ArrayLike,
        body_b: ArrayLike,
        r_a: ArrayLike,
        r_b: ArrayLike,
        normal: ArrayLike,
        compliance: ArrayLike | None = None,
        *,
        direction: ArrayLike | None = None,
        rows: ArrayLike = 3,
        moment_length: ArrayLike | None = None,
        joint_body_a: ArrayLike = (),
        joint_body_b: ArrayLike = (),
        joint_jacobian_a: ArrayLike = (),
        joint_jacobian_b: ArrayLike = (),
        joint_compliance: ArrayLike | None = None,
    ) -> None:
        super().__init__(inverse_mass, inverse_inertia)
        self.body_a = _bodies("body_a", body_a, self.bodies)
        self.body_b = _bodies("body_b", body_b, self.bodies)
        _require_two_bodies("contact", self.body_a, self.body_b)
        c = len(self.body_a)
        both_world = np.flatnonzero((self.body_a < 0) & (self.body_b < 0))
        if both_world.size:
            raise InputError(f"contact {both_world[0]} is between the world and itself; it needs a body")
        self.r_a = matrix("r_a", r_a, c, 3)
        self.r_b = matrix("r_b", r_b, c, 3)
        self.normal = matrix("normal", normal, c, 3)
        length = np.linalg.norm(self.normal, axis=1)
        wrong = np.flatnonzero(np.abs(length - 1) > 1e-6)
        if wrong.size:
            i = wrong[0]
            raise InputError(f"normal[{i}] has length {length[i]:g}; it must be a unit vector, normalise it")
        self.direction = np.zeros((c, 3)) if direction is None else matrix("direction", direction, c, 3)
        self.rows = _row_counts(rows, c)
        self.moment_length = np.ones(c) if moment_length is None else _positive_lengths(moment_length, c)
        self.compliance = _nonnegative("compliance", compliance, c)
        self.joint_body_a = _bodies("joint_body_a", joint_body_a, self.bodies)
        self.joint_body_b = _bodies("joint_body_b", joint_body_b, self.bodies)
        _require_two_bodies("joint row", self.joint_body_a, self.joint_body_b)
        m = len(self.joint_body_a)
        self.joint_jacobian_a = matrix("joint_jacobian_a", joint_jacobian_a, m, 6)
        self.joint_jacobian_b = matrix("joint_jacobian_b", joint_jacobian_b, m, 6)
        self.joint_compliance = _nonnegative("joint_compliance", joint_compliance, m)
        if moment_length is None and np.any(self.rows > 3):
            self.moment_length = self._balanced_lengths()

    def _moment_rows(self) -> tuple[NDArray[Any], NDArray[Any]]:
        """For every row of a contact: the contact, and whether the row is a moment."""
        contact = np.repeat(np.arange(len(self.rows)), self.rows)
        place = np.arange(len(contact)) - (np.cumsum(self.rows) - self.rows)[contact]
        return contact, place >= 3

    def _balanced_lengths(self) -> Array:
        c = len(self.rows)
        rigid = Contacts.from_arrays({**vars(self), "compliance": np.zeros(c)})
        contact, moment = self._moment_rows()
        diagonal = rigid.diagonal()[: len(contact)]
        forces = np.bincount(contact, np.where(moment, 0, diagonal), c) / 3
        moments = np.bincount(contact, np.where(moment, diagonal, 0), c) / np.maximum(self.rows - 3, 1)
        return balanced_length(forces, moments)

    def moment_scale(self) -> Array | None:
        """(m,) the length of the contact for its moments and 1 for all other rows; None without moments."""
        if not np.any(self.rows > 3):
            return None
        contact, moment = self._moment_rows()
        return np.append(np.where(moment, self.moment_length[contact], 1.0), np.ones(len(self.joint_body_a)))

    @property
    def shape(self) -> tuple[int, int]:
        """Shape (m, m) with m the rows of the contacts and the joint rows."""
        m = int(self.rows.sum()) + len(self.joint_body_a)
        return (m, m)

    @property
    def tangents(self) -> Array:
        """(c, 2, 3) the unit tangents of each contact, which complete its normal to a right-handed frame."""
        return _core.contact_tangents(self.normal, self.direction).reshape(-1, 2, 3)

    def to_core(self) -> _core.Operator:
        """A new operator of the compiled module with copies of the arrays."""
        return _core.contact_operator(
            self.inverse_mass,
            self.inverse_inertia,
            self.body_a,
            self.body_b,
            self.r_a,
            self.r_b,
            self.normal,
            self.direction,
            self.rows,
            self.moment_length,
            self.compliance,
            self.joint_body_a,
            self.joint_body_b,
            self.joint_jacobian_a,
            self.joint_jacobian_b,
            self.joint_compliance,
        )

    def stored(self) -> Factored:
        """The same operator with the Jacobian of every row stored."""
        body_a, body_b, jacobian_a, jacobian_b, compliance = self._operator().stored()
        S = self.moment_scale()
        unit = np.ones(len(body_a)) if S is None else S
        return Factored.from_arrays(
            {
                "inverse_mass": self.inverse_mass,
                "inverse_inertia": self.inverse_inertia,
                "body_a": body_a.astype(np.int32),
                "body_b": body_b.astype(np.int32),
                "jacobian_a": jacobian_a.reshape(-1, 6) / unit[:, None],
                "jacobian_b": jacobian_b.reshape(-1, 6) / unit[:, None],
                "compliance": compliance / unit**2,
            }
        )

    def to_sparse(self) -> sp.csr_array:
        """A as a sparse matrix, (m, m)."""
        return self.stored().to_sparse()

    def __repr__(self) -> str:
        joints = f", {len(self.joint_body_a)} joint rows" if len(self.joint_body_a) else ""
        return f"Contacts({self.bodies} bodies, {len(self.body_a)} contacts{joints})"


def from_core(core: _core.Problem) -> Contacts | Factored | Array:
    """The operator of a problem that the core made: with bodies, or a matrix if it has trees."""
    arrays = core.operator_arrays()
    if "matrix" in arrays:
        return arrays["matrix"]
    return Contacts.from_arrays(arrays) if "normal" in arrays else Factored.from_arrays(arrays)
