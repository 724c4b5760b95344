"""The passes in NumPy: the reference of the kernels, which do the same operations in the same order.

The arrays are those of include/amontons/solvers/first_order/device_layout.hpp. A vector of the passes holds
the contacts, (3, contacts) in world axes, and the single rows, (rows,).
"""

from __future__ import annotations

import numpy as np
from amontons import InputError, _core
from amontons.checks import Array
from amontons.vi import Problem

TILE = 256
"""places whose terms are summed by one tree"""


def dot(a: Array, b: Array) -> Array:
    """Inner products of world vectors, (3, n) each."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Array, b: Array) -> Array:
    """Cross products of world vectors, (3, n) each."""
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def project(z: Array, n: Array, mu: Array, aspect: Array | float) -> Array:
    """Pi of z, (3, n), on Coulomb's cone about n in a metric where tangents count `aspect` times."""
    zn = dot(z, n)
    zt = z - zn * n
    t, m = aspect * np.sqrt(dot(zt, zt)), aspect * mu
    k = (zn + m * t) / ((1 + m * m) * t)
    foot = (m * k) * z + (k * (t - m * zn)) * n
    return np.where(m * t <= -zn, 0.0, np.where(t <= m * zn, z, foot))


def natural_map(x: Array, g: Array, n: Array, mu: Array, p: Array) -> Array:
    """p |x - Pi(x - g / p)|^2 of contacts, (n,), formed without cancellation."""
    step = g / p
    z = x - step
    zn = dot(z, n)
    zt = z - zn * n
    t = np.sqrt(dot(zt, zt))
    k = (t - mu * zn) / ((1 + mu * mu) * t)
    outside = step + (k * zt + (-(mu * k * t)) * n)
    e = np.where(mu * t <= -zn, step + (zt + zn * n), np.where(t <= mu * zn, step, outside))
    return p * dot(e, e)


def row_map(x: Array, u: Array, p: Array, low: Array, high: Array) -> Array:
    """The same of single rows: p e^2."""
    step = u / p
    trial = x - step
    e = np.where(trial < low, x - low, np.where(trial > high, x - high, step))
    return p * (e * e)


def tree(lanes: Array) -> Array:
    """Sums over the last axis, of TILE entries, by halves."""
    while lanes.shape[-1] > 1:
        half = lanes.shape[-1] // 2
        lanes = lanes[..., :half] + lanes[..., half:]
    return lanes[..., 0]


