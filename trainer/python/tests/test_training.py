"""Training: lock-step, ask and tell, checkpoints, bad input."""

import copy
import textwrap
import time

import gymnasium
import numpy as np
import pytest
from conftest import SMALL, interrupt

import tpg


def train(make_env="CartPole-v1", **how):
    how = {"seed": 1, "generations": 3, "settings": SMALL, "progress": False, "num_envs": 4} | how
    return tpg.train(make_env, **how)


def spaces():
    env = gymnasium.make("CartPole-v1")
    return env.observation_space, env.action_space


def vector(mode, num_envs=4):
    return lambda: gymnasium.make_vec(
        "CartPole-v1", num_envs, vectorization_mode="sync", vector_kwargs={"autoreset_mode": mode}
    )


@pytest.mark.parametrize("preset", ["sr-sm", "cartpole-champion", "cartpole-per-generation", "sr-sm-b23"])
def test_one_seed_gives_one_champion_for_any_number_of_environments(preset):
    modes = gymnasium.vector.AutoresetMode
    settings = SMALL | {"front-end.standardise": True} if preset == "sr-sm" else SMALL
    if preset.startswith("cartpole"):
        # These presets hide velocities, which an environment does not mark.
        settings = settings | {"observability": []}
    runs = [
        train(preset=preset, num_envs=1, settings=settings),
        train(preset=preset, num_envs=7, settings=settings),
        train(vector(modes.DISABLED), preset=preset, settings=settings),
    ]
    assert len({run.policy.to_bytes() for run in runs}) == 1
    assert runs[0].generations == 3 and len(runs[0].log["best"]) == 3


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_environments_that_reset_themselves_are_repeatable(mode):
    mode = gymnasium.vector.AutoresetMode(mode)
    first, second = train(vector(mode)), train(vector(mode))
    assert first.policy.to_bytes() == second.policy.to_bytes()
    assert (first.log["steps"] == second.log["steps"]).all()


def test_the_order_of_memory_of_observations_does_not_matter():
    class Transposed(gymnasium.vector.VectorObservationWrapper):
        def observations(self, observations):
            return np.asfortranarray(observations)

    make = vector(gymnasium.vector.AutoresetMode.DISABLED)
    turned = train(lambda: Transposed(make()))
    assert turned.policy.to_bytes() == train(make).policy.to_bytes()


def test_returns_are_those_of_the_environment():
    result = train(generations=2)
    scores = tpg.evaluate(result.policy, "CartPole-v1", episodes=6, num_envs=4)
    assert scores.returns.shape == (6,)
    # CartPole pays 1 a step.
    assert (scores.returns == scores.lengths).all()
    assert scores.interval[0] <= scores.mean <= scores.interval[1]
    again = tpg.evaluate(result.policy, "CartPole-v1", episodes=6, num_envs=1)
    assert (again.returns == scores.returns).all()


def by_hand(evolution, generations):
    """Scores without a rollout, one environment after another."""
    env = gymnasium.make("CartPole-v1")
    while evolution.generation < generations:
        batch = evolution.ask()
        shape = len(batch), batch.episodes
        returns, lengths = np.zeros(shape), np.zeros(shape, int)
        for k, policy in enumerate(batch):
            for e in range(batch.episodes):
                observation, _ = env.reset(seed=int(batch.env_seeds[k, e]))
                policy.reset(int(batch.policy_seeds[k, e]), agent=e == 0)
                over = False
                while not over:
                    observation, reward, terminated, truncated, _ = env.step(policy.act(observation))
                    over = terminated or truncated
                    returns[k, e] += reward
                    lengths[k, e] += 1
        evolution.tell(returns, lengths)


def test_ask_and_tell_and_train_find_the_same_champion():
    about = {"name": "CartPole-v1", "max_steps": 500, "period": 0.02}
    with tpg.Evolution("sr-sm", *spaces(), seed=1, settings=SMALL, **about) as evolution:
        by_hand(evolution, 2)
        champion = evolution.champion.to_bytes()
    assert champion == train(generations=2).policy.to_bytes()


def test_a_checkpoint_goes_on_to_the_same_bytes(tmp_path):
    path = tmp_path / "run.checkpoint"
    about = {"name": "CartPole-v1", "max_steps": 500, "period": 0.02}
    with tpg.Evolution("sr-sm", *spaces(), seed=1, settings=SMALL, **about) as evolution:
        by_hand(evolution, 1)
        evolution.ask()
        evolution.save(path)
    with tpg.Evolution.load(path, *spaces(), **about) as evolution:
        assert evolution.generation == 1
        by_hand(evolution, 3)
        champion = evolution.champion.to_bytes()
    assert champion == train(generations=3).policy.to_bytes()
    with pytest.raises(ValueError, match="for another environment: .* steps.*, not .*at most 400 steps"):
        tpg.Evolution.load(path, *spaces(), **about | {"max_steps": 400})


