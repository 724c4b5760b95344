"""P-SPG-FB and APGD on a device: kernels.cl by a backend, one read per chunk of iterations."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from .. import _core
from ..checks import Array
from .backend import Backend, Launch, Memory

TILE = 256
"""places that a work group serves, as kernels.cl has it"""
STATE = (
    "stop", "left", "count", "stale", "period", "tolerance", "scale", "least_map", "at_start", "vector_d",
    "now", "before", "best", "u", "u_before", "sum", "infinite", "alpha", "lambda", "dg", "dpd", "dad",
    "difference", "values", "odd", "backtracks", "alpha_min", "alpha_max", "sigma_min", "sigma_max",
    "gamma", "memory", "l", "theta", "beta", "beta_next", "last", "least", "accepted", "trials",
    "relaxation", "rounding", "most_rise",
)  # fmt: skip
"""the scalars of `state`, in the order of kernels.cl"""
AT = {name: np.uint32(k) for k, name in enumerate(STATE)}
RECORD = 7
FIRST_X = 2
CHUNK = 25
"""iterations between two reads: a quarter of those after which u is formed from scratch"""
PLACES = {"gpu": 10_000_000, "cpu": 400_000, "accelerator": 400_000}
"""contacts and rows times iterations of a chunk, by kind of device: 2 to 10 ms without a look at the clock"""


def tiles(n: int) -> int:
    return -(-n // TILE)


def packed(
    backend: Backend, memory: Memory, problem: _core.Problem, threads: int
) -> tuple[_core.DeviceLayout, dict[str, Any], dict[str, Any]]:
    """The layout of a problem, its arrays, and buffers with them. Only arrays that differ from those of the
    last problem in this memory are sent."""
    there, memory.there = memory.there, set()  # an exception leaves buffers of which nothing is known
    if memory.layout is None:
        memory.layout = _core.DeviceLayout(problem, threads, backend.host_memory)
    else:
        memory.layout.fill(problem, threads)
    there -= set(memory.layout.changed())
    arrays = memory.layout.arrays()
    held = {
        name: memory.buffer(name, values.nbytes) if name in there else memory.filled(name, values)
        for name, values in arrays.items()
    }
    memory.there = set(held)
    return memory.layout, arrays, held


class DeviceMethod:
    """P-SPG-FB or APGD for one problem, whose vectors and scalars stay on a device.

    An iteration launches direction, bodies, a decision, update, and another decision; bodies with long lists
    take two launches more. A read follows `CHUNK` iterations, or fewer where u is to be formed from scratch.
    """

    def __init__(
        self, problem: _core.Problem, law: _core.Law, backend: Backend, memory: Memory, *, threads: int = 0
    ) -> None:
        layout, arrays, held = packed(backend, memory, problem, threads)
        self._layout = layout
        self._backend, self._memory = backend, memory
        self.launches = self.reads = 0
        flags = (law == _core.Law.coulomb) + 2 * layout.compliant + 4 * layout.stored
        self._flags = np.uint32(flags)
        self._sizes = tuple(
            map(np.uint32, (layout.contacts, layout.rows, layout.stride, layout.row_stride, flags))
        )
        self._fill(arrays, held)
        self._b = held["b"]
        places = max(1, layout.contacts + layout.rows)
        self._most = max(1, min(CHUNK, PLACES[backend.device.kind] // places))

    def _fill(self, arrays: dict[str, Any], held: dict[str, Any]) -> None:
        """Buffers of the passes beside those of the layout, and what all launches have in common."""
        layout, memory = self._layout, self._memory
        self._parts, self._large = len(arrays["parts"]) // 4, len(arrays["large"]) // 3
        self._tiles = max(1, tiles(layout.contacts) + tiles(layout.rows))
        self._body_tiles = max(1, tiles(layout.bodies))
        lines = memory.buffer("lines", 64 * (layout.bodies + 1))
        memory.filled("lines", np.zeros(8))  # of the world
        part_lines = memory.buffer("part_lines", 64 * self._parts)
        self._partial = memory.buffer("partial", 8 * (3 * self._tiles + self._body_tiles + self._large))
        self._state = memory.buffer("state", 8 * (len(STATE) + RECORD * CHUNK))
        n, m = np.uint32(len(arrays["contact_list"])), np.uint32(len(arrays["row_list"]))
        list_arm, list_row = memory.buffer("list_arm", 24 * int(n)), memory.buffer("list_row", 48 * int(m))
        lists = (held["contact_list"], list_arm, n, held["row_list"], list_row, m)
        ahead, apart = (0, layout.size) if layout.stored else (3 * layout.stride, layout.row_stride)
        of_contacts = (held["contact"], np.uint32(layout.stride), held["contact_list"], list_arm, n)
        of_rows = (held["jacobian"], np.uint32(apart), np.uint32(ahead), held["row_list"], list_row, m)
        self._run([("list_arms", max(1, tiles(int(n))), of_contacts),
                   ("list_rows", max(1, tiles(int(m))), of_rows)])  # fmt: skip
        mass = (held["mass"], np.uint32(layout.line_stride), lines, self._partial)
        begin, stride = np.uint32(3 * self._tiles), np.uint32(layout.stride)
        self._bodies_rest = (stride, held["first"], *lists[:3], held["first_row"], *lists[3:], *mass, begin,
                             np.uint32(layout.bodies))  # fmt: skip
        self._parts_rest = (stride, *lists, held["parts"], part_lines, np.uint32(self._parts))
        self._large_rest = (held["large"], part_lines, *mass, np.uint32(begin + self._body_tiles))
        self._contact_row = held["contact"], held["row"]
        self._constants = *self._contact_row, held["line"], held["jacobian"], lines

    # Launches and reads.

    def _run(self, launches: list[Launch]) -> None:
        self.launches += len(launches)
        for kernel, groups, arguments in launches:
            self._backend.launch(kernel, groups, *arguments)

    def _pass(self, kernel: str, *arguments: Any) -> Launch:
        """A pass over contacts and rows."""
        return kernel, self._tiles, (*self._vectors, *arguments, self._partial, *self._sizes)

    def _decision(self, kernel: str, *arguments: Any) -> Launch:
        return kernel, 1, (self._partial, self._state, *arguments)

    def _bodies(self, vector: str) -> list[Launch]:
        """Velocities M^-1 D'v, and the partial sums of <D'v, M^-1 D'v>."""
        which = (*self._vectors, AT[vector])
        launches: list[Launch] = [("bodies", self._body_tiles, (*which, *self._bodies_rest))]
        if self._large:
            launches.append(("parts", max(1, tiles(self._parts)), (*which, *self._parts_rest)))
            launches.append(("large", self._large, (self._state, *self._large_rest)))
        return launches

    def _iteration(self, method: str) -> list[Launch]:
        count, last = np.uint32(self._tiles), np.uint32(self._body_tiles + self._large)
        if method == "apgd":
            return [
                self._pass("momentum_direction", *self._contact_row),
                *self._bodies("vector_d"),
                self._decision("decide_momentum", count, last, self._flags),
                self._pass("accelerate", *self._constants),
                self._decision("decide_beta", count),
            ]
        return [
            self._pass("direction", *self._contact_row),
            *self._bodies("vector_d"),
            self._decision("decide_lambda", self._values, count, last),
            self._pass("update", *self._constants),
            self._decision("decide_alpha", self._values, count),
        ]

    def _read(self) -> Array:
        """Waits for all that was launched."""
        self.reads += 1
        values = self._backend.download(self._state, 0, len(STATE) + RECORD * CHUNK)
        self._now, self._best = int(values[AT["now"]]), int(values[AT["best"]])
        return values

    def _vector(self, number: int) -> Array:
        size = self._layout.size
        return self._layout.to_user(self._backend.download(self._vectors[1], number * size, size))

    # The functions of amontons::AnyMethod, which a solve calls.

    def start(self, method: str, x0: Array, settings: Mapping[str, float]) -> float:
        """x = Pi_K(x0), (m,), and u = A x + b; the squared natural map. settings: scalars of `state`."""
        layout, memory = self._layout, self._memory
        momentum, size = method == "apgd", layout.size
        vectors = memory.buffer("vectors", 8 * size * (7 if momentum else 5))
        self._vectors = self._state, vectors, np.uint32(size)
        state = np.zeros(len(STATE) + RECORD * CHUNK)
        places = {
            "now": FIRST_X,
            "before": FIRST_X,
            "best": FIRST_X,
            "u": 1,
            "u_before": 6 if momentum else 1,
        }
        start = {
            "infinite": np.inf,
            "least_map": np.inf,
            "least": np.inf,
            "period": np.inf,
            **places,
            **settings,
        }
        for name, value in start.items():
            state[AT[name]] = value
        memory.filled("state", state)
        if not momentum:
            values = np.full(int(start["memory"]), -np.inf)
            values[0] = 0
            self._values = memory.filled("values", values)
        memory.upload(vectors, layout.start(x0), FIRST_X * size)
        self._momentum = momentum
        self._iterate = self._iteration(method)
        self._program = self._backend.program(self._iterate * self._most) if self._most > 1 else None
        self._run(self._refreshed("now", "u", fresh=True))
        if momentum:
            count = np.uint32(size)
            self._run([("copy", max(1, tiles(size)), (vectors, np.uint32(size), np.uint32(6 * size), count))])
        return float(self._read()[AT["sum"]])

    def _refreshed(self, x: str, u: str, *, fresh: bool) -> list[Launch]:
        launches = [*self._bodies(x), self._pass("refresh", AT[x], AT[u], *self._constants, self._b)]
        if fresh:
            launches.append(self._decision("collect", np.uint32(self._tiles), np.uint32(1)))
        return launches

    def advance(self, most: int) -> Array:
        """Makes up to `most` iterations; their records, (n, 7), none where no direction descends."""
        while True:
            self._run([("allow", 1, (self._state, np.float64(min(most, self._most))))])
            if most > 1 and self._program is not None:
                self.launches += len(self._iterate) * self._most
                self._program()
            else:
                self._run(self._iterate)
            state = self._read()
            if state[AT["count"]] or state[AT["stop"]]:
                return state[len(STATE) :].reshape(-1, RECORD)[: int(state[AT["count"]])]

    def refresh(self) -> float:
        """u from scratch, of the extrapolated point as well; the squared natural map at x."""
        self._run([("allow", 1, (self._state, np.float64(0)))])
        if self._momentum:
            self._run(self._refreshed("before", "u_before", fresh=False))
        self._run(self._refreshed("now", "u", fresh=True))
        return float(self._read()[AT["sum"]])

    def extract_best(self) -> Array:
        """The x with the smallest residual, (m,), in the order of the problem."""
        return self._vector(self._best)

    def extract(self) -> Array:
        """The current x, likewise."""
        return self._vector(self._now)

    def objective(self) -> float:
        """1/2 x'A x + b'x (J) of the current x."""
        self._run(
            [
                self._pass("objective", self._b),
                self._decision("collect", np.uint32(self._tiles), np.uint32(0)),
            ]
        )
        return 0.5 * float(self._read()[AT["sum"]])
