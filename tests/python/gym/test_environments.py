"""Environments of Gymnasium, and vectors of them."""

import subprocess
import sys
import time

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium")
pytest.importorskip("mujoco")

import amontons  # noqa: E402
import amontons.gym  # noqa: E402
from gymnasium.utils.env_checker import check_env  # noqa: E402

NAMES = list(amontons.gym.TASKS)
pytestmark = [
    pytest.mark.filterwarnings("error"),
    # Speeds have no bounds; Gymnasium's checker asks whether that is meant.
    pytest.mark.filterwarnings("ignore:.*Box observation space m.*imum value is -?infinity"),
]


def make(name, **options):
    return gymnasium.make(name, **options).unwrapped


# Breaks when Gymnasium's own rules are broken: spaces, types, seeds, determinism, pictures.
@pytest.mark.parametrize("name", NAMES)
def test_checker(name):
    check_env(make(name))


def episode(env, seed, steps=30):
    """Everything that an agent sees with random actions of the same seed."""
    seen = [env.reset(seed=seed)[0]]
    actions = np.random.default_rng(seed).uniform(-1, 1, (steps, *env.action_space.shape))
    for action in actions:
        observation, reward, terminated, truncated, _ = env.step(action)
        seen += [observation, [reward, terminated, truncated]]
        if terminated or truncated:
            break
    return np.concatenate(seen)


# Breaks when an episode depends on anything but its seed: what was simulated before, or another environment.
@pytest.mark.parametrize("name", NAMES)
def test_seeds(name):
    env = make(name)
    first = episode(env, 5)
    assert not np.array_equal(first[:10], episode(env, 6)[:10])
    assert np.array_equal(episode(env, 5), first)
    assert np.array_equal(episode(make(name), 5), first)


# Breaks when a world of a vector differs by a bit from the environment by itself, is not begun anew at the
# step after its end, or goes on beyond the limit of steps.
@pytest.mark.parametrize("name", NAMES)
def test_vector_is_as_single(name):
    count, steps, limit = 3, 25, 10
    vector = gymnasium.make_vec(
        name, count, vectorization_mode="vector_entry_point", max_episode_steps=limit, threads=2
    )
    single = [gymnasium.make(name, max_episode_steps=limit) for _ in range(count)]
    expected, ended = [env.reset(seed=11 + k)[0] for k, env in enumerate(single)], [False] * count
    observation, _ = vector.reset(seed=11)
    assert np.array_equal(observation, expected)
    assert vector.observation_space.contains(observation)
    actions = np.random.default_rng(0).uniform(-1, 1, (steps, count, *vector.single_action_space.shape))
    begun = 0
    for action in actions.astype(np.float32):
        observation, reward, terminated, truncated, info = vector.step(action)
        for k, env in enumerate(single):
            if ended[k]:
                row = (env.reset()[0], 0.0, False, False, {})
                begun += 1
            else:
                row = env.step(action[k])
            assert np.array_equal(observation[k], row[0])
            assert (reward[k], terminated[k], truncated[k]) == row[1:4]
            for key, value in row[4].items():
                assert np.array_equal(info[key][k], value)
                assert info[f"_{key}"][k]
            ended[k] = row[2] or row[3]
    assert begun >= 2 * count  # each of the worlds


# Breaks when seeds of single worlds, or resets without any, are taken otherwise.
def test_vector_seeds():
    vector = gymnasium.make_vec(NAMES[0], 2, vectorization_mode="vector_entry_point")
    first, _ = vector.reset(seed=[4, 9])
    assert np.array_equal(first[1], make(NAMES[0]).reset(seed=9)[0])
    again, _ = vector.reset()
    assert not np.array_equal(again, first)
    assert np.array_equal(vector.reset(seed=[4, None])[0][0], first[0])


