"""Tasks with models of our own: a pole on a cart, runners on four and two legs, an arm that pushes."""

from __future__ import annotations

from abc import abstractmethod
from math import cos, sin
from typing import ClassVar

import numpy as np

from ..checks import Array
from .task import Moment, Outcome, Task, sum_of_squares


def cosines(angles: Array) -> tuple[Array, Array]:
    """Cosines and sines; the last bit of NumPy's own depends on how many there are."""
    shaped = [np.reshape([f(x) for x in angles.ravel().tolist()], angles.shape) for f in (cos, sin)]
    return shaped[0], shaped[1]


class CartPole(Task):
    """Keep a pole upright on a cart that one motor pushes: 1 for every step that it stands.

    >>> gym.Environment(gym.CartPole()).action_space.shape
    (1,)
    """

    file = "cartpole.xml"

    def judge(self, before: Moment, now: Moment) -> Outcome:
        fallen = (np.abs(now.q[:, 1]) > 0.4) | (np.abs(now.q[:, 0]) > 1.5)  # rad, m
        survived = np.where(fallen, 0.0, 1.0)
        return Outcome(survived, fallen, {"reward_survive": survived})

    def locate(self, now: Moment) -> dict[str, Array]:
        return {"x_position": now.q[:, 0]}


class Runner(Task):
    """Run along x: the speed, 1 for staying up, less what the motors are used."""

    cost: ClassVar[float]
    """of the sum of the squares of the action"""

    @abstractmethod
    def is_up(self, q: Array) -> Array: ...

    def observe(self, now: Moment) -> Array:
        return np.concatenate([now.q[:, self.hidden :], now.qd], axis=1)

    hidden: ClassVar[int]
    """first entries of q that tell where it is, which does not matter"""

    def judge(self, before: Moment, now: Moment) -> Outcome:
        velocity = (now.q[:, 0] - before.q[:, 0]) / self.interval
        up = self.is_up(now.q)
        cost = self.cost * sum_of_squares(now.action)
        terms = {"reward_forward": velocity, "reward_survive": up * 1.0, "reward_ctrl": -cost}
        return Outcome(velocity + up - cost, ~up, {"x_velocity": velocity, **terms})

    def locate(self, now: Moment) -> dict[str, Array]:
        return {"x_position": now.q[:, 0]}


class Quadruped(Runner):
    """Four legs with two motors each and a free body; it is up while the body is off the ground.

    >>> gym.Environment(gym.Quadruped()).action_space.shape
    (8,)
    """

    file = "ant.xml"
    cost = 0.05
    hidden = 2

    def is_up(self, q: Array) -> Array:
        return (q[:, 2] > 0.17) & (q[:, 2] < 1.0)


class Walker(Runner):
    """Two legs with feet in a vertical plane, six motors; up is hips high and body upright.

    >>> gym.Environment(gym.Walker()).action_space.shape
    (6,)
    """

    file = "walker.xml"
    cost = 0.01
    hidden = 1

    def is_up(self, q: Array) -> Array:
        return (q[:, 1] > -0.35) & (q[:, 1] < 0.6) & (np.abs(q[:, 2]) < 1.0)


class Pusher(Task):
    """An arm with three motors pushes a puck over a table to a goal: less the distances to puck and goal.

    >>> gym.Environment(gym.Pusher()).action_space.shape
    (3,)
    """

    file = "pusher.xml"
    lengths: ClassVar = (0.3, 0.25, 0.12)
    """of the links, the last to the tip (m)"""

    def start(self, q: Array, random: np.random.Generator) -> tuple[Array, Array, Array]:
        at = self.column("puck")
        moved = q.copy()
        moved[:at] += random.uniform(-0.1, 0.1, at)
        # Beside the arm, which lies along x; puck and goal on the same side, apart from each other.
        angle = random.choice((-1.0, 1.0)) * random.uniform(0.6, 1.2, 2)
        distance = random.uniform((0.35, 0.3), (0.5, 0.55))
        places = distance[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
        moved[at : at + 2] = places[0]
        return moved, np.zeros(self.model.nv), places[1]

    def tip(self, q: Array) -> Array:
        """(worlds, 2), from the three angles."""
        along = cosines(np.cumsum(q[:, :3], axis=1))
        return np.stack(
            [sum(c[:, k] * length for k, length in enumerate(self.lengths)) for c in along], axis=1
        )

    def puck(self, q: Array) -> Array:
        at = self.column("puck")
        return q[:, at : at + 2]

    def observe(self, now: Moment) -> Array:
        at = self.model.coordinates["puck"].qd.start
        seen = [
            *cosines(now.q[:, :3]),
            now.qd[:, :3],
            self.tip(now.q),
            self.puck(now.q),
            now.qd[:, at : at + 2],
            now.goal,
        ]
        return np.concatenate(seen, axis=1)

    def judge(self, before: Moment, now: Moment) -> Outcome:
        terms = {
            "reward_dist": -self.distance(now),
            "reward_near": -0.5 * np.linalg.norm(self.puck(now.q) - self.tip(now.q), axis=1),
            "reward_ctrl": -0.01 * sum_of_squares(now.action),
        }
        reward = terms["reward_dist"] + terms["reward_near"] + terms["reward_ctrl"]
        return Outcome(reward, np.zeros(len(reward), dtype=bool), terms)

    def distance(self, now: Moment) -> Array:
        """From the puck to the goal (m)."""
        return np.linalg.norm(self.puck(now.q) - now.goal, axis=1)

    def locate(self, now: Moment) -> dict[str, Array]:
        x, y = self.puck(now.q).T
        return {"x_position": x, "y_position": y, "distance": self.distance(now)}
