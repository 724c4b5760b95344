"""Worlds side by side for Stable-Baselines3."""

import subprocess
import sys

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium")
pytest.importorskip("mujoco")


def adapter():
    """The module under test; skips where Stable-Baselines3 is not installed."""
    pytest.importorskip("stable_baselines3", reason="needs Stable-Baselines3: pip install stable-baselines3")
    import amontons.gym.sb3

    return amontons.gym.sb3


# Breaks when its absence is told by a bare ImportError, or importing the environments drags it in.
def test_import():
    program = (
        "import sys; sys.modules['stable_baselines3'] = None\n"
        "import amontons.gym\n"
        "try: import amontons.gym.sb3\n"
        "except ImportError as error: assert 'pip install stable-baselines3' in str(error)\n"
        "else: raise AssertionError"
    )
    subprocess.run([sys.executable, "-c", program], check=True)


# Breaks when the worlds differ from those of Stable-Baselines3's own adapter of single environments: the same
# observations, rewards, ends, terminal observations and infos, from the same seeds.
def test_is_as_dummy():
    sb3 = adapter()
    from stable_baselines3.common.vec_env import DummyVecEnv

    name, count, limit = "amontons/Hopper-v5", 3, 8
    worlds = sb3.make(name, count, max_episode_steps=limit)
    dummy = DummyVecEnv([lambda: gymnasium.make(name, max_episode_steps=limit)] * count)
    worlds.seed(7)
    dummy.seed(7)
    assert worlds.observation_space == dummy.observation_space
    assert worlds.action_space == dummy.action_space
    assert worlds.env_is_wrapped(gymnasium.Wrapper) == [False] * count
    # DummyVecEnv keeps observations in the type of the space.
    assert np.array_equal(worlds.reset(), dummy.reset())
    random, episodes = np.random.default_rng(0), 0
    for _ in range(3 * limit):
        actions = random.uniform(-1, 1, (count, 3)).astype(np.float32)
        (seen, rewards, ended, infos), (expected, *others, told) = worlds.step(actions), dummy.step(actions)
        assert np.array_equal(seen, expected)
        # DummyVecEnv keeps rewards in 32 bits.
        assert np.array_equal(rewards.astype(np.float32), others[0])
        assert np.array_equal(ended, others[1])
        for mine, theirs in zip(infos, told, strict=True):
            assert mine.keys() == theirs.keys()
            assert all(np.array_equal(mine[key], theirs[key]) for key in mine)
        episodes += ended.sum()
    assert episodes >= 2 * count
    assert [info.keys() for info in worlds.reset_infos] == [info.keys() for info in dummy.reset_infos]


# Breaks when a vector that begins episodes at another step is taken, or a wish that cannot be met is ignored.
def test_refusals():
    sb3 = adapter()
    from amontons import InputError

    later = gymnasium.make_vec("amontons.gym:amontons/CartPole-v0", 2)
    with pytest.raises(InputError, match=r"autoreset_mode=AutoresetMode.SAME_STEP; amontons.gym.sb3.make\("):
        sb3.SB3Worlds(later)
    worlds = sb3.make("amontons/CartPole-v0", 2)
    with pytest.raises(InputError, match="set_attr\\('mass'\\)"):
        worlds.set_attr("mass", 1)
    with pytest.raises(InputError, match="env_method\\('jump'\\)"):
        worlds.env_method("jump")
    with pytest.raises(InputError, match="no pictures"):
        worlds.get_images()
    worlds.close()


# Breaks when PPO does not learn from the worlds: in 16,384 steps, some seconds, the pole must stand for more
# than twice as long as without learning. An untrained policy holds it for about 23 steps.
def test_ppo_learns():
    sb3 = adapter()
    import torch
    from stable_baselines3 import PPO
    from stable_baselines3.common.vec_env import VecMonitor

    torch.set_num_threads(1)  # the networks are too small for more
    worlds = VecMonitor(sb3.make("amontons/CartPole-v0", 16))
    agent = PPO(
        "MlpPolicy", worlds, n_steps=64, batch_size=256, gamma=0.98, gae_lambda=0.9, seed=1, device="cpu"
    )
    returns = []
    for _ in range(2):
        agent.learn(8192, reset_num_timesteps=False)
        returns.append(np.mean([episode["r"] for episode in agent.ep_info_buffer]))
    assert returns[-1] > 46
