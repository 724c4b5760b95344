"""The passes on a device: kernels.cl by a backend, two reads of four numbers per iteration."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import _core
from ..checks import Array
from .backend import Backend, Memory

TILE = 256
"""places that a work group serves, as kernels.cl has it"""
SUMS = 4


def tiles(n: int) -> int:
    return -(-n // TILE)


class DeviceIterate:
    """An `amontons.vi.Iterate` whose vectors stay on a device.

    An iteration launches direction, bodies and collect, reads four numbers, launches update and collect, and
    reads four again; bodies with long lists take two launches more.
    """

    def __init__(self, problem: _core.Problem, law: _core.Law, backend: Backend, memory: Memory) -> None:
        self._layout = layout = _core.DeviceLayout(problem)
        self._backend, self._memory = backend, memory
        self.launches = self.bytes_read = 0
        coulomb, stored = law == _core.Law.coulomb, layout.stored
        self._sizes = tuple(
            map(
                np.uint32,
                (
                    *(layout.contacts, layout.rows, layout.stride, layout.row_stride),
                    coulomb + 2 * layout.compliant + 4 * stored,
                ),
            )
        )
        self._fill(layout.arrays())
        self._b = memory.filled("b", layout.to_passes(problem.b))
        self._now = self._best = self._before = 0
        self._beta = np.float64(0)

    def _fill(self, arrays: dict[str, Any]) -> None:
        layout, memory = self._layout, self._memory
        held = {name: memory.filled(name, values) for name, values in arrays.items()}
        self._parts, self._large = len(arrays["parts"]) // 4, len(arrays["large"]) // 3
        self._tiles = max(1, tiles(layout.contacts) + tiles(layout.rows))
        self._body_tiles = max(1, tiles(layout.bodies))
        size = 8 * layout.size
        self._x = [memory.buffer(f"x{k}", size) for k in range(3)]
        self._u, self._d = memory.buffer("u", size), memory.buffer("d", size)
        lines = memory.buffer("lines", 64 * (layout.bodies + 1))
        memory.filled("lines", np.zeros(8))  # of the world
        part_lines = memory.buffer("part_lines", 64 * self._parts)
        self._partial = memory.buffer("partial", 8 * (3 * self._tiles + self._body_tiles + self._large))
        self._scalars = memory.buffer("scalars", 8 * SUMS)
        n, m = np.uint32(len(arrays["contact_list"])), np.uint32(len(arrays["row_list"]))
        lists = (held["contact_list"], held["list_arm"], n, held["row_list"], held["list_row"], m)
        mass = (held["mass"], np.uint32(layout.line_stride), lines, self._partial)
        begin, stride = np.uint32(3 * self._tiles), np.uint32(layout.stride)
        self._bodies_rest = (stride, held["first"], *lists[:3], held["first_row"], *lists[3:], *mass, begin,
                             np.uint32(layout.bodies))  # fmt: skip
        self._parts_rest = (stride, *lists, held["parts"], part_lines, np.uint32(self._parts))
        self._large_all = (held["large"], part_lines, *mass, np.uint32(begin + self._body_tiles))
        self._contact_row = held["contact"], held["row"]
        self._constants = *self._contact_row, held["line"], held["jacobian"], lines

    # Launches and reads.

    def _launch(self, kernel: str, groups: int, *arguments: Any) -> None:
        self.launches += 1
        self._backend.launch(kernel, groups, *arguments)

    def _bodies(self, vector: Any) -> None:
        """Velocities M^-1 D'v, and the partial sums of <D'v, M^-1 D'v>."""
        self._launch("bodies", self._body_tiles, vector, *self._bodies_rest)
        if self._large:
            self._launch("parts", max(1, tiles(self._parts)), vector, *self._parts_rest)
            self._launch("large", self._large, *self._large_all)

    def _sums(self, *, bodies: bool = False) -> list[float]:
        """The sums of the last pass, and fourth that of `_bodies`."""
        last = self._body_tiles + self._large if bodies else 0
        self._launch("collect", SUMS, self._partial, self._scalars, np.uint32(self._tiles), np.uint32(last))
        self.bytes_read += 8 * SUMS
        return self._backend.download(self._scalars, SUMS).tolist()

    def _free(self) -> int:
        """A buffer of x that holds neither the current nor the best one, nor that before."""
        taken = {self._now, self._best, self._before}
        return next(k for k in range(len(self._x)) if k not in taken)

    # The passes.

    def start(self, x0: Array) -> float:
        """See `amontons.vi.Iterate`."""
        self._best = self._before = self._now
        x = self._layout.to_passes(self._layout.projected(x0))
        self._backend.upload(self._x[self._now], x) if len(x) else None
        return self.refresh()

    def _refreshed(self, x: Any, u: Any) -> float:
        self._bodies(x)
        self._launch("refresh", self._tiles, *self._constants, x, u, self._b, self._partial, *self._sizes)
        return self._sums()[0]

    def refresh(self) -> float:
        """See `amontons.vi.Iterate`."""
        return self._refreshed(self._x[self._now], self._u)

    def direction(self, alpha: float) -> tuple[float, float]:
        """See `amontons.vi.Iterate`; <d, A d> is read with it."""
        self._launch("direction", self._tiles, *self._contact_row, self._x[self._now], self._u, self._d,
                     self._partial, np.float64(alpha), *self._sizes)  # fmt: skip
        self._bodies(self._d)
        dg, dPd, dEd, work = self._sums(bodies=True)
        self._dAd = work + dEd
        return dg, dPd

    def curvature(self) -> float:
        """See `amontons.vi.Iterate`."""
        return self._dAd

    def update(self, lam: float) -> tuple[float, float, float]:
        """See `amontons.vi.Iterate`."""
        self._before = self._now
        target = self._free()
        self._launch("update", self._tiles, *self._constants, self._x[self._now], self._x[target], self._u,
                     self._d, self._partial, np.float64(lam), *self._sizes)  # fmt: skip
        self._now = self._before = target
        sy, yPy, residual_squared, _ = self._sums()
        return sy, yPy, residual_squared

    def start_momentum(self) -> None:
        """See `amontons.vi.Iterate`."""
        size = 8 * self._layout.size
        if len(self._x) < 4:
            self._x.append(self._memory.buffer("x3", size))
        self._u_before = self._memory.buffer("u_before", size)
        count = np.uint32(self._layout.size)
        self._launch("copy", max(1, tiles(self._layout.size)), self._u, self._u_before, count)
        self._before, self._beta = self._now, np.float64(0)

    def momentum_direction(self, alpha: float) -> tuple[float, float]:
        """See `amontons.vi.Iterate`; <d, A d> is read with it."""
        self._launch("momentum_direction", self._tiles, *self._contact_row, self._x[self._now],
                     self._x[self._before], self._u, self._u_before, self._d, self._partial,
                     np.float64(alpha), self._beta, *self._sizes)  # fmt: skip
        self._bodies(self._d)
        dPd, dPm, dEd, work = self._sums(bodies=True)
        self._dAd = work + dEd
        return dPd, dPm

    def accelerate(self, beta: float) -> float:
        """See `amontons.vi.Iterate`."""
        target = self._free()
        self._launch("accelerate", self._tiles, *self._constants, self._x[self._now], self._x[self._before],
                     self._x[target], self._u, self._u_before, self._d, self._partial, self._beta,
                     *self._sizes)  # fmt: skip
        self._before, self._now, self._beta = self._now, target, np.float64(beta)
        self._u, self._u_before = self._u_before, self._u
        return self._sums()[0]

    def refresh_momentum(self) -> float:
        """See `amontons.vi.Iterate`."""
        self._refreshed(self._x[self._before], self._u_before)
        return self.refresh()

    def keep_best(self) -> None:
        """See `amontons.vi.Iterate`."""
        self._best = self._now

    def _read(self, x: Any) -> Array:
        return self._layout.to_user(self._backend.download(x, self._layout.size))

    def extract_best(self) -> Array:
        """See `amontons.vi.Iterate`."""
        return self._read(self._x[self._best])

    def extract(self) -> Array:
        """See `amontons.vi.Iterate`."""
        return self._read(self._x[self._now])

    def objective(self) -> float:
        """See `amontons.vi.Iterate`."""
        self._launch(
            "objective", self._tiles, self._x[self._now], self._u, self._b, self._partial, *self._sizes
        )
        return 0.5 * self._sums()[0]