# Breaks when the pole's world is wrong: linear feedback, gains by hand, keeps a pole upright to the end of an
# episode, and without it the pole falls.
@pytest.mark.parametrize("feedback", [True, False])
def test_cartpole(feedback):
    env = gymnasium.make("amontons/CartPole-v0")
    observation, _ = env.reset(seed=2)
    total, over = 0.0, False
    while not over:
        x, angle, speed, rate = observation
        # The pole turns about +y: an angle above zero leans to +x, and the cart must go there faster.
        action = 0.1 * x + 0.15 * speed + 2.5 * angle + 0.5 * rate if feedback else 0.0
        observation, reward, terminated, truncated, _ = env.step(np.clip([action], -1, 1))
        total += reward
        over = terminated or truncated
    assert (total == 500) is feedback
    assert terminated is not feedback


# Breaks when runners do not stand at first, or do not end when they lie down.
@pytest.mark.parametrize("name", ["Quadruped", "Walker"])
def test_runners(name):
    env = make(f"amontons/{name}-v0")
    env.reset(seed=1)
    _, reward, terminated, _, info = env.step(np.zeros(env.action_space.shape))
    assert not terminated
    assert abs(reward - 1 - info["x_velocity"]) < 1e-12  # no effort
    env.simulation.set_q({"torso": (0, 0, 0.1, 1, 0, 0, 0)} if name == "Quadruped" else {"up": -0.5})
    assert env.step(np.zeros(env.action_space.shape))[2]


# Breaks when the tip of the arm is not where its links end, the goal is not what the reward is about, or
# nothing can be pushed. The reference for the tip is the pose of the hand.
def test_pusher():
    env = make("amontons/Pusher-v0")
    observation, _ = env.reset(seed=3)
    task, simulation = env.task, env.simulation
    hand = simulation.model.body_index("hand")
    at, (w, _, _, z) = simulation.state.positions[hand], simulation.state.orientations[hand]
    tip = at[:2] + 0.12 * np.array([w * w - z * z, 2 * w * z])
    np.testing.assert_allclose(task.tip(simulation.q[None])[0], tip, atol=1e-6)
    np.testing.assert_allclose(observation[9:11], tip, atol=1e-6)
    goal = observation[-2:]
    start = task.puck(simulation.q[None])[0].copy()
    side = np.sign(start[1])
    for _ in range(60):
        observation, reward, _, _, info = env.step([side, 0, 0])
    puck = task.puck(simulation.q[None])[0]
    assert np.linalg.norm(puck - start) > 0.05
    assert info["distance"] == np.linalg.norm(puck - goal)
    expected = -info["distance"] - 0.5 * np.linalg.norm(puck - task.tip(simulation.q[None])[0]) - 0.01
    assert abs(reward - expected) < 1e-12


# Breaks when a world whose velocities run away takes the others or the training with it.
def test_a_world_that_fails():
    vector = gymnasium.make_vec("amontons/Quadruped-v0", 2, vectorization_mode="vector_entry_point").unwrapped
    vector.reset(seed=0)
    state = vector._worlds.simulations[1].state
    state.forces[0, 0], state.linear_velocities[0, 0] = 1.7e308, sys.float_info.max
    actions = np.zeros(vector.action_space.shape)
    observation, _, terminated, _, info = vector.step(actions)
    assert list(terminated) == [False, True]
    assert list(info["failed"]) == [False, True]
    assert np.isfinite(observation).all()
    after, _, terminated, _, info = vector.step(actions)
    assert np.isfinite(after).all()
    assert not terminated.any()
    assert list(info["_failed"]) == [True, False]


# Breaks when info lacks a term of the reward or the position, at a step or at the start.
@pytest.mark.parametrize("name", NAMES)
def test_info(name):
    env = make(name)
    _, begun = env.reset(seed=1)
    _, reward, _, _, info = env.step(env.action_space.sample())
    terms = [value for key, value in info.items() if key.startswith("reward_")]
    assert abs(reward - sum(terms)) < 1e-12 * max(1.0, *map(abs, terms))
    assert begun.keys() <= info.keys()
    assert isinstance(begun["x_position"], float)


