"""Clarabel as the independent solver: the associated law, and projections, as conic programs."""

from collections import Counter

import amontons
import clarabel
import numpy as np
import scipy.sparse as sp


def conic_rows(cones):
    """The conditions x in K as G x + s = h with s in a product of Clarabel's cones: (G, h, cones)."""
    rows = {"zero": [], "nonnegative": [], "cone": []}
    sizes = []  # of the second-order cones
    at = 0
    for cone in cones:
        if isinstance(cone, amontons.vi.NonNegative):
            rows["nonnegative"] += [([(at + i, -1.0)], 0.0) for i in range(cone.n)]
        elif isinstance(cone, amontons.vi.Interval):
            for i, (lo, hi) in enumerate(zip(cone.lo, cone.hi, strict=True)):
                if np.isfinite(lo):
                    rows["nonnegative"].append(([(at + i, -1.0)], -lo))
                if np.isfinite(hi):
                    rows["nonnegative"].append(([(at + i, 1.0)], hi))
        elif isinstance(cone, amontons.vi.Friction):
            for i, mu in enumerate(cone.mu):
                n = at + 3 * i
                if mu < 1e-9:  # |t| <= 0 alone would leave the sign of x_n open
                    rows["nonnegative"].append(([(n, -1.0)], 0.0))
                    rows["zero"] += [([(n + 1, 1.0)], 0.0), ([(n + 2, 1.0)], 0.0)]
                else:
                    rows["cone"] += [([(n, -mu)], 0.0), ([(n + 1, -1.0)], 0.0), ([(n + 2, -1.0)], 0.0)]
                    sizes.append(3)
        elif isinstance(cone, amontons.vi.EllipticFriction):
            for i, mu in enumerate(np.stack(cone.parameters, axis=1)):
                _add_cone(rows, sizes, at + cone.block * i, range(1, cone.block), mu)
        elif isinstance(cone, amontons.vi.PlanarFriction):
            for i, mu in enumerate(cone.mu):
                _add_cone(rows, sizes, at + 2 * i, (1,), [mu])
        elif isinstance(cone, amontons.vi.RollingFriction):
            for i in range(cone.n):
                _add_cone(rows, sizes, at + 5 * i, (1, 2), [cone.mu[i]] * 2)
                _add_cone(rows, sizes, at + 5 * i, (3, 4), [cone.rolling[i]] * 2)
        at += cone.rows
    listed = rows["zero"] + rows["nonnegative"] + rows["cone"]
    entries = [(i, j, v) for i, (row, _) in enumerate(listed) for j, v in row]
    i, j, v = zip(*entries, strict=True) if entries else ((), (), ())
    G = sp.csc_matrix((v, (i, j)), shape=(len(listed), at))
    counts = Counter({name: len(part) for name, part in rows.items()})
    sets = []
    if counts["zero"]:
        sets.append(clarabel.ZeroConeT(counts["zero"]))
    if counts["nonnegative"]:
        sets.append(clarabel.NonnegativeConeT(counts["nonnegative"]))
    sets += [clarabel.SecondOrderConeT(size) for size in sizes]
    return G, np.array([h for _, h in listed]), sets


def _add_cone(rows, sizes, n, places, mu):
    """|(x[n + k] / mu_k)| <= x[n] over the places k; a row whose mu is zero is zero."""
    live = [(k, m) for k, m in zip(places, mu, strict=True) if m >= 1e-9]
    rows["zero"] += [([(n + k, 1.0)], 0.0) for k, m in zip(places, mu, strict=True) if m < 1e-9]
    if not live:
        rows["nonnegative"].append(([(n, -1.0)], 0.0))
        return
    largest = max(m for _, m in live)
    rows["cone"] += [([(n, -largest)], 0.0)] + [([(n + k, -largest / m)], 0.0) for k, m in live]
    sizes.append(1 + len(live))


def minimise(A, b, cones):
    """x and the value of min 1/2 x'Ax + b'x over K, to 1e-10 or else to 1e-8. A: dense or sparse.

    Raises ArithmeticError where Clarabel does not solve the problem.
    """
    G, h, sets = conic_rows(cones)
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.presolve_enable = False
    for tolerance in (1e-10, 1e-8):
        settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = tolerance
        triangle = sp.triu(sp.csc_matrix(A), format="csc")
        result = clarabel.DefaultSolver(triangle, b, G, h, sets, settings).solve()
        if str(result.status) == "Solved":
            return np.array(result.x), result.obj_val
    raise ArithmeticError(f"Clarabel: {result.status}")
