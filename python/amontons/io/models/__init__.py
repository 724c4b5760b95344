"""Models from MJCF and URDF files, by way of MuJoCo's compiler, and from SDF and USD."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from os import PathLike
from pathlib import Path

from ...errors import FileError, InputError
from ...limits import DEFAULT, Limits
from ...model.model import Model
from ...model.parts import Fluid, Motor
from ..files import existing
from .actuators import read_actuators
from .bodies import fluid_boxes, read_bodies
from .compiled import Compiled, compile_file, import_mujoco, open_compiled
from .contacts import read_contacts
from .dents import with_parts
from .equalities import read_equalities
from .geoms import Geoms, read_geoms
from .issues import Issues
from .joints import read_joints
from .json_file import read_model_json
from .keyframes import read_keyframes
from .loops import read_loops
from .massless import without_massless
from .motors import checked_motor, with_motors
from .overlaps import without_overlaps
from .scan import scan
from .sdf import read_sdf
from .sensors import read_sensors
from .sites import read_sites
from .size import Budget
from .tendons import read_tendons
from .urdf_tree import add_world, lacks_world, require_tree, with_world
from .usd import read_usd
from .visuals import read_visuals
from .writing import Lost as Lost
from .writing import write_model as write_model
from .xacro import expanded
from .xml_lines import Faults, expand_includes, read_xml

SUFFIXES = (".xml", ".mjcf", ".urdf")
OWN_READERS: dict[str, Callable[[Path, Issues, Limits], Model]] = {
    **dict.fromkeys((".sdf", ".world"), read_sdf),
    **dict.fromkeys((".usd", ".usda", ".usdc", ".usdz"), read_usd),
}
"""Kinds of files that MuJoCo does not read."""
KNOWN = (*SUFFIXES, ".mjb", ".xacro", *OWN_READERS, ".json")
CONVERTED = {
    **dict.fromkeys(
        (".step", ".stp"), "a part is no model; export it as a mesh (.stl), for shapes.read_mesh"
    ),
}
"""Remedies for files of other kinds."""


def load_model(
    path: str | PathLike[str],
    *,
    strict: bool = False,
    floating_base: bool | None = None,
    self_overlaps: bool = False,
    motors: Motor | None = None,
    loops: str | PathLike[str] | None = None,
    decompose: bool | float = False,
    limits: Limits = DEFAULT,
) -> Model:
    """Read a model: MJCF (.xml, .mjb), URDF (.urdf, .xacro, or <robot> in .xml), SDF, USD, or a .json.

    Elements that amontons does not support are left out. `Model.unread` lists them, and one warning
    (UnsupportedWarning) shows them, worst first.

    strict: raise InputError with the list in place of leaving out anything that changes the motion.
    floating_base: of URDF: whether the root link moves freely. By default it does if it has an <inertial>
        with mass and is not called "world", and a ModelWarning says which it is.

    self_overlaps: whether links of one tree touch each other although they overlap in the pose of the file;
        by default they do not, and a ModelWarning lists them.

    motors: of URDF: a Motor for every joint, but those that follow another one (<mimic>); its largest effort
        is at most <limit effort>. A control then drives each joint by its name.

    loops: of URDF: the YAML file of its extended form (arXiv 2504.04767) with the pairs of frames that close
        loops; <loop> of URDF+ is read without it.

    decompose: of meshes on bodies that move: their convex parts collide (`shapes.decompose`), with this error
        (m), or with True 1 % of the diagonal of each mesh; a warning has the deviations. By default the
        convex hull of a mesh collides, and a warning has the volume that it adds.

    limits: how large the model may be, with all that it includes and copies.

    docs/models.md tells what is read. MJCF and URDF need MuJoCo (pip install amontons[models]), USD usd-core
    (amontons[usd]).
    Raises FileNotFoundError, or FileError naming file, line and element of what is missing or wrong.

    >>> model = load_model(examples.path("arm.xml"))
    >>> model.joint_names
    ('shoulder', 'elbow')
    """
    if motors is not None:
        checked_motor(motors)
    if str(path).lower().endswith(".json"):
        if (
            strict
            or floating_base is not None
            or self_overlaps
            or motors is not None
            or loops is not None
            or decompose
        ):
            raise InputError(f"{path}: options are for MJCF and URDF; a .json holds the model that they made")
        return read_model_json(existing(path, "a model file"), limits)
    if (suffix := Path(path).suffix.lower()) in OWN_READERS:
        if floating_base is not None or self_overlaps or loops is not None:
            raise InputError(f"{path}: floating_base, self_overlaps and loops are for MJCF and URDF")
        return _read_own(existing(path, "a model file"), suffix, strict, motors, decompose, limits)
    compiled = compiled_model(path, floating_base, limits)
    if motors is not None and compiled.root.tag != "robot":
        raise InputError(
            f"{path}: motors is for URDF; MJCF has <actuator>, or builder.set_motor gives a motor"
        )
    if loops is not None and compiled.root.tag != "robot":
        raise InputError(f"{path}: loops is for URDF; MJCF has <equality>")
    beside = None if loops is None else existing(loops, "the YAML file of an extended URDF")
    model = _model(compiled, strict=strict, self_overlaps=self_overlaps, loops=beside, decompose=decompose)
    return model if motors is None else with_motors(model, motors)


def _read_own(
    path: Path, suffix: str, strict: bool, motors: Motor | None, decompose: bool | float, limits: Limits
) -> Model:
    issues = Issues(path)
    try:
        model = OWN_READERS[suffix](path, issues, limits)
        if issues.dents:
            before = set(issues.found)
            model, _ = with_parts(model, issues, decompose)
            model = replace(model, unread=(*model.unread, *(e for e in issues.unread() if e not in before)))
    finally:
        if not strict:
            issues.report(strict=False)
    if strict:
        issues.report(strict=True)
    return model if motors is None else with_motors(model, motors)


def compiled_model(
    path: str | PathLike[str], floating_base: bool | None = None, limits: Limits = DEFAULT
) -> Compiled:
    """A model file as MuJoCo has it, with the meshes and the base that `load_model` gives a URDF."""
    path = existing(path, "a model file")
    if path.suffix.lower() == ".mjb":
        return open_compiled(path, limits)
    if path.suffix.lower() == ".xacro":
        with expanded(path, limits) as file:
            return _compiled_text(file, floating_base, limits, path)
    return _compiled_text(path, floating_base, limits, path)


def _compiled_text(path: Path, floating_base: bool | None, limits: Limits, named: Path) -> Compiled:
    """named: the file that the user gave, beside which meshes lie."""
    if path.suffix.lower() not in SUFFIXES:
        known = f"known suffixes are {', '.join(KNOWN)}"
        remedy = CONVERTED.get(path.suffix.lower())
        raise FileError(f"{path}: {f'{remedy}; {known}' if remedy else f'unknown kind of file; {known}'}")
    if str(path) != str(path).encode(errors="replace").decode():
        raise FileError(f"{path}: the name is no UTF-8, which MuJoCo asks for; rename the file")
    import_mujoco()
    faults: Faults = []
    budget = Budget(limits)
    root = read_xml(path, faults, budget)
    if root.tag not in ("mujoco", "robot"):
        raise FileError(f"{root.place}: the root is {root}; it must be <mujoco> (MJCF) or <robot> (URDF)")
    if floating_base is not None and root.tag != "robot":
        raise InputError(f"{path}: floating_base is for URDF; give the body a <freejoint> instead")
    issues = Issues(named)
    if named != path:  # lines are those of the text that xacro made
        for element in root.walk():
            element.file = Path(f"{named} (expanded)")
    expand_includes(root, named.parent, faults, budget)
    for element, what in faults:
        issues.add(element, what, "none")
    scan(root, issues, named.parent, limits)
    if root.tag == "robot":
        text = with_world(path.read_text(encoding="utf-8", errors="replace")) if lacks_world(root) else ""
        if text:
            add_world(root)
        require_tree(root)
        return compile_file(path, root, issues, floating_base, limits, text)
    return compile_file(path, root, issues, floating_base, limits)


def _model(
    compiled: Compiled, *, strict: bool, self_overlaps: bool, loops: Path | None, decompose: bool | float
) -> Model:
    try:
        model, geoms = _read(compiled, loops)
        sources = geoms.sources()
        if compiled.issues.dents:
            model, former = with_parts(model, compiled.issues, decompose)
            sources = [sources[k] for k in former]
            model = replace(model, unread=compiled.issues.unread())
        model = without_overlaps(compiled, sources, model, all_too=not self_overlaps)
        model = without_massless(model, compiled.massless)
    except FileError:
        raise
    except InputError as error:
        compiled.issues.report(strict=strict)
        raise FileError(f"{compiled.path}: {error}") from None
    except (MemoryError, compiled.mujoco.FatalError) as error:
        raise FileError(f"{compiled.path}: does not fit into memory ({error})") from None
    compiled.issues.report(strict=strict)
    return model


def _read(compiled: Compiled, loops: Path | None) -> tuple[Model, Geoms]:
    """The model, but for what overlaps."""
    bodies = read_bodies(compiled)
    geoms = read_geoms(compiled, bodies)
    joints = read_joints(compiled, bodies)
    tendons, tendon_of = read_tendons(compiled, bodies, joints)
    actuators, actuator_ids = read_actuators(compiled, bodies, joints, tendons, tendon_of)
    couplings = read_equalities(compiled, bodies, joints, tendon_of)
    read_loops(compiled, bodies, joints, loops)
    pair_materials, excluded, excluded_geoms = read_contacts(compiled, bodies, geoms)
    keyframes = read_keyframes(compiled, bodies, joints, actuator_ids)
    sites = read_sites(compiled, bodies)
    sensors = read_sensors(
        compiled,
        bodies,
        joints,
        sites,
        {i: actuator.name for i, actuator in zip(actuator_ids, actuators, strict=True)},
        {i: tendons[ours].name for i, ours in tendon_of.items()},
    )
    boxes = fluid_boxes(compiled, bodies)
    m = compiled.model
    gravity = m.opt.gravity.tolist() if compiled.enabled("gravity") else (0.0, 0.0, 0.0)
    model = Model(
        gravity=tuple(gravity),
        friction_rule="maximum",
        bodies=tuple(bodies.bodies),
        geoms=tuple(geoms.geoms),
        joints=tuple(joints.joints),
        couplings=tuple(couplings),
        pair_materials=tuple(pair_materials),
        excluded_bodies=tuple(excluded),
        excluded_geoms=tuple(excluded_geoms),
        tendons=tuple(tendons),
        actuators=tuple(actuators),
        keyframes=keyframes,
        sites=sites,
        sensors=sensors,
        visuals=tuple(read_visuals(compiled, bodies, geoms)),
        links=tuple(bodies.links),
        fluid=Fluid(*map(float, (m.opt.density, m.opt.viscosity)), tuple(m.opt.wind.tolist())),
        fluid_boxes=tuple(boxes),
        unread=compiled.issues.unread(),
        trees="auto",
    )
    return model, geoms
