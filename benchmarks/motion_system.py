"""Digits and cost of one Newton step of an island by forms of its matrix, beside a reference of long double.

    python benchmarks/motion_system.py [--quick] [--islands 500] [--data FOLDER] [--out FOLDER]

Needs qdldl (pip install qdldl). Writes motion_system.csv, a row per kind of step, size and form. Islands are
the largest of each problem of the corpus (benchmarks/corpus.py: scenes, piles, robots), of the FCLIB files,
and of plates of mass 1e8 : 1e-8, an arch and a chain that carries 1e3 times its mass. Each has three steps:
`coulomb` and `associated`, Newton on the faces near a solution, (G + H (A + sigma P)) dx = -F
(docs/algorithm.md (32)), and `barrier`, near the end of a central path. The forms are

    dense   W of the active rows, without the bilateral ones, which a sparse factor eliminates once per solve;
            W is formed once per solve, and factored with row pivots in each step: the direct way
    shift   body space, I + R'AR by Woodbury (symmetric) or 1 + C'D'SDC (unsymmetric): ShiftedSystem
    thin    1 + C'D'SDC with S = (G + H (E + sigma P))^-1 H: the thin form, for all
    K       the whole system in velocities and impulses, with its minimum degree order and no pivots: by
            QDLDL where it is symmetric, otherwise by SuperLU

`today` is dense up to 180 rows that are not bilateral, above them shift. Errors are relative, in the norm of
P, after no, one and two refinements on the true residual. Cost is the number of multiplications of forming
and factoring, per step of a solve with STEPS steps. Dense kernels do four to eight multiplications at a time,
sparse ones of small blocks fewer: the count favours sparse forms of few rows.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import islice
from typing import Any

import amontons
import corpus
import numpy as np
import qdldl
import scipy.linalg as la
import scipy.sparse as sp
import scipy.sparse.linalg as spl
from amontons import scenes
from common import arguments, read, tracked, with_folders, write_csv

Array = np.ndarray[Any, Any]
SIGMA = 1e-7
"""Proximal term, relative to P, of all forms (direct.proximal)."""
BARRIER = 1e-8
"""Relative size of x o u at which the step near the end of a path is taken."""
STEPS = 5
"""Newton steps of a solve, over which the cost of what is done once is shared."""
ROUNDING = 1e-13
"""Errors below it count as equal."""
DENSE, LARGEST = 180, 300
"""Rows, not bilateral, up to which today's form is dense (direct.most_rows); rows of the largest island."""
SIZES = ((0, 30), (30, 100), (100, 180), (180, LARGEST))
CONTRACT: tuple[tuple[str, dict[str, Any], int], ...] = (
    ("plates", {"ratio": 1e16, "count": 2}, 3),
    ("plates", {"ratio": 1e-16, "count": 2}, 3),
    ("plates", {"ratio": 1e4, "count": 12}, 5),
    ("arch", {"stones": 21}, 20),
    ("chain", {"links": 40, "end_mass_ratio": 1e3}, 10),
    ("card_house", {}, 20),
    ("stack", {"boxes": 12}, 20),
)
"""Scenes, their parameters, and the step."""


@dataclass(frozen=True)
class Step:
    """(G + H (Y Y' + E + sigma P)) dx = -F of the active rows; Y = D C, M^-1 = C C', blocks of G and H."""

    source: str
    kind: str
    Y: sp.csr_array
    E: Array
    P: Array
    G: sp.csr_array
    H: sp.csr_array
    F: Array
    bilateral: Array
    symmetric: tuple[sp.csr_array, Array] | None
    """V, s: dx + F lies in the range of V, on which the equation is (V'(A + E)V + diag(s)) y = r."""

    def apply(self, dx: Array) -> Array:
        return self.G @ dx + self.H @ (self.Y @ (self.Y.T @ dx) + (self.E + SIGMA * self.P) * dx)


# Blocks