def test_a_run_folder_is_resumed_to_the_same_bytes(tmp_path):
    whole, halves = tmp_path / "whole", tmp_path / "halves"
    expected = train(out=whole, generations=4)
    train(out=halves, generations=2)
    resumed = train(out=halves, generations=4, resume=True, num_envs=3)
    assert resumed.policy.to_bytes() == expected.policy.to_bytes()
    assert (whole / "champion.tpg").read_bytes() == (halves / "champion.tpg").read_bytes()
    assert list(resumed.log["generation"]) == [1, 2, 3, 4]
    with pytest.raises(ValueError, match="holds a run already"):
        train(out=halves)


class Broken(gymnasium.Wrapper):
    """Misbehaves in a step of its own, counted over all instances."""

    steps = 0

    def __init__(self, what):
        super().__init__(gymnasium.make("CartPole-v1"))
        self.what = what

    def step(self, action):
        observation, *rest = self.env.step(action)
        Broken.steps += 1
        if Broken.steps == 2500:
            if self.what == "raise":
                raise ZeroDivisionError("the motor")
            if self.what == "shape":
                observation = observation[:3]
            if self.what == "reward":
                rest[0] = float("nan")
        return observation, *rest


@pytest.mark.parametrize(
    ("what", "error", "message"),
    [
        ("raise", tpg.EnvironmentFailed, "environment [0-3] failed in a step: ZeroDivisionError: the motor"),
        ("shape", tpg.EnvironmentFailed, r"has shape \(3,\), but its space says \(4,\)"),
        ("reward", ValueError, "the reward of environment [0-3] is NaN in step [0-9]+ of its episode"),
    ],
)
def test_a_broken_environment_says_where_and_loses_nothing(tmp_path, what, error, message):
    Broken.steps = 0
    with pytest.raises(error, match=message):
        train(lambda: Broken(what), out=tmp_path / "run", generations=50)
    assert Broken.steps >= 2500
    resumed = train(lambda: Broken("nothing"), out=tmp_path / "run", generations=4, resume=True)
    assert resumed.policy.to_bytes() == train(name="CartPole-v1", generations=4).policy.to_bytes()


class Unsteady(gymnasium.Wrapper):
    """Changes one of its spaces, or what it observes, in its third episode."""

    def __init__(self, change):
        super().__init__(gymnasium.make("CartPole-v1"))
        self.change, self.episodes, self.observes = change, 0, np.float32
        # Its own, since environments of one id share theirs.
        self.observation_space = copy.deepcopy(self.env.observation_space)

    def reset(self, **how):
        self.episodes += 1
        if self.episodes == 3:
            self.change(self)
        observation, info = self.env.reset(**how)
        return observation.astype(self.observes), info


def box(**how):
    return gymnasium.spaces.Box(**({"low": -1, "high": 1, "shape": (4,)} | how))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda env: setattr(env, "observation_space", box(low=-2)), r"has the observation_space Box\(-2.0, 1.0"),
        (lambda env: setattr(env, "observation_space", box(dtype=np.float64)), "float64"),
        (lambda env: setattr(env, "observation_space", gymnasium.spaces.MultiBinary(4)), r"MultiBinary\(4\), but it must stay Box"),
        (lambda env: setattr(env, "action_space", gymnasium.spaces.Discrete(3)), r"Discrete\(3\), but it must stay Discrete\(2\)"),
        (lambda env: env.observation_space.high.fill(7), "has the observation_space .* to .*7.0"),
        (lambda env: setattr(env, "observes", complex), "the observation is of complex128"),
        (lambda env: setattr(env, "observes", "U8"), "the observation is of <U8, which is no type of real numbers"),
    ],
    ids=["bounds", "dtype", "kind", "actions", "in-place", "complex", "text"],
)
def test_a_space_that_changes_is_noticed(change, message):
    with pytest.raises(tpg.EnvironmentFailed, match=f"environment [01] .*{message}"):
        train(lambda: Unsteady(change), num_envs=2)


def test_environments_must_be_alike():
    made = []

    def make():
        made.append(gymnasium.make("CartPole-v1"))
        if len(made) == 3:
            made[-1].observation_space = box()
        return made[-1]

    with pytest.raises(tpg.EnvironmentFailed, match="environment 2 has the observation_space Box"):
        train(make)


@pytest.mark.parametrize("change", [{"dtype": np.float64}, {"low": -3}])
def test_a_vector_that_changes_its_space_is_noticed(change):
    class Changing(gymnasium.vector.VectorWrapper):
        steps = 0

        def step(self, actions):
            self.steps += 1
            if self.steps == 20:
                self.single_observation_space = box(**change)
            return self.env.step(actions)

    make = vector(gymnasium.vector.AutoresetMode.NEXT_STEP)
    with pytest.raises(tpg.EnvironmentFailed, match="the vector environment has the single_observation_space"):
        train(lambda: Changing(make()))


