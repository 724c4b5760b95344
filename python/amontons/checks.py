"""Checks of user input: values are converted to one form, or refused with a message that names them.

`what` in these functions is how the message calls the value: "body "wheel": mass", "Box: half".
"""

from __future__ import annotations

import copy
import difflib
import math
import numbers
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from itertools import islice
from types import MappingProxyType
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .errors import InputError
from .ranges import FARTHEST, LARGEST, MOST_COUNT, OPTIONS

Array = NDArray[np.float64]
Vector3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
"""w, x, y, z"""
Numbers = Sequence[float] | NDArray[Any]
"""Input for a vector: a tuple, a list or an array."""
Matrix3 = tuple[Vector3, Vector3, Vector3]
T = TypeVar("T")

NO_TERMS: Mapping[str, str] = MappingProxyType({})
LONGEST_TEXT = 100_000
"""Limit for descriptions and names (characters); names of parts can have a lower one."""
UNIT = 1e-6
"""|length - 1| up to which a quaternion counts as a unit quaternion with rounding and is normalised."""
EXACT = 1e-15
"""|length - 1| of what was normalised: it stays as it is, bit for bit, when it is read back from a file."""


def suggestion(name: object, known: Iterable[str], terms: Mapping[str, str] = NO_TERMS) -> str:
    """(did you mean 'x'?) for a name that is nearly a known one, else nothing: goes inside a message.

    terms: what others call a thing -> what it is called here.
    """
    if not isinstance(name, str) or len(name) > 80:
        return ""
    known = list(known)
    ours = terms.get(name.lower().replace("_", "-").replace(" ", "-"))
    if ours in known:
        return f" (here it is called {ours!r})"
    close = difflib.get_close_matches(name, known, n=1, cutoff=0.6)
    return f" (did you mean {close[0]!r}?)" if close else ""


def chosen(what: str, name: object, known: Mapping[str, T], terms: Mapping[str, str] = NO_TERMS) -> T:
    """Returns the entry of `name` among the known names; terms: as in `suggestion`."""
    if not isinstance(name, str) or name not in known:
        raise InputError(
            f"unknown {what} {shown(name)}{suggestion(name, known, terms)}; known are {', '.join(known)}"
        )
    return known[name]


def number(what: str, value: Any, *, infinite: bool = False, most: float = LARGEST) -> float:
    """`value` as a float of at most `most` in size; `infinite`: it may be anything but NaN."""
    if type(value) is not float:
        value = _float(f"{what} is", value)
    if math.isnan(value) or (math.isinf(value) and not infinite):
        raise InputError(f"{what} is {value:g}; it must be {'a number' if infinite else 'finite'}")
    if not infinite and abs(value) > most:
        raise InputError(f"{what} is {value:g}; it must be between {-most:g} and {most:g}")
    return value


def _float(what: str, value: Any) -> float:
    """A real number as a float; integers that no float reaches are refused."""
    if isinstance(value, bool | np.bool_) or not isinstance(value, numbers.Real):
        raise InputError(f"{what} {shown(value)}; it must be a number")
    try:
        return float(value)
    except (OverflowError, ValueError):
        raise InputError(f"{what} {shown(value)}; it is too large for a number of 64 bits") from None


def shown(value: object) -> str:
    """repr(value), cut to what a message can hold."""
    try:
        text = repr(value)
    except Exception:  # of integers of more than 4300 digits, and of objects of others
        return f"a {type(value).__name__}"
    return shortened(text, 80)


def shortened(text: str, most: int = 300) -> str:
    """The text, cut to what a message can hold."""
    return text if len(text) <= most else f"{text[: most - 20]}... of {len(text)} characters"


def listed(names: Sequence[str], most: int = 3) -> str:
    """The first names, and how many more there are."""
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")


def positive(what: str, value: Any) -> float:
    """`value` as a float that is finite and above zero."""
    value = number(what, value, infinite=True)
    if not value > 0 or math.isinf(value):
        raise InputError(f"{what} is {value:g}; it must be positive and finite")
    return number(what, value)


def integer(option: str, value: object, at_least: int, at_most: int = MOST_COUNT) -> int:
    """The value of an option that counts."""
    if isinstance(value, bool) or not isinstance(value, numbers.Integral) or value < at_least:
        raise InputError(f"{option} = {shown(value)}; it must be an integer, at least {at_least}")
    if value > at_most:
        raise InputError(f"{option} = {shown(value)}; it must be an integer, at most {at_most}")
    return int(value)