# Breaks when a vector that begins episodes within the step differs from one that begins them at the next: the
# same worlds, observations and ends, but for the step between two episodes.
def test_same_step():
    name, count, limit = "amontons/Hopper-v5", 3, 7
    modes = gymnasium.vector.AutoresetMode
    options = dict(vectorization_mode="vector_entry_point", max_episode_steps=limit)
    later, same = (
        gymnasium.make_vec(name, count, autoreset_mode=mode, **options)
        for mode in (modes.NEXT_STEP, modes.SAME_STEP)
    )
    assert same.metadata["autoreset_mode"] == modes.SAME_STEP
    first, _ = later.reset(seed=3)
    assert np.array_equal(same.reset(seed=3)[0], first)
    for _ in range(2):
        for k in range(limit):
            actions = np.full(later.action_space.shape, 0.1 * k)
            expected, reward, terminated, truncated, info = later.step(actions)
            observation, *others, told = same.step(actions)
            assert all(map(np.array_equal, others, (reward, terminated, truncated)))
        assert truncated.all()
        assert np.array_equal(np.stack(told["final_obs"]), expected)
        assert np.array_equal(told["final_info"]["x_position"], info["x_position"])
        assert told["_x_position"].all()  # of the new episodes
        assert not told["_reward_forward"].any()  # of which there is none yet
        expected, *_ = later.step(actions)  # the first of the next episode
        assert np.array_equal(observation, expected)


# Breaks when what make is asked for is ignored: a kind of picture that is none, pictures of many worlds, an
# option that no task has, another way of beginning again.
def test_refusals():
    with pytest.raises(
        amontons.InputError, match="render_mode = 'depth_array'; give None, 'human' or 'rgb_a"
    ):
        amontons.gym.make(task=NAMES[0], render_mode="depth_array")
    with pytest.raises(amontons.InputError, match="for 2 worlds; give it to gymnasium.make"):
        amontons.gym.make_vector(task=NAMES[0], num_envs=2, render_mode="rgb_array")
    with pytest.raises(amontons.InputError, match="Hopper-v5 has no option 'frame_skip'; it has forward_rew"):
        amontons.gym.make(task="amontons/Hopper-v5", frame_skip=3)
    with pytest.raises(amontons.InputError, match="CartPole-v0 has no option 'mass'; it has none"):
        amontons.gym.make(task="amontons/CartPole-v0", mass=3)
    mode = gymnasium.vector.AutoresetMode.DISABLED
    with pytest.raises(amontons.InputError, match="give AutoresetMode.NEXT_STEP or AutoresetMode.SAME_STEP"):
        amontons.gym.make_vector(task=NAMES[0], num_envs=2, autoreset_mode=mode)


# Breaks when render_mode="human" shows nothing, the page does not follow the world, the shown world differs
# by a bit from one that is not shown, it runs ahead of real time, or close leaves the page.
def test_human():
    pytest.importorskip("viser")
    shown, hidden = make("amontons/CartPole-v0", render_mode="human"), make("amontons/CartPole-v0")
    assert np.array_equal(shown.reset(seed=1)[0], hidden.reset(seed=1)[0])
    begun = time.perf_counter()
    for _ in range(10):
        assert np.array_equal(shown.step([0.5])[0], hidden.step([0.5])[0])
    assert time.perf_counter() - begun > 9 * shown.task.interval
    assert shown.viewer.url.startswith("http://localhost:")
    assert shown.viewer.run.positions is not None
    assert np.array_equal(shown.viewer.run.positions, shown.simulation.state.positions)
    assert shown.render() is None
    shown.close()
    assert shown.viewer is None


# Breaks when make promises a page that cannot be.
def test_human_without_viewer():
    program = (
        "import sys; sys.modules['viser'] = None\n"
        "import amontons, amontons.gym\n"
        "try: amontons.gym.make(task='amontons/CartPole-v0', render_mode='human')\n"
        "except amontons.InputError as error: assert 'amontons[view]' in str(error)\n"
        "else: raise AssertionError"
    )
    subprocess.run([sys.executable, "-c", program], check=True)


