"""Tables of SDF: by element, the elements within it that are read, and those that change no motion.

All others are listed, so that nothing is lost unsaid. The names are those of the SDFormat specification,
1.4 to 1.12.
"""

from __future__ import annotations

from ..elements import Element
from ..issues import Issues
from ..rules import words

READ = {
    "sdf": words("model world"),
    "world": words("model include frame joint gravity physics"),
    "physics": words("gravity"),
    "model": words("link joint frame model include pose static self_collide allow_auto_disable"),
    "include": words("uri name pose static placement_frame"),
    "link": words("pose inertial collision visual gravity self_collide kinematic must_be_base_link"),
    "inertial": words("mass pose inertia density"),
    "inertia": words("ixx ixy ixz iyy iyz izz"),
    "collision": words("pose geometry surface density"),
    "visual": words("pose geometry material"),
    "frame": words("pose"),
    "joint": words(
        "pose parent child axis axis2 thread_pitch screw_thread_pitch gearbox_ratio gearbox_reference_body"
    ),
    "axis": words("xyz dynamics limit use_parent_model_frame mimic"),
    "dynamics": words("damping friction spring_reference spring_stiffness"),
    "limit": words("lower upper effort"),
    "mimic": words("multiplier offset reference"),
    "surface": words("friction bounce contact"),
    "friction": words("ode bullet torsional"),
    "torsional": words("coefficient use_patch_radius patch_radius"),
    "bounce": words("restitution_coefficient"),
    "contact": words("collide_bitmask collide_without_contact ode"),
}
IGNORED = {
    "sdf": words("actor light"),
    "world": words(
        "light scene gui spherical_coordinates atmosphere audio magnetic_field state road model_editor_state"
    ),
    "physics": words(
        "max_step_size real_time_factor real_time_update_rate max_contacts ode bullet simbody dart"
    ),
    "model": words("enable_wind allow_auto_disable"),
    "link": words("sensor light projector audio_sink audio_source battery enable_wind particle_emitter"),
    "collision": words("laser_retro max_contacts"),
    "visual": words("cast_shadows laser_retro transparency meta visibility_flags plugin"),
    "joint": words("physics sensor"),
    "axis": words("initial_position"),
    "limit": words("velocity stiffness dissipation"),
    "bounce": words("threshold"),
    "surface": words("soft_contact"),
    "contact": words("bullet poissons_ratio elastic_modulus collide_without_contact_bitmask"),
}
SMALL = words("velocity_decay fluid_added_mass wind soft_contact")
"""Listed elements that change a force; those of `LARGE` change the mechanism, others nothing."""
LARGE = words("population gripper joint link model actor")
OPAQUE = words("plugin sensor material geometry inertia xyz")
"""Elements whose content is of others, or is judged where it is read"""


def judge(root: Element, issues: Issues) -> None:
    """Lists what is not read of a file, by the tables."""
    left = [root]
    while left:
        element = left.pop()
        kind = "axis" if element.tag == "axis2" else element.tag
        if kind not in READ or kind in OPAQUE:
            continue
        for child in element.children:
            tag = "axis" if child.tag == "axis2" else child.tag
            if tag in IGNORED.get(kind, ()):
                continue
            if child.tag in READ[kind] or tag in READ[kind]:
                left.append(child)
            elif child.tag == "plugin":
                issues.add(child, "a program of the simulator, which does not run here", "none")
            elif ":" in child.tag:
                issues.add(child, "an element of another program", "none")
            else:
                effect = "large" if child.tag in LARGE else "small"
                issues.add(child, "this element is not read", effect)
