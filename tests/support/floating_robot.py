"""A robot with everything that generalised coordinates have to tell apart, and a box."""

import amontons
from amontons import shapes

# A floating base whose frame is not at its centre of mass, a chain of hinge and slide with reference values
# that is read as one joint, a ball after a hinge, a welded tip, and a second tree on the world.
ROBOT = """
<mujoco>
  <option gravity="0.3 -0.2 -9.81"/>
  <worldbody>
    <body name="torso" pos="0 0 1">
      <freejoint name="root"/>
      <inertial pos="0.1 0.02 -0.05" mass="3" fullinertia="0.05 0.06 0.07 0.01 -0.005 0.002"/>
      <body name="leg" pos="0.2 0.1 0" quat="0.9 0.1 0.2 -0.3">
        <joint name="hip" type="hinge" axis="0.2 1 0" pos="0.03 0 0.01" ref="0.4" armature="0.02"/>
        <joint name="thigh" type="slide" axis="1 0 0.5" ref="-0.1"/>
        <geom type="capsule" size="0.04 0.15" density="900"/>
        <body name="foot" pos="0 0 -0.3">
          <joint name="ankle_x" type="hinge" axis="1 0 0" pos="0 0.2 0"/>
          <joint name="ankle" type="ball"/>
          <geom type="box" size="0.1 0.05 0.02" pos="0.03 0 0"/>
          <body name="toe" pos="0.12 0 0"><geom type="sphere" size="0.02"/></body>
        </body>
      </body>
    </body>
    <body name="pole" pos="2 0 0"><joint name="swing" axis="0 1 0"/><geom size="0.1" pos="0 0 -0.4"/></body>
  </worldbody>
  <actuator>
    <motor name="m" joint="hip" gear="3" ctrlrange="-1 1"/><position name="p" joint="swing" kp="20"/>
  </actuator>
  <keyframe>
    <key name="start" time="0.25" qpos="1 2 3 0.6 0 0.8 0 0.1 0.2 0.3 1 0 0 0 0.5" ctrl="0.5 0.25"/>
  </keyframe>
</mujoco>
"""


def robot(mujoco, tmp_path):
    path = tmp_path / "robot.xml"
    path.write_text(ROBOT)
    m = mujoco.MjModel.from_xml_path(str(path))
    return amontons.load_model(path), m, mujoco.MjData(m)


def box(builder, name, position, **options):
    return builder.add_body(name, shape=shapes.Box((0.1, 0.05, 0.05)), mass=1.0, position=position, **options)