def option(name: str, value: object) -> float:
    """The value of an option within its range; InputError that states the range."""
    range_ = OPTIONS[name]
    if range_.whole:
        return integer(name, value, int(range_.least), int(range_.most))
    number_ = _float(f"{name} =", value)
    if math.isnan(number_):
        raise InputError(f"{name} = {shown(value)}; it must be a number")
    if number_ not in range_:
        least = "positive: " if range_.least > 0 else "zero or positive: "
        raise InputError(f"{name} = {shown(value)}; it must be {least}{range_}")
    return number_


def positive_number(option: str, value: object) -> float:
    """The value of an option that is above zero, infinity included."""
    if (number_ := nonnegative_number(option, value)) == 0:
        raise InputError(f"{option} = {shown(value)}; it must be positive")
    return number_


def nonnegative_number(option: str, value: object) -> float:
    """The value of an option that is zero or above, infinity included."""
    number_ = _float(f"{option} =", value)
    if math.isnan(number_):
        raise InputError(f"{option} = {shown(value)}; it must be a number")
    if number_ < 0:
        raise InputError(f"{option} = {shown(value)}; it must be zero or positive")
    return number_


def flag(what: str, value: object) -> bool:
    """True or False; not what only counts as one of them, as an array or a text may."""
    if not isinstance(value, bool | np.bool_):
        raise InputError(f"{what} = {shown(value)}; it must be True or False")
    return bool(value)


def function(what: str, value: Any) -> Any:
    """Something that can be called, or None."""
    if value is not None and not callable(value):
        raise InputError(f"{what} is a {type(value).__name__}; it must be callable")
    return value


def text(what: str, value: object) -> str:
    """A string of at most LONGEST_TEXT characters."""
    if not isinstance(value, str):
        raise InputError(f"{what} is {shown(value)}; it must be a string")
    if len(value) > LONGEST_TEXT:
        raise InputError(f"{what} has {len(value)} characters; give at most {LONGEST_TEXT}")
    return value


def named(kind: str, name: object) -> str:
    """kind "name": , with which messages about a part begin; InputError if the name is no string."""
    return f'{kind} "{text(f"the name of {kind}", name)}": '


def sequence(what: str, values: Any) -> list[Any]:
    """The members of a list, tuple or the like, no text, at most a million of them."""
    try:
        if isinstance(values, str | bytes):
            raise TypeError
        listed = list(islice(values, 1_000_001))
    except Exception:
        raise InputError(f"{what} is {shown(values)}; give a list") from None
    if len(listed) > 1_000_000:
        raise InputError(f"{what} has more than a million members")
    return listed


def entries(what: str, values: Any, count: int, most: float = LARGEST, remedy: str = "") -> tuple[float, ...]:
    """`values` as a tuple of `count` finite floats; remedy: what a message says of another count."""
    # Most numbers of a file are right already; the comparison fails for NaN.
    if type(values) is tuple and len(values) == count:
        for x in values:
            if type(x) is not float or not -most <= x <= most:
                break
        else:
            return values  # type: ignore[no-any-return]
    try:
        listed = tuple(islice(values, count + 1))  # of what has no end, too
    except Exception:  # of an object that is no sequence, or only looks like one
        listed = ()
    if len(listed) != count or isinstance(values, str | bytes):
        raise InputError(f"{what} is {shown(values)}; it must have {count} numbers{remedy}")
    return tuple([number(f"{what}[{i}]", x, most=most) for i, x in enumerate(listed)])


def vector3(what: str, values: Any) -> Vector3:
    """Three finite floats."""
    return entries(what, values, 3)  # type: ignore[return-value]


def point(what: str, values: Any) -> Vector3:
    """A position (m): three floats no farther than FARTHEST."""
    return entries(what, values, 3, FARTHEST)  # type: ignore[return-value]


def unit_vector(what: str, values: Any) -> Vector3:
    """The direction of three numbers, not all zero."""
    v = vector3(what, values)
    if abs(math.hypot(*v) - 1) < EXACT:
        return v
    scale = max(map(abs, v))
    if scale == 0:
        raise InputError(f"{what} is zero; it must be a direction")
    v = (v[0] / scale, v[1] / scale, v[2] / scale)  # no overflow or underflow in the squares
    length = math.hypot(*v)
    return (v[0] / length, v[1] / length, v[2] / length)


