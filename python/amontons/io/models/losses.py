"""Parts of a model that a file of another format cannot hold, listed in one warning."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ...checks import shortened
from ...errors import UnsupportedWarning
from ...model.model import Model
from ...model.presets import EFFECTS

SHOWN, WIDTH = 5, 140
"""Lines of the warning, and characters of a line"""


@dataclass(frozen=True)
class Lost:
    """Something of a model that a written file does not hold, see `write_model`.

    >>> lost = write_model(scenes.make("newtons_cradle"), "cradle.urdf")
    >>> len(lost) > 0 and lost[0].effect
    'large'
    """

    part: str
    """such as 'joint "knee"'; "model" for a whole list"""
    what: str
    effect: str
    """on the motion: large (a part of the mechanism or its drive is missing) | small (a force or coefficient
    is another one) | none"""

    def __str__(self) -> str:
        return f"{self.part}: {self.what}"


def laws_lost(model: Model, *, static: bool) -> list[Lost]:
    """Laws that a format has no words for: clearance, backlash, ropes that rub, static friction of joints.

    static: whether it has the static friction of surfaces, though not Stribeck's curve.
    """
    lost = []
    if model.bonds:
        lost.append(Lost("model", f"{len(model.bonds)} bonds", "large"))
    for geom in model.geoms:
        material = geom.material
        if material.friction_static is not None and (not static or material.stribeck_speed > 0):
            what = "Stribeck's curve of its friction" if static else "its static friction"
            lost.append(Lost(f'geom "{geom.name}"', what, "small"))
    for joint in model.joints:
        if any(dof.friction_static is not None for dof in joint.dofs):
            lost.append(Lost(f'joint "{joint.name}"', "its static friction", "small"))
        if joint.clearance:
            lost.append(Lost(f'joint "{joint.name}"', "the bearing or guide of its clearance", "large"))
    for coupling in model.couplings:
        if coupling.backlash:
            lost.append(Lost(f'coupling "{coupling.name}"', "its backlash", "small"))
    for tendon in model.tendons:
        if tendon.closed or any(stop.friction for stop in tendon.path):
            lost.append(Lost(f'tendon "{tendon.name}"', "friction on its path", "large"))
    return lost


def told(path: Path, lost: Sequence[Lost], who: str) -> tuple[Lost, ...]:
    """The list, worst first; one warning where it changes the motion for `who` reads the file."""
    ordered = tuple(sorted(dict.fromkeys(lost), key=lambda entry: EFFECTS.index(entry.effect)))
    changing = [entry for entry in ordered if entry.effect != "none"]
    if changing:
        lines = [f"  {shortened(str(entry), WIDTH)}" for entry in changing[:SHOWN]]
        if len(changing) > SHOWN:
            lines.append(f"  and {len(changing) - SHOWN} more")
        things = f"{len(changing)} things are" if len(changing) > 1 else "1 thing is"
        warnings.warn(
            f"{path}: {things} lost for {who} (write_model returns the list):\n" + "\n".join(lines),
            UnsupportedWarning,
            stacklevel=3,
        )
    return ordered
