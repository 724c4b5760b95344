"""HalfCheetah, Hopper, Walker2d, Ant and Humanoid as in Gymnasium's environments v5 with MuJoCo.

Models, spaces, rewards, terminations, starts and the options of `make` that concern them are those of v5. The
models are read from the installed package `gymnasium`. Time steps and contacts are our own; docs/learning.md
lists the differences.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import inf
from pathlib import Path
from typing import ClassVar

import gymnasium
import numpy as np

from ..checks import Array
from ..simulation.simulation import Simulation
from .spatial import SpatialBodies
from .task import Moment, Outcome, Task, sum_of_squares

Range = tuple[float, float]


@dataclass(kw_only=True)
class Locomotion(Task):
    """Run along x: the speed, so much for being healthy, less costs of motors and contacts."""

    forward_reward_weight: float = 1.0
    """of the speed along x (s/m)"""
    ctrl_cost_weight: float = 0.1
    """of the sum of the squares of the action"""
    reset_noise_scale: float = 0.1
    """of q (uniform up to it; m, rad) and qd (m/s, rad/s) at the start"""
    exclude_current_positions_from_observation: bool = True
    """x, and y if it is not planar"""

    folder: ClassVar[Path] = Path(gymnasium.__file__).parent / "envs" / "mujoco" / "assets"
    planar: ClassVar[bool] = True
    normal_noise: ClassVar[bool] = False
    """whether qd is normally distributed at the start; else uniform"""
    clipped_velocity: ClassVar[float] = inf
    """qd is seen up to it (m/s, rad/s)"""

    def start(self, q: Array, random: np.random.Generator) -> tuple[Array, Array, Array]:
        scale = self.reset_noise_scale
        moved = q + random.uniform(-scale, scale, q.shape)
        if self.normal_noise:
            return moved, scale * random.standard_normal(self.model.nv), np.zeros(0)
        return moved, random.uniform(-scale, scale, self.model.nv), np.zeros(0)

    def observe(self, now: Moment) -> Array:
        hidden = (1 if self.planar else 2) * self.exclude_current_positions_from_observation
        velocity = np.clip(now.qd, -self.clipped_velocity, self.clipped_velocity)
        return np.concatenate([now.q[:, hidden:], velocity], axis=1)

    def survived(self, now: Moment) -> tuple[Array | None, Array]:
        """The reward for being healthy, None where that is no matter, and where the episode ends."""
        return None, np.zeros(len(now.q), dtype=bool)

    def place(self, now: Moment) -> Array:
        """(worlds, 1 or 2), whose change is the speed (m)."""
        return now.q[:, : 1 if self.planar else 2]

    def contact_cost(self, now: Moment) -> Array | None:
        """None where contacts cost nothing."""
        return None

    def judge(self, before: Moment, now: Moment) -> Outcome:
        velocity = (self.place(now) - self.place(before)) / self.interval
        reward = self.forward_reward_weight * velocity[:, 0]
        cost = self.ctrl_cost_weight * sum_of_squares(now.action)
        terms = {"reward_forward": reward, "reward_ctrl": -cost}
        survived, terminated = self.survived(now)
        if survived is not None:
            terms["reward_survive"] = survived
            reward = reward + survived
        if (contact_cost := self.contact_cost(now)) is not None:
            terms["reward_contact"] = -contact_cost
            cost = cost + contact_cost
        speeds = dict(zip(("x_velocity", "y_velocity"), velocity.T, strict=False))
        return Outcome(reward - cost, terminated, {**speeds, **terms})

    def locate(self, now: Moment) -> dict[str, Array]:
        if self.planar:
            return {"x_position": now.q[:, 0]}
        x, y = now.q[:, 0], now.q[:, 1]
        return {"x_position": x, "y_position": y, "distance_from_origin": np.sqrt(x * x + y * y)}


@dataclass(kw_only=True)
class HalfCheetah(Locomotion):
    """Two legs of three links on a back, in a vertical plane; it cannot fail.

    >>> gym.Environment(gym.HalfCheetah()).action_space.shape
    (6,)
    """

    file = "half_cheetah.xml"
    dt, repeat = 0.01, 5
    normal_noise = True


@dataclass(kw_only=True)
class Mortal(Locomotion):
    """Healthy within limits of its state, and the episode ends beyond them."""

    healthy_reward: float = 1.0
    """of each step after which it is healthy"""
    terminate_when_unhealthy: bool = True

    @abstractmethod
    def is_healthy(self, now: Moment) -> Array: ...

    def survived(self, now: Moment) -> tuple[Array | None, Array]:
        healthy = self.is_healthy(now)
        return healthy * self.healthy_reward, ~healthy & self.terminate_when_unhealthy


@dataclass(kw_only=True)
class PlanarWalker(Mortal):
    """Healthy while it is upright."""

    ctrl_cost_weight: float = 1e-3
    healthy_z_range: Range = (0.8, 2.0)
    """of the torso (m)"""
    healthy_angle_range: Range = (-1.0, 1.0)
    """of the torso (rad)"""
    reset_noise_scale: float = 5e-3

    clipped_velocity = 10.0
    dt, repeat = 0.004, 2

    def is_healthy(self, now: Moment) -> Array:
        return is_between(now.q[:, 1], self.healthy_z_range) & is_between(
            now.q[:, 2], self.healthy_angle_range
        )

    def locate(self, now: Moment) -> dict[str, Array]:
        return {**super().locate(now), "z_distance_from_origin": now.q[:, 1] - self.height}

    @cached_property
    def height(self) -> float:
        """Height of the torso at the start of the model (m)."""
        return float(Simulation(self.model, on_failure="ignore").q[1])


@dataclass(kw_only=True)
class Hopper(PlanarWalker):
    """One leg of three links, in a vertical plane.

    >>> gym.Environment(gym.Hopper()).action_space.shape
    (3,)
    """

    healthy_state_range: Range = (-100.0, 100.0)
    """of each entry of q and qd after x and z"""
    healthy_z_range: Range = (0.7, inf)
    healthy_angle_range: Range = (-0.2, 0.2)

    file = "hopper.xml"

    def is_healthy(self, now: Moment) -> Array:
        state = np.concatenate([now.q, now.qd], axis=1)[:, 2:]
        return super().is_healthy(now) & is_between(state, self.healthy_state_range).all(axis=1)


@dataclass(kw_only=True)
class Walker2d(PlanarWalker):
    """Two legs of three links, in a vertical plane.

    >>> gym.Environment(gym.Walker2d()).action_space.shape
    (6,)
    """

    file = "walker2d_v5.xml"


@dataclass(kw_only=True)
class SpatialLocomotion(Mortal):
    """In space; contact forces on its bodies are seen and cost something."""

    healthy_z_range: Range = (0.2, 1.0)
    """of the torso (m)"""
    contact_cost_weight: float = 5e-4
    """of the sum of the squares of the contact forces and torques"""
    include_cfrc_ext_in_observation: bool = True

    planar = False

    @cached_property
    def bodies(self) -> SpatialBodies:
        return SpatialBodies(self.model, self.folder / self.file)


@dataclass(kw_only=True)
class Ant(SpatialLocomotion):
    """Four legs of two links under a ball.

    >>> gym.Environment(gym.Ant()).action_space.shape
    (8,)
    """

    ctrl_cost_weight: float = 0.5
    contact_force_range: Range = (-1.0, 1.0)
    """of each entry of the contact forces (N) and torques (N m)"""

    file = "ant.xml"
    dt, repeat = 0.01, 5
    normal_noise = True

    def is_healthy(self, now: Moment) -> Array:
        least, most = self.healthy_z_range
        finite = np.isfinite(now.q).all(axis=1) & np.isfinite(now.qd).all(axis=1)
        return finite & (least <= now.q[:, 2]) & (now.q[:, 2] <= most)

    def look(self, simulations: Sequence[Simulation]) -> dict[str, Array]:
        forces = self.bodies.contact_forces(simulations, self.bodies.motion(simulations))
        return {"cfrc_ext": np.clip(forces, *self.contact_force_range)}

    def contact_cost(self, now: Moment) -> Array:
        return self.contact_cost_weight * sum_of_squares(flat(now.seen["cfrc_ext"]))

    def observe(self, now: Moment) -> Array:
        parts = [super().observe(now)]
        if self.include_cfrc_ext_in_observation:
            parts.append(flat(now.seen["cfrc_ext"][:, 1:]))
        return np.concatenate(parts, axis=1)


@dataclass(kw_only=True)
class Humanoid(SpatialLocomotion):
    """Two legs, two arms, a waist: 17 motors.

    >>> gym.Environment(gym.Humanoid()).action_space.shape
    (17,)
    """

    forward_reward_weight: float = 1.25
    healthy_reward: float = 5.0
    healthy_z_range: Range = (1.0, 2.0)
    contact_cost_weight: float = 5e-7
    contact_cost_range: Range = (-inf, 10.0)
    reset_noise_scale: float = 1e-2
    include_cinert_in_observation: bool = True
    include_cvel_in_observation: bool = True
    include_qfrc_actuator_in_observation: bool = True

    file = "humanoid.xml"
    dt, repeat = 0.005, 3

    def is_healthy(self, now: Moment) -> Array:
        return is_between(now.q[:, 2], self.healthy_z_range)

    def look(self, simulations: Sequence[Simulation]) -> dict[str, Array]:
        motion = self.bodies.motion(simulations)
        return {
            "centre": motion.centre,
            "cinert": self.bodies.inertias(motion),
            "cvel": self.bodies.velocities(motion),
            "cfrc_ext": self.bodies.contact_forces(simulations, motion),
        }

    def place(self, now: Moment) -> Array:
        return now.seen["centre"][:, :2]

    def contact_cost(self, now: Moment) -> Array:
        cost = self.contact_cost_weight * sum_of_squares(flat(now.seen["cfrc_ext"]))
        return np.clip(cost, *self.contact_cost_range)

    def observe(self, now: Moment) -> Array:
        parts = {
            "cinert": (self.include_cinert_in_observation, now.seen["cinert"]),
            "cvel": (self.include_cvel_in_observation, now.seen["cvel"]),
            "qfrc_actuator": (self.include_qfrc_actuator_in_observation, self.joint_torques(now.action)),
            "cfrc_ext": (self.include_cfrc_ext_in_observation, now.seen["cfrc_ext"][:, 1:]),
        }
        seen = [flat(values) for wanted, values in parts.values() if wanted]
        return np.concatenate([super().observe(now), *seen], axis=1)

    def joint_torques(self, action: Array) -> Array:
        """Torques of the motors on each joint, (worlds, nv - 6) (N m)."""
        at = {(c.joint, c.dof): c.qd.start for c in self.model.coordinates.values()}
        torques = np.zeros((len(action), self.model.nv))
        for k, drive in enumerate(self.model.actuators):
            held = np.clip(action[:, k], drive.lower_control, drive.upper_control)
            moved = drive.transmission
            torques[:, at[moved.joint, moved.dof]] = moved.gear * held
        return torques[:, 6:]

    def locate(self, now: Moment) -> dict[str, Array]:
        hips_and_knees = [
            [self.model.coordinates[f"{side}_{joint}"] for joint in ("hip_y", "knee")]
            for side in ("left", "right")
        ]
        at = [[part.q.start for part in pair] for pair in hips_and_knees]
        rates = [[part.qd.start for part in pair] for pair in hips_and_knees]
        return {
            **super().locate(now),
            "tendon_length": np.stack([now.q[:, knee] - now.q[:, hip] for hip, knee in at], axis=1),
            "tendon_velocity": np.stack([now.qd[:, knee] - now.qd[:, hip] for hip, knee in rates], axis=1),
        }


def flat(values: Array) -> Array:
    return values.reshape(len(values), -1)


def is_between(values: Array, limits: Range) -> Array:
    least, most = limits
    return (least < values) & (values < most)