def equation(law: str, mu: float | None, bounds: tuple[float, float], p: float, x: Array, u: Array) -> Any:
    """F, G, H of a block; under the associated law the eigenvalues and eigenvectors of the projection too."""
    d = len(x)
    y = x - u / p
    if mu is None:
        inside = (y > bounds[0]) & (y < bounds[1])
        q = inside.astype(float)
        return x - np.clip(y, *bounds), np.diag(1 - q), np.diag(q / p), q, np.eye(d)
    n, t = y[0], y[1:]
    size = float(np.linalg.norm(t))
    e = t / size if size > 0 else np.zeros(d - 1)
    if law == "coulomb":
        if n <= 0:
            return x, np.eye(d), np.zeros((d, d)), np.zeros(d), np.eye(d)
        if size <= mu * n:
            return u / p, np.zeros((d, d)), np.eye(d) / p, np.ones(d), np.eye(d)
        turn = mu * n / size * (np.eye(d - 1) - np.outer(e, e))
        G, H = np.eye(d), np.zeros((d, d))
        G[0, 0], H[0, 0] = 0, 1 / p
        G[1:, 0], H[1:, 0] = -mu * e, mu * e / p
        G[1:, 1:] -= turn
        H[1:, 1:] = turn / p
        return np.concatenate([[u[0] / p], x[1:] - mu * n * e]), G, H, None, None
    if size <= mu * n:
        Pi, q, V = y, np.ones(d), np.eye(d)
    elif mu * size <= -n:
        Pi, q, V = np.zeros(d), np.zeros(d), np.eye(d)
    else:
        along = (n + mu * size) / (1 + mu * mu)
        Pi = along * np.concatenate([[1], mu * e])
        V = np.zeros((d, d))
        V[:, 0] = np.concatenate([[1], mu * e]) / np.hypot(1, mu)
        V[:, 1] = np.concatenate([[-mu], e]) / np.hypot(1, mu)
        V[1:, 2] = (-e[1], e[0])
        q = np.array([1.0, 0.0, mu * along / size])
    Q = (V * q) @ V.T
    return x - Pi, np.eye(d) - Q, Q / p, q, V


def scaling(mu: float | None, p: float, x: Array, u: Array) -> tuple[Array, Array]:
    """Eigenvalues (over p) and eigenvectors of W^2, W x = W^-1 u, at a point inside of both cones."""
    if mu is None:
        return np.maximum(np.abs(u), BARRIER * p) / np.maximum(np.abs(x), BARRIER) / p, np.eye(len(x))
    # The cone of mu is that of one in xs = (mu x_n, x_t), us = (u_n, mu u_t) / mu.
    T = np.array([mu, 1.0, 1.0])
    xs, us = T * x, u / T
    shift = np.array([1.0, 0, 0])
    size = max(float(np.linalg.norm(xs)), float(np.linalg.norm(us)) / p, 1e-12)
    xs = xs + shift * (max(0.0, float(np.linalg.norm(xs[1:])) - xs[0]) + BARRIER * size)
    us = us + shift * (max(0.0, float(np.linalg.norm(us[1:])) - us[0]) + BARRIER * size * p)
    J = np.diag([1.0, -1, -1])
    dx, du = np.sqrt(max(xs @ J @ xs, 1e-300)), np.sqrt(max(us @ J @ us, 1e-300))
    xs, us = xs / dx, us / du
    gamma = np.sqrt((1 + xs @ us) / 2)
    w = (us + J @ xs) / (2 * gamma)
    W2 = du / dx * (2 * np.outer(w, w) - J)
    value, V = np.linalg.eigh((W2 * T[:, None] * T[None, :]) / p)
    return np.maximum(value, 1e-14), V


# Steps of islands


def blocks_of(
    problem: amontons.vi.Problem,
) -> list[tuple[int, int, float | None, tuple[float, float]]] | None:
    """Row, rows, coefficient, bounds of each block; None where a set has no form here."""
    found: list[tuple[int, int, float | None, tuple[float, float]]] = []
    row = 0
    for cone in problem.cones:
        kind = cone.kind
        if kind == "friction":
            for mu in np.asarray(cone.parameters[0]).reshape(-1):
                found.append((row, 3, max(float(mu), 1e-6), (0, 0)))
                row += 3
            continue
        if kind not in ("bilateral", "nonnegative", "interval"):
            return None
        lo, hi = (np.asarray(b) for b in cone.parameters) if kind == "interval" else (None, None)
        for k in range(cone.rows):
            bounds = (-np.inf, np.inf) if kind == "bilateral" else (0.0, np.inf)
            found.append((row + k, 1, None, bounds if lo is None else (float(lo[k]), float(hi[k]))))  # type: ignore[index]
        row += cone.rows
    return found