# Breaks when an action that makes no sense is simulated.
def test_wrong_actions():
    env = make("amontons/Walker-v0")
    env.reset(seed=0)
    with pytest.raises(
        amontons.InputError, match=r"the action has the shape \(2,\); the environment asks for \(6,\)"
    ):
        env.step([0, 0])
    with pytest.raises(amontons.InputError, match="give finite numbers"):
        env.step(np.full(6, np.nan))


# Breaks when Gymnasium finds no environment by its name, importing the library drags it in, or its absence is
# told by a bare ImportError.
@pytest.mark.parametrize(
    "program",
    [
        "import gymnasium; gymnasium.make('amontons.gym:amontons/Ant-v5').reset(seed=1)",
        "import amontons, sys; assert 'gymnasium' not in sys.modules",
        "import sys; sys.modules['gymnasium'] = None\n"
        "try: import amontons.gym\n"
        "except ImportError as error: assert 'pip install amontons[gym]' in str(error)\n"
        "else: raise AssertionError",
    ],
)
def test_imports(program):
    subprocess.run([sys.executable, "-c", program], check=True)


class Lift(amontons.gym.Task):
    """Holds a mass by a servo: actions are about a height, the mass is another one in each episode."""

    dt, repeat = 5e-3, 2
    noise = 0.0, 0.0
    action_limits = -np.ones(1), np.ones(1)

    def __init__(self):
        builder = amontons.ModelBuilder()
        builder.add_body("load", shape=amontons.shapes.Sphere(0.1), mass=2.0)
        builder.add_prismatic_joint("load", axis=(0, 0, 1), name="rail")
        builder.add_actuator("lift", joint="rail", law="position", kp=500.0, kd=50.0)
        self.model = builder.build()

    def vary(self, model, random):
        return model.with_(mass={"load": random.uniform(1.0, 3.0)})

    def act(self, action, now):
        return 0.1 + 0.05 * action + 0.001 * now.time[:, None]

    def look(self, simulations):
        return {"control": np.array([world.controls for world in simulations])}

    def observe(self, now):
        return np.concatenate([now.q, now.qd, now.seen["control"], now.time[:, None]], axis=1)

    def judge(self, before, now):
        return amontons.gym.Outcome(-now.q[:, 0], np.zeros(len(now.q), dtype=bool), {})


# Breaks when actions go to the drives as they are, the time does not pass or begin again, or a variant is
# left from the episode before, or is another one in a vector of worlds.
def test_actions_time_and_variants():
    env = amontons.gym.Environment(Lift())
    assert env.action_space.low == env.action_space.high * -1 == -1
    env.reset(seed=4)
    mass = env.simulation.model.bodies[0].mass
    for step in range(3):
        observation, *_ = env.step([1.0])
        assert observation[2] == pytest.approx(0.15 + 0.001 * 0.01 * step)
        assert observation[3] == pytest.approx(0.01 * (step + 1))
    first = observation[0]
    observation, _ = env.reset()
    assert observation[3] == 0
    assert env.simulation.model.bodies[0].mass != mass
    vector = amontons.gym.VectorEnvironment(Lift(), 2)
    vector.reset(seed=3)
    for _ in range(3):
        observations, *_ = vector.step(np.ones((2, 1)))
    assert observations[1, 0] == first
    assert observations[0, 0] != first


# Breaks when what a task returns of the wrong shape or kind is taken.
def test_wrong_tasks():
    class Bad(Lift):
        def act(self, action, now):
            return np.zeros((len(action), 2))

    env = amontons.gym.Environment(Bad())
    env.reset(seed=1)
    with pytest.raises(amontons.InputError, match=r"Task.act returned the shape \(1, 2\)"):
        env.step([0.0])

    class Other(Lift):
        def vary(self, model, random):
            return amontons.ModelBuilder().build()

    with pytest.raises(amontons.InputError, match="Task.vary: model 1 has other"):
        amontons.gym.Environment(Other()).reset(seed=1)
