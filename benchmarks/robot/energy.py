"""Gains of energy that nothing explains, step by step; for robot/run.py and robot/trials.py."""

from __future__ import annotations

from typing import Any

import amontons
import numpy as np

Array = np.ndarray[Any, Any]


class Energy:
    """Gains of a step that no load, motor or spring explains, from what the simulation tells of itself.

    The energy of a step is kinetic (armatures included), of gravity and of springs; the work of motors is
    their effort over the coordinate's way, that of surfaces that move by themselves the contact force over
    theirs, all else that acts along coordinates only takes. Ways are those of the velocities: what
    corrections of positions lift and bend, where bodies or limits start too deep, is told apart. Blank where
    kinematic bodies or motors on joints that close loops drive, or soft contacts and tendons store, whose
    work is not told. Beside it the balance that reports tell themselves.
    """

    def __init__(self, simulation: amontons.Simulation) -> None:
        model = simulation.model
        self.simulation = simulation
        dofs = [d for joint in model.joints for d in joint.dofs]
        self.armature = np.array([d.armature for d in dofs])
        self.stiffness = np.array([d.stiffness for d in dofs])
        self.rest = np.array([d.rest for d in dofs])
        materials = [g.material for g in model.geoms] + [pair.material for pair in model.pair_materials]
        self.untold = (
            any(b.motion == "kinematic" and any(b.linear_velocity + b.angular_velocity) for b in model.bodies)
            or any(material.compliance for material in materials)
            or any(tendon.stiffness or tendon.armature for tendon in model.tendons)
        )
        self.surfaces = Surfaces(model)
        # Plus the largest kinetic energy so far; without gravity, that of a thousandth of a length in 1 s.
        weight = float(np.linalg.norm(model.gravity)) + 1e-6 * model.length
        self.scale = model.total_mass * weight * model.length
        own = [c for c in model.coordinates.values() if c.dof >= 0]
        self.dofs = [model.dof_index(c.joint, c.dof) for c in own]
        self.of_q, self.of_qd = [c.q.start for c in own], [c.qd.start for c in own]
        self.coordinates = simulation.q[self.of_q]
        driven = {
            model.dof_index(j, k)
            for j, joint in enumerate(model.joints)
            for k, dof in enumerate(joint.dofs)
            if dof.armature or dof.motor != amontons.Motor()
        } | {
            model.dof_index(a.transmission.joint, a.transmission.dof)
            for a in model.actuators
            if a.transmission.kind == "dof"
        }
        self.untold = self.untold or not driven <= set(self.dofs)
        # Those on degrees of freedom count among the motors there.
        self.others = np.array([a.transmission.kind != "dof" for a in model.actuators], dtype=bool)
        self.lengths = simulation.forces.actuator_efforts["length"][self.others]
        dynamic = np.array([b.motion == "dynamic" for b in model.bodies])
        weights = np.array([b.mass * b.gravity_scale for b in model.bodies]) * dynamic
        self.weights = np.outer(weights, model.gravity)
        self.centres = np.array([b.centre_of_mass for b in model.bodies]).reshape(-1, 3)
        self.last: float | None = None
        self.stored = 0.0  # of gravity and springs (J)
        self.gain, self.largest = 0.0, 0.0
        self.told: float | None = None

    def storing(self, rates: Array) -> float:
        """What the velocities of the end, with which bodies moved, put into gravity and springs."""
        dt = self.simulation.dt
        stretch = self.simulation.q[self.of_q] - 0.5 * dt * rates - self.rest[self.dofs]
        return dt * float(self.stiffness[self.dofs] * stretch @ rates) - dt * self.power_of_gravity()

    def power_of_gravity(self) -> float:
        """Along the velocities of the end (W)."""
        state = self.simulation.state
        w, q = state.orientations[:, :1], state.orientations[:, 1:]
        arms = self.centres + 2 * np.cross(q, np.cross(q, self.centres) + w * self.centres)
        velocities = state.linear_velocities + np.cross(state.angular_velocities, arms)
        return float(np.sum(self.weights * velocities))

    def add(self, report: amontons.Report) -> None:
        moved = self.simulation.q[self.of_q] - self.coordinates
        self.coordinates += moved
        efforts = self.simulation.forces.joint_efforts[self.dofs]
        others = self.simulation.forces.actuator_efforts[self.others]
        lengthened = others["length"] - self.lengths
        self.lengths = others["length"]
        rates = self.simulation.qd[self.of_qd]
        lift = 0.0
        if report.substeps == 1:
            dt = self.simulation.dt
            moved, lengthened = dt * rates, dt * others["rate"]
            lift = report.potential_energy + report.spring_energy - self.stored - self.storing(rates)
        self.stored = report.potential_energy + report.spring_energy
        work = float(efforts["motor"] @ moved + others["effort"] @ lengthened)
        work += self.surfaces.work(self.simulation)
        energy = report.energy + 0.5 * float(self.armature[self.dofs] @ rates**2)
        self.largest = max(self.largest, report.kinetic_energy)
        if self.last is not None:
            gain = energy - self.last - work - lift
            self.gain = max(self.gain, gain)
        self.last = energy
        if hasattr(report, "energy_balance"):
            self.told = max(self.told or 0.0, report.energy_balance)

    def facts(self) -> dict[str, Any]:
        scale = max(self.scale + self.largest, 1e-300)
        gains = [gain for gain in (None if self.untold else self.gain, self.told) if gain is not None]
        return {
            "energy_gain": None if self.untold else self.gain,
            "energy_balance": self.told,
            "energy_gain_relative": max(gains) / scale if gains else None,
        }


class Surfaces:
    """What surfaces that move by themselves (conveyors, turntables) give to bodies.

    Per contact the force f on A does the work f . (v_A - v_B) on the bodies. With the velocities s of the
    surfaces over them, u = v_A + s_A - v_B - s_B is what friction opposes, f . u <= 0: the rest,
    -f . (s_A - s_B), and the same of torques and spins, is the drive's. Only the tangential part of s counts.
    """

    def __init__(self, model: amontons.Model) -> None:
        self.geoms = [k for k, g in enumerate(model.geoms) if any(g.surface_velocity) or any(g.surface_spin)]
        self.model = model

    def work(self, simulation: amontons.Simulation) -> float:
        """Of the last step (J)."""
        total = 0.0
        contacts = simulation.contacts if self.geoms else ()
        for k in self.geoms:
            geom, link = self.model.geoms[k], None
            pose = amontons.Transform()
            if geom.body >= 0:
                link = simulation.kinematics.link(geom.body)
                pose = amontons.Transform(tuple(link["position"]), tuple(link["orientation"]))
            turn = amontons.Transform(rotation=pose.rotation)
            velocity, spin = (np.array(turn(v)) for v in (geom.surface_velocity, geom.surface_spin))
            origin = np.array((pose @ geom.frame).position)
            for side, sign in (("geom_a", -1.0), ("geom_b", 1.0)):
                rows = contacts[contacts[side] == k]
                moved = velocity + np.cross(spin, rows["point"] - origin)
                moved -= np.einsum("ij,ij->i", moved, rows["normal"])[:, None] * rows["normal"]
                total += sign * float(np.sum(rows["force"] * moved) + np.sum(rows["torque"] @ spin))
        return simulation.dt * total