def _tiled(terms: Array) -> Array:
    padded = np.zeros(-(-len(terms) // TILE) * TILE)
    padded[: len(terms)] = terms
    return padded.reshape(-1, TILE)


def tiles(terms: Array) -> Array:
    """The sum of every tile of (n,) terms."""
    return tree(_tiled(terms))


def collect(partial: Array) -> float:
    """One number of many: TILE strided chains, then the tree."""
    lanes = np.zeros(TILE)
    for row in _tiled(partial):
        lanes = lanes + row
    return float(tree(lanes))


class NumpyIterate:
    """The passes of a problem of bodies, contacts and rows in NumPy, an `amontons.vi.Iterate`.

    The kernels of a device are tested against it, to the last bit. law:
    that of the solve which it serves, None for that of the problem. InputError for problems that devices do
    not serve: cones other than `Friction`, and A that is neither `Contacts` nor `Factored`.
    """

    def __init__(self, problem: Problem, *, law: str | None = None) -> None:
        if not _core.DeviceLayout.fits(problem._core):
            raise InputError("the passes know bodies with circular friction cones and single rows only")
        self._fill(problem._core, problem._law(law))

    @classmethod
    def of_core(cls, problem: _core.Problem, law: _core.Law) -> NumpyIterate:
        """The same of a problem of the compiled module."""
        made = cls.__new__(cls)
        made._fill(problem, law)
        return made

    def _fill(self, problem: _core.Problem, law: _core.Law) -> None:
        self._layout = layout = _core.DeviceLayout(problem)
        self._coulomb = law == _core.Law.coulomb
        arrays = layout.arrays()
        contacts, rows, stride = layout.contacts, layout.rows, layout.stride
        fields = arrays["contact"].reshape(8 if layout.stored else 14, stride)[:, :contacts]
        self._n, self._mu, self._p = fields[:3], fields[3], fields[4]
        self._aspect, self._p_t, self._compliance = fields[5], fields[6], fields[7]
        self._arm_a, self._arm_b = fields[8:11], fields[11:14]
        self._row_p, self._low, self._high, self._row_compliance = arrays["row"].reshape(
            4, layout.row_stride
        )[:, :rows]
        line = arrays["line"].astype(np.int64)
        self._line = np.split(line, np.cumsum([stride, stride, layout.row_stride]))
        self._jacobian = arrays["jacobian"].reshape(12, -1 if len(arrays["jacobian"]) else 0)
        self._mass = arrays["mass"].reshape(7, -1)[:, : layout.bodies + 1]
        self._b = arrays["b"]
        self._fill_lists(arrays)

    def _fill_lists(self, arrays: dict[str, Array]) -> None:
        """Who receives each entry of the lists: bodies by their lines, then the parts of large ones."""
        parts = arrays["parts"].reshape(-1, 4)
        self._units = self._layout.bodies + 1 + len(parts)
        self._large = arrays["large"].reshape(-1, 3).astype(np.int64)
        receivers = []
        for first, part in ((arrays["first"], parts[:, :2]), (arrays["first_row"], parts[:, 2:])):
            ranges = np.concatenate([first.reshape(-1, 2), part]).astype(np.int64)
            length = ranges[:, 1] - ranges[:, 0]
            used = np.flatnonzero(length)
            used = used[np.argsort(ranges[used, 0], kind="stable")]
            receivers.append(np.repeat(used, length[used]))
        self._receivers = np.concatenate(receivers)
        entries = arrays["contact_list"].astype(np.int64)
        self._of_contact, self._sign = entries // 2, 1.0 - 2.0 * (entries % 2)
        self._list_arm = np.zeros((3, 0))
        if not self._layout.stored:
            of_a, of_b = self._arm_a[:, self._of_contact], self._arm_b[:, self._of_contact]
            self._list_arm = np.where(entries % 2, of_b, of_a)
        entries = arrays["row_list"].astype(np.int64)
        self._of_component = entries // 2
        place = entries // 2 - (0 if self._layout.stored else 3 * self._layout.stride)
        self._list_row = np.where(entries % 2, self._jacobian[6:, place], self._jacobian[:6, place])

    # Vectors and sums.

    def _split(self, v: Array) -> tuple[Array, Array]:
        """Views of a vector: contacts, (3, contacts), and rows, (rows,)."""
        layout = self._layout
        own = v[: 3 * layout.stride].reshape(3, layout.stride)[:, : layout.contacts]
        return own, v[3 * layout.stride : 3 * layout.stride + layout.rows]

    @staticmethod
    def _sum(contacts: Array, rows: Array) -> float:
        return collect(np.concatenate([tiles(contacts), tiles(rows)]))

    def _saxce(self, u: Array) -> Array:
        ut = cross(self._n, u)
        return self._mu * np.sqrt(dot(ut, ut)) if self._coulomb else np.zeros(u.shape[1])

    def _map(self, x: Array, u: Array) -> float:
        """The squared natural map."""
        (xc, xr), (uc, ur) = self._split(x), self._split(u)
        g = uc + self._saxce(uc) * self._n
        with np.errstate(divide="ignore", invalid="ignore"):
            own = natural_map(xc, g, self._n, self._mu, self._p)
        return self._sum(own, row_map(xr, ur, self._row_p, self._low, self._high))

    # A v = D M^-1 D'v + E v.

    def _impulses(self, v: Array) -> Array:
        """D'v, (6, bodies and parts)."""
        layout = self._layout
        f = self._sign * v[: 3 * layout.stride].reshape(3, layout.stride)[:, self._of_contact]
        own = np.concatenate([f, cross(self._list_arm, f)])
        terms = np.concatenate([own, v[self._of_component] * self._list_row], axis=1)
        return np.array([np.bincount(self._receivers, row, self._units) for row in terms])

    def _move(self, w: Array) -> tuple[Array, Array]:
        """M^-1 w by lines, (6, lines), and <w, M^-1 w> of each."""
        m, a = self._mass, w[3:]
        turns = [
            m[1] * a[0] + m[4] * a[1] + m[5] * a[2],
            m[4] * a[0] + m[2] * a[1] + m[6] * a[2],
            m[5] * a[0] + m[6] * a[1] + m[3] * a[2],
        ]
        v = np.concatenate([m[0] * w[:3], turns])
        s = w * v
        return v, ((s[0] + s[1]) + (s[2] + s[3])) + (s[4] + s[5])

    def _bodies(self, vector: Array) -> float:
        """Velocities M^-1 D'v of the bodies; <D'v, M^-1 D'v>."""
        lines = self._layout.bodies + 1
        w = self._impulses(vector)
        own = w[:, :lines].copy()
        for line, begin, end in self._large:
            own[:, line] = [collect(row[lines + begin : lines + end]) for row in w]
        self._velocity, work = self._move(own)
        large = work[self._large[:, 0]]
        work[self._large[:, 0]] = 0
        return collect(np.concatenate([tiles(work[1:]), large]))

    def _row_velocity(self, places: slice, a: Array, b: Array) -> Array:
        J = self._jacobian[:, places]
        s = [a[k] * J[k] + b[k] * J[6 + k] for k in range(6)]
        return ((s[0] + s[1]) + (s[2] + s[3])) + (s[4] + s[5])

    def _product(self, vector: Array) -> Array:
        """A v after `_bodies(v)`."""
        layout, v = self._layout, self._velocity
        out = np.zeros_like(vector)
        (oc, orow), (vc, vr) = self._split(out), self._split(vector)
        a, b = v[:, self._line[0][: layout.contacts]], v[:, self._line[1][: layout.contacts]]
        if layout.stored:
            for k in range(3):
                oc[k] = self._row_velocity(
                    slice(k * layout.stride, k * layout.stride + layout.contacts), a, b
                )
        else:
            oc[:] = (a[:3] - b[:3]) + (cross(a[3:], self._arm_a) - cross(b[3:], self._arm_b))
        if layout.compliant:
            oc += self._compliance * vc
        a, b = v[:, self._line[2][: layout.rows]], v[:, self._line[3][: layout.rows]]
        ahead = 3 * layout.stride if layout.stored else 0
        orow[:] = self._row_velocity(slice(ahead, ahead + layout.rows), a, b) + self._row_compliance * vr
        return out

    # The passes.

    def start(self, x0: Array) -> float:
        """See `amontons.vi.Iterate`."""
        self._x = self._best = self._layout.start(x0).copy()
        return self.refresh()

    def refresh(self) -> float:
        """See `amontons.vi.Iterate`."""
        self._bodies(self._x)
        self._u = self._product(self._x) + self._b
        return self._map(self._x, self._u)

    def _directed(self, y: Array, g: Array, alpha: float, metric: bool) -> tuple[Array, Array]:
        """d of contacts from y, and of an aspect other than one the factor by which normals count more."""
        n, p = self._n, self._p_t if metric else self._p
        aspect = self._aspect if metric else 1.0
        more = np.zeros(len(p))
        if metric:
            squared = aspect * aspect
            more = 1 / squared - 1
            g = g + ((squared - 1) * dot(g, n)) * n
        with np.errstate(divide="ignore", invalid="ignore"):
            return project(y - (alpha / p) * g, n, self._mu, aspect) - y, more

    def direction(self, alpha: float) -> tuple[float, float]:
        """See `amontons.vi.Iterate`."""
        self._d = np.zeros_like(self._x)
        (xc, xr), (uc, ur), (dc, dr) = map(self._split, (self._x, self._u, self._d))
        g = uc + self._saxce(uc) * self._n
        dc[:], _ = self._directed(xc, g, alpha, metric=False)
        dr[:] = np.clip(xr - alpha / self._row_p * ur, self._low, self._high) - xr
        dd, rr = dot(dc, dc), dr * dr
        self._dEd = self._sum(self._compliance * dd, self._row_compliance * rr)
        return self._sum(dot(dc, g), dr * ur), self._sum(self._p * dd, self._row_p * rr)

    def curvature(self) -> float:
        """See `amontons.vi.Iterate`."""
        dAd = self._bodies(self._d) + self._dEd
        self._Ad = self._product(self._d)
        return dAd

    def update(self, lam: float) -> tuple[float, float, float]:
        """See `amontons.vi.Iterate`."""
        s, y, old = lam * self._d, lam * self._Ad, self._u
        self._x, self._u = self._x + s, old + y
        (sc, sr), (yc, yr), (uc, _), (oc, _) = map(self._split, (s, y, self._u, old))
        yc = yc + (self._saxce(uc) - self._saxce(oc)) * self._n
        yPy = self._sum(dot(yc, yc) / self._p, yr * yr / self._row_p)
        return self._sum(dot(sc, yc), sr * yr), yPy, self._map(self._x, self._u)

    def start_momentum(self) -> None:
        """See `amontons.vi.Iterate`."""
        self._before, self._u_before, self._beta = self._x, self._u, 0.0

    def momentum_direction(self, alpha: float) -> tuple[float, float]:
        """See `amontons.vi.Iterate`."""
        y = self._x + self._beta * (self._x - self._before)
        u_y = self._u + self._beta * (self._u - self._u_before)
        self._d = np.zeros_like(y)
        (xc, xr), (yc, yr), (uc, _), (gc, gr), (dc, dr) = map(
            self._split, (self._x, y, self._u, u_y, self._d)
        )
        dc[:], more = self._directed(yc, gc + self._saxce(uc) * self._n, alpha, metric=True)
        dr[:] = np.clip(yr - alpha / self._row_p * gr, self._low, self._high) - yr
        dd, rr, dn, m = dot(dc, dc), dr * dr, dot(dc, self._n), yc - xc
        self._dEd = self._sum(self._compliance * dd, self._row_compliance * rr)
        dPd = self._sum(self._p_t * (dd + more * (dn * dn)), self._row_p * rr)
        dPm = self._p_t * (dot(dc, m) + more * (dn * dot(m, self._n)))
        return dPd, self._sum(dPm, self._row_p * (dr * (yr - xr)))

    def accelerate(self, beta: float) -> float:
        """See `amontons.vi.Iterate`."""
        x = (self._x + self._beta * (self._x - self._before)) + self._d
        u = (self._u + self._beta * (self._u - self._u_before)) + self._Ad
        self._before, self._u_before, self._x, self._u, self._beta = self._x, self._u, x, u, beta
        return self._map(x, u)

    def refresh_momentum(self) -> float:
        """See `amontons.vi.Iterate`."""
        self._bodies(self._before)
        self._u_before = self._product(self._before) + self._b
        return self.refresh()

    def keep_best(self) -> None:
        """See `amontons.vi.Iterate`."""
        self._best = self._x

    def extract_best(self) -> Array:
        """See `amontons.vi.Iterate`."""
        return self._layout.to_user(self._best)

    def extract(self) -> Array:
        """See `amontons.vi.Iterate`."""
        return self._layout.to_user(self._x)

    def objective(self) -> float:
        """See `amontons.vi.Iterate`."""
        (xc, xr), (uc, ur), (bc, br) = map(self._split, (self._x, self._u, self._b))
        return 0.5 * self._sum(dot(xc, uc + bc), xr * (ur + br))
