"""PPO of Stable-Baselines3 learns to balance a pole on a cart, or to run as a half-cheetah, in minutes.

    pip install amontons[gym] stable-baselines3
    python examples/learning/ppo.py cart_pole
    python examples/learning/ppo.py half_cheetah --steps 300000

16 worlds side by side on all cores. Prints the mean return of the last 100 episodes while it learns, then the
returns of 16 episodes in which the policy acts without noise.
"""

import argparse
from time import perf_counter

import amontons.gym.sb3
import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.vec_env import VecMonitor, VecNormalize

WORLDS = 16
CHOICES = {
    "cart_pole": (
        "amontons/CartPole-v0", 100_000,
        {"n_steps": 64, "batch_size": 256, "gamma": 0.98, "gae_lambda": 0.9},
    ),
    "half_cheetah": (
        "amontons/HalfCheetah-v5", 300_000,
        {"n_steps": 256, "batch_size": 512, "gamma": 0.99, "policy_kwargs": {"log_std_init": -1.0}},
    ),
}  # fmt: skip


class Told(BaseCallback):
    """Prints a line ten times."""

    def __init__(self, steps: int) -> None:
        super().__init__()
        self.every, self.next, self.begun = steps // 10, steps // 10, perf_counter()

    def _on_step(self) -> bool:
        if self.num_timesteps >= self.next and self.model.ep_info_buffer:
            self.next += self.every
            mean = np.mean([episode["r"] for episode in self.model.ep_info_buffer])
            print(
                f"{self.num_timesteps} steps, {perf_counter() - self.begun:.0f} s: return {mean:.0f}",
                flush=True,
            )
        return True


arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
arguments.add_argument("what", choices=list(CHOICES))
arguments.add_argument("--steps", type=int, help="of all worlds together")
given = arguments.parse_args()
name, steps, options = CHOICES[given.what]
steps = given.steps or steps

torch.set_num_threads(1)  # the networks are too small for more
worlds = VecNormalize(VecMonitor(amontons.gym.sb3.make(name, WORLDS)), gamma=options["gamma"])
agent = PPO("MlpPolicy", worlds, seed=1, device="cpu", **options)
agent.learn(steps, callback=Told(steps))

worlds.training = worlds.norm_reward = False
returns, _ = evaluate_policy(agent, worlds, n_eval_episodes=WORLDS, return_episode_rewards=True)
print(f"without noise: {np.min(returns):.0f} to {np.max(returns):.0f}, mean {np.mean(returns):.0f}")
