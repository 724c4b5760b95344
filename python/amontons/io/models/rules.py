"""Rules for elements of MJCF and URDF: which are read, which are ignored because they do not change the
motion, and which are listed.

An element or attribute in none of these tables is listed: a file never loses anything unsaid. The names are
those of MuJoCo's XML reference and of the URDF specification.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from .elements import Element

Check = Callable[[Element, str], bool]
"""Whether the value of an attribute is supported."""
Condition = tuple[Check, str] | tuple[Check, str, str]
"""A check, why other values are listed, and their effect on the motion: small unless it is given"""


@dataclass(frozen=True)
class Rule:
    """How to treat an element: attributes read, attributes ignored, attributes read if a check holds."""

    read: frozenset[str] = frozenset()
    ignored: frozenset[str] = frozenset()
    checked: dict[str, Condition] = field(default_factory=dict)
    subtree: bool = False
    """all that is below is ignored"""
    unread: str = ""
    """why the whole element is listed"""
    effect: str = "large"
    """of an element that is listed, on the motion"""


def words(text: str) -> frozenset[str]:
    return frozenset(text.split())


def zero_from(first: int) -> Check:
    """Values from the index `first` on are zero."""

    def check(element: Element, attribute: str) -> bool:
        values = element.numbers(attribute)
        return values is not None and not any(values[first:])

    return check


def one_of(*allowed: str) -> Check:
    return lambda element, attribute: element.attributes[attribute].strip() in allowed


def none_of(*refused: str) -> Check:
    return lambda element, attribute: element.attributes[attribute].strip() not in refused


def isotropic(element: Element, attribute: str) -> bool:
    """Friction values (sliding 1, 2, torsional, rolling 1, 2) that do not distinguish the two tangents."""
    values = element.numbers(attribute) or []
    rolls = element.attributes.get("condim", "6") == "6"
    return not (
        (len(values) > 1 and values[0] != values[1]) or (rolls and len(values) > 4 and values[3] != values[4])
    )


zero = zero_from(0)
IGNORED = Rule(subtree=True)
GROUP = Rule()
FRAME = words("pos quat axisangle xyaxes zaxis euler")
SOFTNESS = words("solref solimp solreflimit solimplimit solreffriction solimpfriction solmix gap")

ADHESION = "adhesion"
DELAY = "delay of an actuator"

DAMPING = (zero_from(1), "a nonlinear damper; its linear part is the first number")
SPRING = {
    "springyield": (zero, "a spring that yields"),
    "stiffness": (zero_from(1), "a nonlinear spring; its linear part is the first number"),
    "damping": DAMPING,
}
BODY = Rule(
    words("name childclass mocap gravcomp") | FRAME,
    words("user simple sleep fuse"),
    {},
)
JOINT = Rule(
    words(
        "name class type group pos axis springdamper limited range ref springref armature frictionloss "
        "actuatorfrclimited actuatorfrcrange margin"
    ),
    words("user actuatorgravcomp") | SOFTNESS,
    SPRING,
)
GEOM = Rule(
    words(
        "name class contype conaffinity condim priority friction mass density shellinertia size fromto mesh "
        "hfield fitscale margin solref solimp solmix surfacevel"
    )
    | FRAME,
    words("group user material rgba castshadow fluidshape fluidcoef gap"),
    {
        "type": (none_of("sdf"), "a signed distance field; use a mesh or primitives", "large"),
        "adhesion": (zero, ADHESION),
    },
)
PAIR = Rule(
    words("name class geom1 geom2 condim margin solref solimp"),
    words("gap solreffriction"),
    {
        "friction": (isotropic, "anisotropic friction along tangents that MuJoCo chooses; give one number"),
        "adhesion": (zero, ADHESION),
    },
)
ACTIVE = (one_of("true"), "an equality that is not active from the start; it stays so", "none")
EQUALITY = Rule(
    words("name class body1 body2 anchor relpose site1 site2 joint1 joint2 tendon1 tendon2 polycoef"),
    SOFTNESS | words("torquescale"),
    {"active": ACTIVE},
)
ACTUATOR = Rule(
    words(
        "name class joint jointinparent ctrllimited ctrlrange forcelimited forcerange gear kp kv dampratio "
        "inheritrange armature gaintype gainprm biastype biasprm input site tendon body cranksite slidersite "
        "refsite cranklength timeconst dyntype dynprm actdim actlimited actrange actearly area diameter bias"
    ),
    words("group user lengthrange interp ffrange velrange"),
    {
        "delay": (zero, DELAY),
        "nsample": (zero, DELAY),
        "damping": DAMPING,
    },
)
TENDON = Rule(
    words(
        "name class limited range margin actuatorfrclimited actuatorfrcrange frictionloss springlength "
        "armature"
    ),
    words("group width material rgba user") | SOFTNESS,
    SPRING,
)
OPTION = Rule(
    words("gravity actuatorgroupdisable density viscosity wind"),
    words(
        "ccd_iterations ccd_tolerance cone impratio integrator iterations jacobian ls_iterations "
        "ls_tolerance magnetic noslip_iterations noslip_tolerance o_friction o_margin o_solimp o_solref "
        "sdf_initpoints sdf_iterations sleep_tolerance solver timestep tolerance"
    ),
)
FLAG = Rule(
    words(
        "actuation clampctrl constraint contact damper equality filterparent frictionloss gravity limit "
        "spring override"
    ),
    words(
        "autoreset diagexact energy eulerdamp fwdinv invdiscrete ipc island midphase multiccd nativeccd "
        "refsafe sensor sleep speculative warmstart"
    ),
)
COMPILER = Rule(
    words(
        "alignfree angle assetdir autolimits balanceinertia boundinertia boundmass conflict coordinate "
        "discardvisual eulerseq fitaabb fusestatic inertiafromgeom inertiagrouprange meshdir passthrough "
        "savecanonical savecompiled saveinertial settotalmass strippath texturedir usethread"
    )
)
PLUGIN = Rule(unread="a plugin")
DRIVE = "this kind of actuator; those of affine laws are read"
FLEX = Rule(unread="a deformable body")

# By "parent tag/tag"; a parent that only groups its children ("*") stands for any.
MJCF: dict[str, Rule] = {
    "*/mujoco": Rule(words("model")),
    "mujoco/compiler": COMPILER,
    "compiler/lengthrange": IGNORED,
    "mujoco/option": OPTION,
    "option/flag": FLAG,
    "mujoco/size": IGNORED,
    "mujoco/statistic": IGNORED,
    "mujoco/visual": IGNORED,
    "mujoco/sensor": IGNORED,
    "mujoco/custom": IGNORED,
    "mujoco/extension": IGNORED,
    "mujoco/default": Rule(words("class")),
    "default/default": Rule(words("class")),
    "default/tendon": TENDON,
    "default/equality": Rule(frozenset(), SOFTNESS, {"active": ACTIVE}),
    "mujoco/asset": GROUP,
    "asset/model": Rule(words("name file content_type")),
    "*/mesh": Rule(
        words(
            "name class file vertex face refpos refquat scale inertia maxhullvert builtin params content_type"
        ),
        words("normal texcoord smoothnormal material"),
    ),
    "mesh/plugin": PLUGIN,
    "asset/hfield": Rule(words("name file nrow ncol size elevation content_type")),
    "mujoco/worldbody": Rule(words("name")),
    "*/body": BODY,
    "*/frame": Rule(words("name childclass") | FRAME),
    "*/replicate": Rule(words("childclass count sep offset euler")),
    "*/attach": Rule(words("model body frame prefix")),
    "*/inertial": Rule(words("mass diaginertia fullinertia") | FRAME),
    "*/joint": JOINT,
    "*/freejoint": Rule(words("name group align")),
    "*/geom": GEOM,
    "geom/plugin": PLUGIN,
    "body/plugin": PLUGIN,
    "*/flexcomp": FLEX,
    "deformable/flex": FLEX,
    "mujoco/deformable": GROUP,
    "mujoco/contact": GROUP,
    "*/pair": PAIR,
    "contact/exclude": Rule(words("name body1 body2")),
    "mujoco/tendon": GROUP,
    "tendon/spatial": TENDON,
    "tendon/fixed": TENDON,
    "spatial/geom": Rule(words("geom sidesite")),
    "spatial/pulley": Rule(words("divisor")),
    "fixed/joint": Rule(words("joint coef")),
    "mujoco/equality": GROUP,
    "equality/connect": EQUALITY,
    "equality/weld": EQUALITY,
    "equality/joint": EQUALITY,
    "equality/tendon": EQUALITY,
    "equality/flex": FLEX,
    "equality/flexstrain": FLEX,
    "mujoco/actuator": GROUP,
    "mujoco/keyframe": GROUP,
    "keyframe/key": Rule(words("name time qpos qvel act ctrl mpos mquat"), words("plastic")),
    **{f"*/{tag}": IGNORED for tag in words("site camera light texture material skin")},
    **{f"*/{tag}": ACTUATOR for tag in words("general motor position velocity intvelocity damper cylinder")},
    **{
        f"{parent}/{tag}": Rule(unread=DRIVE) if parent == "actuator" else IGNORED
        for parent in ("actuator", "default")
        for tag in words("orientation pid muscle adhesion dcmotor plugin")
    },
}

URDF: dict[str, Rule] = {
    "*/robot": Rule(words("name"), words("version")),
    "robot/link": Rule(words("name"), words("type")),
    "link/visual": IGNORED,
    "link/inertial": GROUP,
    "link/collision": Rule(words("name")),
    "link/sensor": IGNORED,
    "*/origin": Rule(words("xyz rpy quat_xyzw")),
    "inertial/mass": Rule(words("value")),
    "inertial/inertia": Rule(words("ixx ixy ixz iyy iyz izz")),
    "collision/geometry": Rule(words("name")),
    "collision/material": IGNORED,
    "collision/verbose": IGNORED,
    "geometry/box": Rule(words("size")),
    "geometry/sphere": Rule(words("radius")),
    "geometry/cylinder": Rule(words("radius length")),
    "geometry/capsule": Rule(words("radius length")),
    "geometry/mesh": Rule(words("filename scale")),
    "robot/joint": Rule(words("name type"), words("dont_collapse disableFixedJointLumping independent")),
    # Bullet's; MuJoCo does not read it.
    "link/contact": GROUP,
    **{
        f"contact/{tag}": Rule(words("value"))
        for tag in words("lateral_friction rolling_friction spinning_friction restitution stiffness damping")
    },
    **{f"contact/{tag}": IGNORED for tag in words("contact_cfm contact_erp friction_anchor inertia_scaling")},
    "joint/parent": Rule(words("link")),
    "joint/child": Rule(words("link")),
    "joint/axis": Rule(words("xyz")),
    "joint/limit": Rule(words("lower upper effort"), words("velocity acceleration jerk")),
    "joint/dynamics": Rule(
        words("damping friction"),
        words("spring_reference"),
        {"spring_stiffness": (zero, "a spring, which is no part of URDF; MuJoCo does not read it either")},
    ),
    "joint/mimic": Rule(words("joint multiplier offset")),
    # URDF+
    "robot/loop": Rule(words("name type")),
    "loop/axis": Rule(words("xyz")),
    **{f"loop/{tag}": Rule(words("link")) for tag in words("predecessor successor")},
    "robot/coupling": Rule(unread="a coupling of URDF+; give the <mimic> of a joint", effect="large"),
    "joint/independent": IGNORED,
    "joint/calibration": IGNORED,
    "joint/safety_controller": IGNORED,
    "joint/hardwareInterface": IGNORED,
    "robot/material": IGNORED,
    "robot/gazebo": IGNORED,
    "robot/transmission": IGNORED,
    "robot/ros2_control": IGNORED,
    "robot/sensor": IGNORED,
    "joint/joint_properties": IGNORED,
    "joint/property": IGNORED,
    "link/self_collision_checking": IGNORED,
    **{f"robot/{tag}": IGNORED for tag in words("plugin property group")},
    "robot/mujoco": GROUP,
    "mujoco/compiler": COMPILER,
    "mujoco/option": OPTION,
    "option/flag": FLAG,
    "mujoco/size": IGNORED,
}