def islands(problem: amontons.vi.Problem) -> Iterator[tuple[Array, Any]]:
    """Rows of each island with friction or bounds, and its blocks."""
    blocks = blocks_of(problem)
    if blocks is None:
        return
    A = problem.A.stored() if isinstance(problem.A, amontons.vi.Contacts) else problem.A
    if not isinstance(A, amontons.vi.Factored):
        return
    D = A.jacobian()
    touched = sp.csr_array((np.ones(D.nnz), D.indices // 6, D.indptr), shape=(D.shape[0], A.bodies))
    bodies = touched @ sp.diags_array((A.inverse_mass > 0).astype(float))
    ties = sp.csr_array(bodies @ bodies.T)
    head = [b[0] for b in blocks for _ in range(b[1])]
    ties = ties + sp.csr_array((np.ones(len(head)), (np.arange(len(head)), head)), shape=ties.shape)
    count, label = sp.csgraph.connected_components(ties, directed=False)
    for i in range(count):
        rows = np.flatnonzero(label == i)
        mine = [b for b in blocks if label[b[0]] == i]
        if 6 <= len(rows) <= LARGEST and any(np.isfinite(b[3][0]) for b in mine):
            yield rows, mine


def steps_of(source: str, problem: amontons.vi.Problem) -> Iterator[Step]:
    if sp.issparse(problem.A) or isinstance(problem.A, np.ndarray):
        return
    A = problem.A.stored() if isinstance(problem.A, amontons.vi.Contacts) else problem.A
    points = {}
    for law in ("coulomb", "associated"):
        s = problem.solve(law=law, tolerance=1e-3, deadline=2.0, threads=1)
        points[law] = (s.x, problem.A @ s.x + problem.b)
    points["barrier"] = points["associated"]
    inverse = A.inverse_mass_matrix().tocsr()
    C = block_roots(inverse)
    Y, E = sp.csr_array(A.jacobian() @ C), A.compliance
    diagonal = np.asarray((Y.multiply(Y)).sum(axis=1)).ravel() + E
    largest = max(islands(problem), key=lambda i: len(i[0]), default=None)
    for rows, blocks in [largest] if largest else []:
        for kind, (x, u) in points.items():
            step = step_of(source, kind, rows, blocks, Y, E, diagonal, x, u)
            if step is not None:
                yield step


def block_roots(inverse: sp.csr_array) -> sp.csr_array:
    """C with M^-1 = C C', body by body."""
    n = inverse.shape[0] // 6
    roots = []
    for i in range(n):
        block = inverse[6 * i : 6 * i + 6, 6 * i : 6 * i + 6].toarray()
        value, vector = np.linalg.eigh(block)
        roots.append(vector * np.sqrt(np.maximum(value, 0)))
    return sp.csr_array(sp.block_diag(roots, format="csr"))


def step_of(
    source: str, kind: str, rows: Array, blocks: Any, Y: sp.csr_array, E: Array, diagonal: Array,
    x: Array, u: Array,
) -> Step | None:  # fmt: skip
    place = {int(r): k for k, r in enumerate(rows)}
    G, H, F, V, s, P, kept, held, at = [], [], [], [], [], [], [], [], 0
    for row, d, mu, bounds in blocks:
        here = slice(row, row + d)
        joint = mu is None and not np.isfinite(bounds[0])
        p = float(diagonal[here].mean())
        if not p > 0:
            return None
        if kind == "barrier":
            value, vector = scaling(mu, p, x[here], u[here])
            if joint:
                value = np.full(1, 1e-9)  # not tuned: the proximal term of bilateral rows
            g, h, q = (vector * value) @ vector.T, np.eye(d) / p, np.ones(d)
            f = u[here] / p
            stiff = value * p
        else:
            f, g, h, q, vector = equation(kind, mu, bounds, p, x[here], u[here])
            if not h.any():
                continue
            stiff = None if q is None else p * (1 - q + SIGMA * q)[q > 0] / q[q > 0]
            vector = None if q is None else vector[:, q > 0]
        G.append(g), H.append(h), F.append(f), V.append(vector), s.append(stiff)
        P += d * [p]
        held += d * [joint]
        kept += [place[r] for r in range(row, row + d)]
        at += d
    if at < 6:
        return None
    mine = Y[rows[kept]]
    used = np.unique(mine.indices)
    mine = sp.csr_array(mine[:, used])
    symmetric = None
    if kind != "coulomb":
        symmetric = (sp.csr_array(sp.block_diag(V)), np.concatenate(s))
    blocks_ = [sp.csr_array(sp.block_diag(part)) for part in (G, H)]
    return Step(
        source, kind, mine, E[rows[kept]], np.array(P), *blocks_, np.concatenate(F), np.array(held), symmetric
    )


# Forms: each returns a function r -> dx of the equation apply(dx) = r, and its multiplications


def product_cost(A: sp.csr_array, B: sp.csr_array) -> float:
    return float(np.diff(B.tocsr().indptr)[A.tocsr().indices].sum())


def lu_cost(lu: spl.SuperLU) -> float:
    below = np.diff(lu.L.tocsc().indptr) - 1
    right = np.diff(lu.U.tocsr().indptr) - 1
    return float((below * right).sum())


def without_pivots(K: sp.csr_array) -> spl.SuperLU:
    options = {"SymmetricMode": True, "DiagPivotThresh": 0.0}
    return spl.splu(sp.csc_array(K), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)


def by_dense(s: Step) -> tuple[Callable[[Array], Array], float]:
    """Bilateral rows, whose equation is p r = (A + E) dx, leave by block elimination."""
    c, b = np.flatnonzero(~s.bilateral), np.flatnonzero(s.bilateral)
    Yc, Yb = s.Y[c], s.Y[b]
    Wcc = (Yc @ Yc.T).toarray() + np.diag((s.E + SIGMA * s.P)[c])
    G, H = s.G[c][:, c], s.H[c][:, c]
    m = len(c)
    once, step = product_cost(Yc, Yc.T), H.nnz * m + m * m * (m + 9) / 3
    if not len(b):
        lu = la.lu_factor(G.toarray() + H @ Wcc)
        return lambda r: la.lu_solve(lu, r), once / STEPS + step
    n = s.Y.shape[1]
    own = s.E[b] + SIGMA * s.P[b] + s.G.diagonal()[b] * s.P[b]
    joints = qdldl.Solver(sp.csc_array(sp.block_array([[sp.eye_array(n), Yb.T], [Yb, -sp.diags_array(own)]])))
    below = np.diff(sp.csc_array(joints.factors()[0]).indptr)
    once += float((below * (below + 3) / 2).sum()) + m * 2.0 * below.sum()

    def held(q: Array) -> Array:  # (Yb Yb' + own)^-1 q
        return -joints.solve(np.concatenate([np.zeros(n), q]))[n:]

    Wbc = (Yb @ Yc.T).toarray()
    columns = np.column_stack([held(Wbc[:, k]) for k in range(m)]) if m else np.zeros((len(b), 0))
    lu = la.lu_factor(G.toarray() + H @ (Wcc - Wbc.T @ columns)) if m else None

    def solve(r: Array) -> Array:
        dx = np.zeros(len(r))
        first = held(s.P[b] * r[b])
        if lu is not None:
            dx[c] = la.lu_solve(lu, r[c] - H @ (Wbc.T @ first))
        dx[b] = first - columns @ dx[c]
        return dx

    return solve, once / STEPS + step


def by_shift(s: Step) -> tuple[Callable[[Array], Array], float]:
    """ShiftedSystem: singular factors R, Woodbury. Its refinements work on the inner system."""
    if s.symmetric is None:
        return by_thin(s)
    V, stiff = s.symmetric
    stiff = stiff + SIGMA * s.P if s.kind == "barrier" else stiff
    R = sp.csr_array(V @ sp.diags_array(1 / np.sqrt(stiff)))
    B = sp.csr_array(R.T @ sp.diags_array(s.E) @ R) + sp.eye_array(R.shape[1])
    inner = without_pivots(B)
    T = sp.csr_array(s.Y.T @ R)
    N = sp.csr_array(T @ sp.csr_array(inner.solve(T.T.toarray())) + sp.eye_array(T.shape[0]))
    outer = without_pivots(N)

    def inverse(q: Array) -> Array:
        z = inner.solve(q)
        return z - inner.solve(T.T @ outer.solve(T @ z))

    cost = product_cost(s.Y.T, R) + product_cost(T, T.T) / 2 + lu_cost(outer) / 2
    return on_range(s, lambda q: R @ inverse(R.T @ q)), cost


def on_range(s: Step, inverse: Callable[[Array], Array]) -> Callable[[Array], Array]:
    """For (I - Q + Q P^-1 (A + sigma P)) dx = r: dx = r + y, with y = inverse((1 - sigma) P r - A r)."""

    def solve(r: Array) -> Array:
        if s.kind == "barrier":  # (W^2 + A + sigma P) dx = P r
            return inverse(s.P * r)
        q = (1 - SIGMA) * s.P * r - s.Y @ (s.Y.T @ r) - s.E * r
        return r + inverse(q)

    return solve


def by_thin(s: Step) -> tuple[Callable[[Array], Array], float]:
    D = sp.csr_array(s.G + s.H @ sp.diags_array(s.E + SIGMA * s.P))
    lu = spl.splu(sp.csc_array(D), permc_spec="NATURAL")
    S = sp.csr_array(lu.solve(s.H.toarray()))
    S.data[np.abs(S.data) < 1e-300] = 0
    S.eliminate_zeros()
    T = sp.csr_array(S @ s.Y)
    N = sp.csr_array(s.Y.T @ T + sp.eye_array(s.Y.shape[1]))
    factor = without_pivots(N)

    def solve(r: Array) -> Array:
        a = lu.solve(r)
        return a - T @ factor.solve(s.Y.T @ a)

    return solve, product_cost(S, s.Y) + product_cost(s.Y.T, T) + lu_cost(factor)


def by_whole(s: Step) -> tuple[Callable[[Array], Array], float]:
    n = s.Y.shape[1]
    if s.symmetric is None:
        K = sp.block_array(
            [[sp.eye_array(n), -s.Y.T], [s.H @ s.Y, s.G + s.H @ sp.diags_array(s.E + SIGMA * s.P)]]
        )
        lu = without_pivots(sp.csr_array(K))
        return lambda r: lu.solve(np.concatenate([np.zeros(n), r]))[n:], product_cost(s.H, s.Y) + lu_cost(lu)
    V, stiff = s.symmetric
    extra = SIGMA * s.P if s.kind == "barrier" else 0 * s.P
    T = sp.csr_array(V.T @ s.Y)
    S = sp.csr_array(V.T @ sp.diags_array(s.E + extra) @ V) + sp.diags_array(stiff)
    K = sp.csc_array(sp.block_array([[sp.eye_array(n), T.T], [T, -S]]))
    solver = qdldl.Solver(K)
    below = np.diff(sp.csc_array(solver.factors()[0]).indptr)
    cost = product_cost(V.T.tocsr(), s.Y) + float((below * (below + 3) / 2).sum())
    return on_range(s, lambda q: -(V @ solver.solve(np.concatenate([np.zeros(n), V.T @ q]))[n:])), cost


FORMS = {"dense": by_dense, "shift": by_shift, "thin": by_thin, "K": by_whole}


def reference(s: Step) -> Array:
    """Gauss with row pivots in long double, on W of long double."""
    Y = s.Y.toarray().astype(np.longdouble)
    W = Y @ Y.T + np.diag((s.E + SIGMA * s.P).astype(np.longdouble))
    J = s.G.toarray().astype(np.longdouble) + s.H.toarray().astype(np.longdouble) @ W
    r = -s.F.astype(np.longdouble)
    m = len(r)
    for k in range(m):
        p = k + int(np.argmax(np.abs(J[k:, k])))
        J[[k, p]], r[[k, p]] = J[[p, k]], r[[p, k]]
        share = J[k + 1 :, k] / J[k, k]
        live = np.flatnonzero(share)
        J[k + 1 + live, k:] -= share[live, None] * J[k, k:]
        r[k + 1 :] -= share * r[k]
    for k in range(m - 1, -1, -1):
        r[k] = (r[k] - J[k, k + 1 :] @ r[k + 1 :]) / J[k, k]
    return r


def measure(s: Step) -> list[dict[str, Any]]:
    exact = reference(s)
    weight = np.sqrt(s.P)
    size = float(np.linalg.norm(weight * exact))
    scale = float(np.linalg.norm(weight * s.F))
    if not size > 0 or not np.isfinite(size):
        return []
    rows = []
    for name, form in FORMS.items():
        row: dict[str, Any] = {
            "source": s.source,
            "kind": s.kind,
            "rows": int((~s.bilateral).sum()),
            "form": name,
        }
        try:
            solve, cost = form(s)
            dx = solve(-s.F)
            for k in range(3):
                error = float(np.linalg.norm(weight * (dx - exact).astype(float))) / size
                left = -s.F - s.apply(dx)
                row |= {f"error {k}": error, f"residual {k}": float(np.linalg.norm(weight * left)) / scale}
                dx = dx + solve(left)
            row["cost"] = cost
        except (RuntimeError, ValueError, np.linalg.LinAlgError) as failure:
            row |= {"failed": str(failure)[:60]}
        rows.append(row)
    by_form = {row["form"]: row for row in rows}
    return [*rows, by_form["dense" if (~s.bilateral).sum() <= DENSE else "shift"] | {"form": "today"}]


# The table


def table_of(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Per kind, size and form: quantiles of errors, and cost over that of today."""
    todays = {(r["source"], r["kind"]): r for r in rows if r["form"] == "today"}
    table = []
    for kind in dict.fromkeys(row["kind"] for row in rows):
        for low, high in SIZES:
            for form in ("today", *FORMS):
                mine = [r for r in rows if (r["kind"], r["form"]) == (kind, form) and low <= r["rows"] < high]
                pairs = [(r, todays[r["source"], kind]) for r in mine if "cost" in r]
                pairs = [(r, base) for r, base in pairs if "cost" in base]
                if pairs:
                    head = {"kind": kind, "rows": f"{low} to {high}", "form": form, "islands": len(mine)}
                    table.append(head | {"failed": len(mine) - len(pairs)} | line_of(pairs))
    return table


def line_of(pairs: list[tuple[dict[str, Any], dict[str, Any]]]) -> dict[str, float]:
    line = {}
    for k in range(3):
        errors = [r[f"error {k}"] for r, _ in pairs]
        line |= {f"error {k}, median": np.median(errors), f"error {k}, 95 %": np.quantile(errors, 0.95)}
    loss = np.array([max(r["error 2"], ROUNDING) / max(b["error 2"], ROUNDING) for r, b in pairs])
    cost = np.array([r["cost"] / b["cost"] for r, b in pairs])
    return {key: float(value) for key, value in line.items()} | {
        "residual 2, 95 %": float(np.quantile([r["residual 2"] for r, _ in pairs], 0.95)),
        "error 2, mean over today": float(np.exp(np.log(loss).mean())),
        "over 10 times today's error (%)": 100 * float((loss > 10).mean()),
        "worst over today's error": float(loss.max()),
        "cost, mean": float(np.exp(np.log(cost).mean())),
        "cost, 90 %": float(np.quantile(cost, 0.9)),
    }


def problems(data: Any, count: int) -> Iterator[tuple[str, amontons.vi.Problem]]:
    for name, parameters, steps in CONTRACT:
        scene = scenes.get(name)
        try:
            simulation = amontons.Simulation(
                scene.make(**parameters), dt=scene.dt, on_failure="ignore", threads=1
            )
            for _ in range(steps):
                simulation.step()
        except (amontons.InputError, amontons.SimulationError) as error:
            print(f"{name} {parameters} left out: {error}")
            continue
        yield f"{name} {parameters}", simulation.problem()
    for path in sorted((data / "fclib").glob("*.hdf5")):
        yield path.stem, read(path)
    found = list(corpus.load(corpus.FOLDER))
    for step in islice(found, 0, None, max(1, len(found) * 5 // count)):
        yield step.name, step.problem()


def main() -> None:
    parser = arguments(__doc__)
    parser.add_argument("--islands", type=int, default=500, help="about so many steps of islands")
    options = with_folders(parser.parse_args())
    warnings.simplefilter("ignore")
    rows: list[dict[str, Any]] = []
    chosen = list(problems(options.data, 60 if options.quick else options.islands))
    for i, (source, problem) in enumerate(tracked(chosen, "islands")):
        try:
            for step in steps_of(source, problem):
                rows += measure(step)
        except (amontons.InputError, AttributeError) as error:
            print(f"{source} left out: {str(error)[:80]}")
        if i % 20 == 19:
            write_csv(options.out / "motion_system.csv", table_of(rows))
    table = table_of(rows)
    write_csv(options.out / "motion_system.csv", table)
    for r in table:
        print(" ".join(f"{v:.2g}" if isinstance(v, float) else str(v) for v in r.values()))


if __name__ == "__main__":
    main()