def test_answers_that_make_no_sense_can_be_told_again():
    with tpg.Evolution("sr-sm", *spaces(), seed=1, settings=SMALL) as evolution:
        with pytest.raises(RuntimeError, match="call ask first"):
            evolution.tell(np.zeros((30, 2)), np.zeros((30, 2)))
        batch = evolution.ask()
        right = np.ones((len(batch), 2))
        for returns, lengths, message in [
            (right[:-1], right, "returns has shape"),
            (np.where(np.arange(2) == 1, np.nan, right), right, "the return of policy 0, episode 1 is NaN"),
            (right, -right, "the length of policy 0, episode 0 is -1"),
        ]:
            with pytest.raises(ValueError, match=message):
                evolution.tell(returns, lengths)
        with pytest.raises(ValueError, match="not done"):
            evolution.tell(batch.rollout(3))
        assert evolution.tell(right, right)["generation"] == 1
    with pytest.raises(RuntimeError, match="closed"):
        evolution.ask()


def test_settings_and_spaces_that_make_no_sense():
    box = gymnasium.spaces.Box(-1, 1, (2,))
    for args, error, message in [
        (("sr-smm", *spaces()), ValueError, "sr-sm"),
        (("sr-sm", gymnasium.spaces.Sequence(box), box), TypeError, "cannot be flattened"),
        (("sr-sm", box, gymnasium.spaces.MultiBinary(3)), TypeError, "neither Discrete nor a Box"),
        (("sr-sm", box, gymnasium.spaces.Box(-np.inf, 1, (2,))), ValueError, "finite bounds"),
    ]:
        with pytest.raises(error, match=message):
            tpg.Evolution(*args)
    with pytest.raises(ValueError, match="evolution.population"):
        train(settings={"evolution.populaton": 3})
    with pytest.raises(ValueError, match="no terms of it can be weighted"):
        train(settings={"evaluation.shaping.alive": 0.5})
    with pytest.raises(ValueError, match="give one of generations, steps and minutes"):
        train(steps=10)
    same = gymnasium.make("CartPole-v1")
    with pytest.raises(ValueError, match="the same environment twice"):
        train(lambda: same)
    with pytest.raises(ValueError, match="it has 11 inputs, the environment offers 4"):
        from conftest import champion_of

        tpg.evaluate(champion_of("hopper-b23"), "CartPole-v1", observability="none")


class Steering(gymnasium.Env):
    """Wants the sum of both actions to be as large as it may be; their bounds differ, as those of CarRacing do."""

    observation_space = gymnasium.spaces.Box(np.float32([-np.inf, 0]), np.float32([3, np.inf]))
    action_space = gymnasium.spaces.Box(np.float32([-2, 0]), np.float32([-1, 5]))

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        return self.np_random.random(2, np.float32), {}

    def step(self, action):
        assert self.action_space.contains(action)
        return self.np_random.random(2, np.float32), float(action.sum()), False, False, {}


def test_each_value_of_an_action_has_its_own_bounds():
    run = train(Steering, preset="sr-sm", max_steps=5, period=0.1)
    assert run.policy.action_space == Steering.action_space
    assert run.policy.observation_space == Steering.observation_space
    assert tpg.evaluate(run.policy, Steering, episodes=2, observability="none", max_steps=5).mean >= -10
    with pytest.raises(ValueError, match="chooses value 0 from -2 to -1, the environment takes it from -2 to 5"):

        class Other(Steering):
            action_space = gymnasium.spaces.Box(np.float32([-2, 0]), np.float32([5, 5]))

        tpg.evaluate(run.policy, Other, episodes=2, observability="none", max_steps=5)


@pytest.mark.parametrize("space", ["FrozenLake-v1", "Pendulum-v1"])
def test_other_spaces_train(space):
    assert train(space, generations=1).policy is not None


def test_a_callback_ends_the_run_and_minutes_end_it_too():
    assert train(callback=lambda report, _: report["generation"] < 2, generations=50).generations == 2
    started = time.monotonic()
    train(generations=None, minutes=0.02)
    assert time.monotonic() - started < 10


def test_an_interrupt_ends_within_a_second_and_the_run_goes_on(tmp_path):
    script = textwrap.dedent(f"""
        import tpg
        tpg.train("CartPole-v1", seed=1, generations=1000, settings={SMALL}, progress=False, num_envs=4, out="run",
                  callback=lambda report, _: print("generation", flush=True))
    """)
    interrupt(script, tmp_path)
    generations = tpg.train("CartPole-v1", out=tmp_path / "run", resume=True, generations=1, progress=False).generations
    assert generations >= 1
