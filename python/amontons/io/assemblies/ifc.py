"""IFC by ifcopenshell: products with a body as blocks."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ...errors import FileError, InputError
from .shells import Shell, split

SUPPORTS = ("IfcFooting", "IfcPile", "IfcDeepFoundation")
"""Classes of products that are supports"""
LEFT_OUT = ("IfcOpeningElement", "IfcSpace", "IfcSite", "IfcGrid", "IfcAnnotation", "IfcVirtualElement")


def read_ifc(path: Path) -> list[Shell]:
    """The shells of each product, in metres and the axes of the project; openings are cut out."""
    try:
        import ifcopenshell
        import ifcopenshell.geom
    except ImportError:
        raise InputError(f"{path}: IFC is read by ifcopenshell: pip install amontons[ifc]") from None
    try:
        file: Any = ifcopenshell.open(str(path))
    except Exception as error:  # whatever its parser raises of a damaged file
        reason = " ".join(str(error).split())[:200]
        raise FileError(f"{path}: cannot be read as IFC ({reason}); export it again") from None
    settings = ifcopenshell.geom.settings()
    settings.set("use-world-coords", True)
    shells = []
    for product in sorted(file.by_type("IfcProduct"), key=lambda product: product.id()):
        if product.Representation is None or any(product.is_a(kind) for kind in LEFT_OUT):
            continue
        name = product.Name or product.GlobalId
        try:
            shape: Any = ifcopenshell.geom.create_shape(settings, product)
        except Exception as error:
            reason = " ".join(str(error).split())[:200]
            raise FileError(f"{path}: the shape of {name!r} cannot be made ({reason})") from None
        points = np.array(shape.geometry.verts, dtype=np.float64).reshape(-1, 3)
        faces = np.array(shape.geometry.faces, dtype=np.int64).reshape(-1, 3)
        if not len(faces):
            continue
        fixed = any(product.is_a(kind) for kind in SUPPORTS)
        density = _density(product)
        shells += split(Shell(str(name), points, faces, fixed=fixed, density=density))
    if not shells:
        kinds = sorted({product.is_a() for product in file.by_type("IfcProduct")})
        raise FileError(
            f"{path}: none of its products has a body ({', '.join(kinds[:5]) or 'there are no products'}); "
            "export it with the shapes of the elements"
        )
    return shells


def _density(product: Any) -> float | None:
    """MassDensity of the material of a product (kg/m^3), where the file has it."""
    try:
        import ifcopenshell.util.element as element

        material = element.get_material(product, should_skip_usage=True)
        sets = element.get_psets(material) if material is not None else {}
    except Exception:  # files of old schemas
        return None
    for values in sets.values():
        if isinstance(values.get("MassDensity"), int | float):
            return float(values["MassDensity"])
    return None
