"""Parameters of a model from recorded motion: nonlinear least squares over short pieces of it.

Each piece starts at a measured state and is simulated with the measured controls. So an error does not grow
beyond a piece, however chaotic the motion is. All pieces of all changed parameters advance in one rollout.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..checks import Array, flag, integer, number, positive, reals, shown
from ..errors import InputError, ModelWarning
from ..guidance import former_names
from ..io.recordings.recording import Recording
from ..model.model import Model, no_model
from ..model.quantities import parameter, values_of
from ..simulation.derivative import with_values
from ..simulation.rollout import rollout
from ..simulation.simulation import Simulation
from ..simulation.tangent import angles, difference

CHANGE = 1e-4
"""Relative: by which parameters change for differences. Large enough to pass over rounding of many steps."""
JUMP = 0.5
"""Relative: slopes to both sides that differ by more have an event of a contact between them."""
UNSEEN = 1e-9
"""Relative: a parameter whose whole change moves the residuals by less has no influence."""
NOTHING = 1e-9
"""A parameter below counts as zero."""
OUTLIER = 3.0
"""Standard deviations of residuals, from where `robust` counts them less."""
LIMITS = {"restitution": (0.0, 1.0), "gain": (-np.inf, np.inf)}
"""Bounds by default; of all others 0 to infinity."""


@dataclass(frozen=True)
class Motion:
    """Measured coordinates over time, in equal steps of time.

    >>> time = np.linspace(0, 1, 201)[:, None]
    >>> motion = Motion(q=np.sin(time), qd=np.cos(time), interval=5e-3)
    """

    q: ArrayLike
    """(frames, nq), as `Simulation.q`"""
    qd: ArrayLike
    """(frames, nv), as `Simulation.qd`"""
    controls: ArrayLike | None = None
    """(frames, controls): those that led to the frame; None: those of the model"""
    interval: float = 5e-3
    """time between two frames (s)"""


@former_names(unseen="not_identifiable")
@dataclass(frozen=True)
class Fit:
    """Estimates of parameters, as `identify` returns them.

    >>> model = scenes.make("pendulum").with_(damping={"hinge": 0.1})
    >>> run = rollout(model.with_(damping={"hinge": 0.2}), [[1.0, 0.0]], steps=100)
    >>> fit = identify(model, Motion(run.q[0], run.qd[0]), ["damping:hinge"])
    >>> round(fit["damping:hinge"], 2), fit.not_identifiable
    (0.2, ())
    """

    parameters: tuple[str, ...]
    """their names, as they were given"""
    values: Array
    """(parameters,), the estimates"""
    deviations: Array
    """(parameters,), standard deviations of the estimates; infinite without influence"""
    covariance: Array
    """(parameters, parameters), from the residuals and their derivatives"""
    residuals: Array
    """simulated less measured, of all pieces that were fitted: changes along qd (rad, and m over
    `Model.length`)"""
    error: float
    """root mean square of the residuals"""
    held_out: float
    """the same of the pieces that were held out; NaN without any"""
    held_out_before: float
    """the same with the parameters of the model as it was given"""
    not_identifiable: tuple[str, ...]
    """parameters without influence on the motion, which keep their values"""
    model: Model
    """the variant with the estimates"""
    simulated: Array
    """(pieces, frames, nq), from the start of each fitted piece"""
    measured: Array
    """(pieces, frames, nq)"""
    interval: float
    """s, between two frames"""

    def __getitem__(self, name: str) -> float:
        """The estimate of a parameter by its name."""
        if name not in self.parameters:
            raise InputError(f"{shown(name)} was not fitted; known are {', '.join(self.parameters)}")
        return float(self.values[self.parameters.index(name)])

    def plot(self, path: str) -> None:
        """Draw measured and simulated coordinates of the pieces into a file (needs amontons[cli])."""
        import matplotlib.pyplot as plt

        names = self.model.q_names
        figure, axes = plt.subplots(len(names), 1, sharex=True, squeeze=False, figsize=(8, 1.6 * len(names)))
        frames = self.measured.shape[1]
        for piece in range(len(self.measured)):
            times = self.interval * (piece * frames + np.arange(frames))
            for k, axis in enumerate(axes[:, 0]):
                axis.plot(times, self.measured[piece, :, k], color="0.6")
                axis.plot(times, self.simulated[piece, :, k], color="C0", linewidth=0.8)
        for name, axis in zip(names, axes[:, 0], strict=True):
            axis.set_ylabel(name)
        axes[-1, 0].set_xlabel("s, pieces one after the other")
        figure.savefig(path, bbox_inches="tight")
        plt.close(figure)

    def __repr__(self) -> str:
        found = ", ".join(
            f"{name} = {value:.4g} +- {spread:.1g}"
            for name, value, spread in zip(self.parameters, self.values, self.deviations, strict=True)
        )
        return f"amontons.results.Fit({found}; error {self.error:.2g}, held out {self.held_out:.2g})"


def identify(
    model: Model,
    data: Recording | Motion | Sequence[Recording | Motion],
    parameters: Iterable[str],
    *,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    robust: bool = True,
    piece: int = 20,
    holdout: float = 0.2,
    dt: float | None = None,
    threads: int | None = None,
    **options: Any,
) -> Fit:
    """Parameters with which a model moves as it was recorded, by nonlinear least squares.

    model: the start, with parameters near the right ones. data: recordings, or arrays as `Motion`.
    parameters: names as "friction:foot", "mass:link2", "damping:elbow", "armature:*", "gain:servo",
        "restitution:cube": a quantity of `Model.with_` and a name or pattern, all with one value.
    bounds: (lower, upper) by name of parameter; by default from 0, restitution to 1, gains without.
    robust: whether large residuals, as of contacts that came at another time, count less (soft l1).
    piece: frames that are simulated from each measured state on.
    holdout: share of the pieces that are not fitted, spread evenly, for `Fit.held_out`.
    dt: time step (s); by default that of the recording, or the interval of the frames. An interval is made of
        whole steps.
    options: further ones of the simulations; of recordings theirs.

    Derivatives are differences of whole pieces, so that contacts may begin and end in them. Warns
    (ModelWarning) of parameters without influence on the motion. Raises InputError naming the argument.

    >>> model = scenes.make("pendulum").with_(damping={"hinge": 0.1})
    >>> run = rollout(model.with_(damping={"hinge": 0.2}), [[1.0, 0.0]], steps=100)
    >>> fit = identify(model, Motion(run.q[0], run.qd[0]), ["damping:hinge"])
    >>> better = fit.model
    """
    if not isinstance(model, Model):
        raise no_model("model", model)
    names = [parameters] if isinstance(parameters, str) else list(parameters)
    if not names:
        raise InputError("parameters is empty; name some, as ['damping:elbow']")
    given = list(data) if isinstance(data, Sequence) else [data]
    pieces = _pieces(model, given, integer("piece", piece, 1), dt, options)
    share = number("holdout", holdout)
    if not 0 <= share < 1:
        raise InputError(f"holdout = {share:g}; it must be from 0 to below 1")
    fitted, kept = _split(pieces, share)
    start = np.array([np.mean(values_of(*_place(model, name))) for name in names])
    lower, upper = _bounds(names, bounds, start)
    problem = _Problem(model, names, fitted, threads)
    slope = problem.jacobian(start)
    not_identifiable = _not_identifiable(names, slope, start, problem)
    free = np.array([name not in not_identifiable for name in names])
    values = _estimate(problem, start, free, (lower, upper), flag("robust", robust))
    return _fit(problem, values, start, free, kept, not_identifiable)


def _estimate(
    problem: _Problem, start: Array, free: Array, bounds: tuple[Array, Array], robust: bool
) -> Array:
    """The parameters with the least residuals; those that are not free keep their values."""
    from scipy.optimize import least_squares

    if not free.any():
        return start.copy()

    def full(x: Array) -> Array:
        whole = start.copy()
        whole[free] = x
        return whole

    def solve(x: Array, loss: str, scale: float) -> Array:
        # The first step is as long as x: from 0, the usual bound, the optimiser would stop at once.
        inside = np.clip(np.where(np.abs(x) > NOTHING, x, CHANGE), bounds[0][free], bounds[1][free])
        return least_squares(
            lambda x: problem.residuals(full(x)),
            inside,
            jac=lambda x: problem.jacobian(full(x))[:, free],
            bounds=(bounds[0][free], bounds[1][free]),
            x_scale="jac",
            loss=loss,
            f_scale=scale,
        ).x

    found = solve(start[free], "linear", 1.0)
    if robust:
        # 1.4826 times the median is the standard deviation of normal residuals, whatever outliers there are.
        spread = OUTLIER * 1.4826 * float(np.median(np.abs(problem.residuals(full(found)))))
        if spread > 0:
            found = solve(found, "soft_l1", spread)
    return full(found)


def _place(model: Model, name: str) -> tuple[str, Model, list[int]]:
    what, at = parameter(model, name)
    return what, model, at


@dataclass(frozen=True)
class _Pieces:
    """Short measured motions of equal length."""

    starts: Array
    """(pieces, nq + nv)"""
    q: Array
    """(pieces, frames, nq), after the start"""
    controls: Array | None
    """(pieces, frames, controls)"""
    interval: float
    repeat: int
    """steps of a frame"""
    options: dict[str, Any]

    def some(self, rows: Any) -> _Pieces:
        controls = None if self.controls is None else self.controls[rows]
        return _Pieces(self.starts[rows], self.q[rows], controls, self.interval, self.repeat, self.options)


class _Problem:
    """Residuals of the pieces over parameters."""

    def __init__(self, model: Model, names: list[str], pieces: _Pieces, threads: int | None) -> None:
        self.model, self.names, self.pieces, self.threads = model, names, pieces, threads
        self.scale = np.where(angles(model), 1.0, 1 / model.length)
        self.places = [parameter(model, name)[1] for name in names]
        self._last: tuple[bytes, Array] = (b"", np.zeros(0))

    def variant(self, values: Array) -> Model:
        each = {
            name: [float(value)] * len(at)
            for name, value, at in zip(self.names, values, self.places, strict=True)
        }
        return with_values(self.model, each)

    def simulated(self, sets: Sequence[Array]) -> Array:
        """(sets, pieces, frames, nq) for several sets of parameters."""
        pieces, many = self.pieces, len(self.pieces.starts)
        models = [variant for values in sets for variant in [self.variant(values)] * many]
        controls = None if pieces.controls is None else np.tile(pieces.controls, (len(sets), 1, 1))
        with warnings.catch_warnings(action="ignore", category=ModelWarning):
            result = rollout(
                models,
                np.tile(pieces.starts, (len(sets), 1)),
                controls,
                steps=None if controls is not None else pieces.q.shape[1],
                repeat=pieces.repeat,
                threads=self.threads,
                on_failure="ignore",
                **pieces.options,
            )
        return result.q.reshape(len(sets), many, *result.q.shape[1:])

    def errors(self, simulated: Array) -> Array:
        """Residuals, (pieces * frames * nv,), of one set of parameters."""
        measured = self.pieces.q.reshape(-1, self.model.nq)
        found = difference(self.model, measured, simulated.reshape(measured.shape)) * self.scale
        worst = float(np.nanmax(np.abs(found), initial=1.0))
        return np.nan_to_num(found, nan=10 * worst).ravel()  # of worlds whose velocities were not finite

    def residuals(self, values: Array) -> Array:
        key = values.tobytes()
        if self._last[0] != key:
            self._last = key, self.errors(self.simulated([values])[0])
        return self._last[1]

    def jacobian(self, values: Array) -> Array:
        """(residuals, parameters), by differences that stay above zero."""
        sets, ends = [], []
        for k, value in enumerate(values):
            by = CHANGE * abs(value) if value else CHANGE
            low = value - by if value > by or self.names[k].startswith("gain:") else value
            ends.append((low, value + by))
            for at in ends[-1]:
                changed = values.copy()
                changed[k] = at
                sets.append(changed)
        moved, here = [self.errors(q) for q in self.simulated(sets)], self.residuals(values)
        columns = []
        for k, (low, high) in enumerate(ends):
            down, up = moved[2 * k], moved[2 * k + 1]
            columns.append(_slope(down, here, up, values[k] - low, high - values[k]))
        return np.array(columns).T


def _slope(down: Array, here: Array, up: Array, below: float, above: float) -> Array:
    """Slopes of residuals between both sides. Where a contact comes a step later on one side, residuals jump,
    which is no slope: the smaller one of both is then that of the other side.
    """
    central = (up - down) / (above + below)
    if below == 0:
        return central
    right, left = (up - here) / above, (here - down) / below
    smaller = np.where(np.abs(right) < np.abs(left), right, left)
    return np.where(np.abs(right - left) > JUMP * np.abs(smaller), smaller, central)


def _pieces(model: Model, data: list[Any], length: int, dt: float | None, options: dict[str, Any]) -> _Pieces:
    motions = [_motion(model, given, options) for given in data]
    if not motions:
        raise InputError("data is empty; give a recording, or a Motion")
    interval = float(motions[0].interval)
    step = float(motions[0].step if dt is None else positive("dt", dt))
    repeat = max(1, round(interval / step))
    if abs(repeat * step - interval) > 1e-6 * interval:
        raise InputError(
            f"dt = {step:g} s does not divide the interval {interval:g} s between two frames; "
            f"give dt = {interval / repeat:g} s"
        )
    starts, q, controls = [], [], []
    for motion in motions:
        if abs(motion.interval - interval) > 1e-6 * interval:
            raise InputError(
                f"the motions have intervals of {interval:g} s and {motion.interval:g} s; call "
                "identify for each interval, or resample"
            )
        for first in range(0, len(motion.q) - length, length):
            rows = slice(first + 1, first + 1 + length)
            starts.append(np.concatenate([motion.q[first], motion.qd[first]]))
            q.append(motion.q[rows])
            controls.append(None if motion.controls is None else motion.controls[rows])
    if not starts:
        raise InputError(f"no motion has more than piece = {length} frames; give a shorter piece")
    driven = None if controls[0] is None else np.array(controls)
    merged = {**motions[0].options, **options, "dt": step}
    return _Pieces(np.array(starts), np.array(q), driven, interval, repeat, merged)


@dataclass(frozen=True)
class _Checked:
    q: Array
    qd: Array
    controls: Array | None
    interval: float
    step: float
    options: dict[str, Any]


def _motion(model: Model, given: Any, options: dict[str, Any]) -> _Checked:
    if isinstance(given, Recording):
        return _of_recording(model, given)
    if not isinstance(given, Motion):
        raise InputError(f"data is a {type(given).__name__}; give a Recording, or a Motion of arrays")
    q, qd = reals("q", given.q), reals("qd", given.qd)
    controls = None if given.controls is None else reals("controls", given.controls)
    _check_shapes(model, q, qd, controls)
    interval = positive("interval", given.interval)
    return _Checked(q, qd, controls, interval, interval, {})


def _of_recording(model: Model, given: Recording) -> _Checked:
    steps = np.diff(given.steps)
    if not len(steps) or (steps != steps[0]).any():
        raise InputError(f"{given!r} has frames in unequal steps; record with a constant every=")
    q, qd = given.q[...], given.qd[...]
    controls = given.controls[...] if len(model.control_names) else None
    _check_shapes(model, q, qd, controls)
    known = Simulation(model).options
    own = {n: v for n, v in given.options.items() if n in known and n not in ("dt", "on_failure", "threads")}
    own = {n: v for n, v in own.items() if n != "method" or isinstance(v, str)}
    dt = float(given.options["dt"])
    return _Checked(q, qd, controls, dt * int(steps[0]), dt, own)


def _check_shapes(model: Model, q: Array, qd: Array, controls: Array | None) -> None:
    count = len(q)
    asked = [("q", q, model.nq), ("qd", qd, model.nv)]
    if controls is not None:
        asked.append(("controls", controls, len(model.control_names)))
    for what, values, size in asked:
        if values.shape != (count, size):
            raise InputError(f"{what} has the shape {values.shape}; the model asks for ({count}, {size})")
        if not np.isfinite(values).all():
            raise InputError(f"{what} of frame {np.argwhere(~np.isfinite(values))[0, 0]} is not finite")


def _split(pieces: _Pieces, share: float) -> tuple[_Pieces, _Pieces | None]:
    """The pieces to fit, and those that are held out: the middle ones of equal groups."""
    count = len(pieces.starts)
    kept = min(count - 1, round(share * count)) if count > 1 else 0
    if kept == 0:
        return pieces, None
    out = np.zeros(count, dtype=bool)
    out[((np.arange(kept) + 0.5) * count / kept).astype(int)] = True
    return pieces.some(~out), pieces.some(out)


def _bounds(
    names: list[str], given: Mapping[str, tuple[float, float]] | None, start: Array
) -> tuple[Array, Array]:
    given = given or {}
    if unknown := set(given) - set(names):
        raise InputError(f"bounds: {min(unknown)} is no parameter of the fit; known are {', '.join(names)}")
    pairs = [given.get(name, LIMITS.get(name.split(":", 1)[0], (0.0, np.inf))) for name in names]
    for name, pair, value in zip(names, pairs, start, strict=True):
        if len(pair) != 2 or not pair[0] < pair[1]:
            raise InputError(f"bounds of {name} are {shown(pair)}; give (lower, upper)")
        if not pair[0] <= value <= pair[1]:
            raise InputError(f"{name} is {value:g} in the model, outside of its bounds {shown(pair)}")
    lower, upper = np.array(pairs, dtype=np.float64).T
    return lower, upper


def _not_identifiable(names: list[str], slope: Array, start: Array, problem: _Problem) -> tuple[str, ...]:
    influence = np.linalg.norm(slope, axis=0) * np.where(start > 0, start, 1.0)
    moved = np.linalg.norm(problem.scale) * np.sqrt(problem.pieces.q.shape[0] * problem.pieces.q.shape[1])
    not_identifiable = tuple(
        name for name, size in zip(names, influence, strict=True) if size <= UNSEEN * moved
    )
    if not_identifiable:
        warnings.warn(
            f"no influence on the motion: {', '.join(not_identifiable)}; record motion in which they act",
            ModelWarning,
            stacklevel=3,
        )
    return not_identifiable


def _fit(
    problem: _Problem,
    values: Array,
    start: Array,
    free: Array,
    kept: _Pieces | None,
    not_identifiable: tuple[str, ...],
) -> Fit:
    names = problem.names
    residuals = problem.residuals(values)
    slope = problem.jacobian(values)[:, free]
    covariance = np.full((len(names), len(names)), np.inf)
    variance = float(residuals @ residuals) / max(1, len(residuals) - int(free.sum()))
    covariance[np.ix_(free, free)] = variance * np.linalg.pinv(slope.T @ slope)
    held = before = float("nan")
    if kept is not None:
        other = _Problem(problem.model, names, kept, problem.threads)
        held, before = (float(np.sqrt(np.mean(other.residuals(v) ** 2))) for v in (values, start))
    return Fit(
        tuple(names),
        values,
        np.sqrt(np.diag(covariance)),
        covariance,
        residuals,
        float(np.sqrt(np.mean(residuals**2))),
        held,
        before,
        not_identifiable,
        problem.variant(values),
        problem.simulated([values])[0],
        problem.pieces.q,
        problem.pieces.interval,
    )