def quaternion(what: str, values: Any) -> Quaternion:
    """A unit quaternion (w, x, y, z), or a Rotation of SciPy; one that is so within UNIT is normalised."""
    if callable(getattr(values, "as_quat", None)):  # x, y, z, w
        values = np.roll(values.as_quat(), 1)
    remedy = ": w, x, y, z of a unit quaternion, as amontons.axis_angle(axis, angle) makes them"
    q = entries(what, values, 4, remedy=remedy)
    length = math.hypot(*q)
    if abs(length - 1) > UNIT:
        remedy = "divide it by its length" if length > 0 else "(1, 0, 0, 0) is no rotation"
        raise InputError(f"{what} is {q}, of length {length:g}; it must be a unit quaternion: {remedy}")
    return q if abs(length - 1) < EXACT else tuple(x / length for x in q)  # type: ignore[return-value]


def reals(what: str, values: ArrayLike, remedy: str = "") -> Array:
    """`values` as a contiguous float64 array, without a copy where it is one; its entries may be NaN.

    Objects that NumPy does not know lend their memory by DLPack.
    """
    try:
        if hasattr(values, "__dlpack__") and not hasattr(values, "__array__"):
            values = np.from_dlpack(values)
        if np.iscomplexobj(values):
            raise InputError(f"{what} is complex; it must hold real numbers")
        return np.ascontiguousarray(values, dtype=np.float64)
    except InputError:
        raise
    except Exception as error:  # NumPy asks the object, which may raise anything
        reason = " ".join(str(error).split())[:200]
        raise InputError(f"{what} must hold real numbers{remedy} ({reason})") from None


def one_or_two(what: str, values: Any) -> tuple[Any, Any]:
    """One value twice, or two."""
    if isinstance(values, numbers.Real):
        return values, values
    listed = sequence(what, values)
    if len(listed) != 2:
        raise InputError(f"{what} is {shown(values)}; give one number, or two")
    return listed[0], listed[1]


def array(what: str, values: ArrayLike) -> NDArray[Any]:
    """`values` as an array of whatever it holds."""
    try:
        return np.asarray(values)
    except Exception:  # NumPy asks the object, which may raise anything
        raise InputError(f"{what} is {shown(values)}; give an array of numbers") from None


def indices(what: str, values: ArrayLike) -> NDArray[np.int32]:
    """A copy of `values` as a contiguous array of 32-bit integers."""
    array = reals(what, values)
    if array.size and not (np.abs(array) <= MOST_COUNT).all():
        raise InputError(f"{what} has an entry beyond 32 bits")
    if (array != np.floor(array)).any():
        raise InputError(f"{what} must hold integers")
    return array.astype(np.int32)


def vector(what: str, values: ArrayLike, remedy: str = "") -> Array:
    """`values` as a contiguous float64 vector (one entry for a scalar), without a copy where it is one."""
    array = reals(what, values, remedy)  # ascontiguousarray makes one entry of a scalar
    if array.ndim != 1:
        raise InputError(f"{what} has shape {array.shape}; it must be a vector{remedy}")
    return array


def matrix(what: str, values: ArrayLike, rows: int, columns: int) -> Array:
    """`values` as a finite (rows, columns) array; nothing at all stands for no rows."""
    array = reals(what, values)
    if array.size == 0 and rows == 0:
        return np.empty((0, columns))
    if array.shape != (rows, columns):
        raise InputError(f"{what} has shape {array.shape}; it must be ({rows}, {columns})")
    return finite(what, array)


def finite(what: str, array: Array) -> Array:
    """The array itself, all of whose entries are finite."""
    bad = ~np.isfinite(array)
    if bad.any():
        where = ", ".join(map(str, np.argwhere(bad)[0]))
        raise InputError(f"{what}[{where}] is not finite")
    return array


def frozen(array: np.ndarray) -> np.ndarray:
    """A view of the array that cannot be written."""
    view = array.view()
    view.flags.writeable = False
    return view


@contextmanager
def about(what: str) -> Iterator[None]:
    """Lets every InputError of the block begin with what it is about."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{what}: {error}") from None


def changed(thing: T, **values: Any) -> T:
    """A copy of an immutable object with values that are known to be good: nothing is checked again."""
    copied = copy.copy(thing)
    for name, value in values.items():
        object.__setattr__(copied, name, value)
    return copied
