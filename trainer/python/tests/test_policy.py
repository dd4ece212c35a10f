"""Exported policies: their decisions, their descriptions, bad input."""

import copy
import pickle
import subprocess

import gymnasium
import numpy as np
import pytest
from conftest import CHAMPIONS, ROOT, act_all, champion_of, observations

import tpg


def same_bits(a: np.ndarray, b: np.ndarray) -> bool:
    a, b = np.asarray(a), np.asarray(b)
    return a.shape == b.shape and (np.ascontiguousarray(a).view(np.uint8) == np.ascontiguousarray(b).view(np.uint8)).all()


def test_every_decision_is_the_trainers(champion):
    rows = observations(champion, 2000)
    decided = act_all(champion, rows, seed=7)
    expected = champion._replay(rows, 7)
    assert same_bits(decided, expected.astype(decided.dtype))
    assert len(np.unique(decided, axis=0)) > 1


def test_there_are_champions():
    assert len(CHAMPIONS) == 6


def test_spaces_names_and_the_rest_describe_the_policy():
    policy = champion_of("hopper-b23")
    observation_space, action_space = policy.spaces
    assert observation_space.shape == (11,) and action_space == gymnasium.spaces.Box(-1, 1, (3,), np.float32)
    assert len(policy.names) == len(policy.units) == 14
    assert policy.task.startswith("hopper-v") and policy.observability == "blackout:2/3"
    assert policy.period == pytest.approx(0.008)
    assert len(bytes.fromhex(policy.provenance)) == 16
    assert policy.bounds["instructions"] >= 1 and policy.bounds["state_bytes"] < 100_000
    policy.act(np.ones(11, np.float32))
    assert 0 < policy.instructions <= policy.bounds["instructions"]
    assert champion_of("cartpole").action_space == gymnasium.spaces.Discrete(2)
    assert "hopper" in repr(policy)


def test_actions_lie_in_their_space(champion):
    for action in act_all(champion, 100 * observations(champion, 200)):
        assert champion.action_space.contains(action)


def test_float64_is_rounded_once_and_strides_do_not_matter(champion):
    rows = observations(champion, 100).astype(np.float64) + 1e-9
    expected = act_all(champion, rows.astype(np.float32))
    assert same_bits(act_all(champion, rows), expected)
    assert same_bits(act_all(champion, np.asfortranarray(rows)), expected)
    assert same_bits(act_all(champion, [list(row) for row in rows]), expected)


def test_a_batch_decides_as_its_rows_do(champion):
    count, steps = 5, 40
    rows = np.stack([observations(champion, steps, seed) for seed in range(count)], axis=1)
    champion.reset_batch(range(count))
    batched = np.array([champion.act_batch(row) for row in rows])
    for k in range(count):
        alone = act_all(champion, rows[:, k], seed=k)
        assert same_bits(batched[:, k], alone.astype(batched.dtype))


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_batch_in_another_order_of_memory_decides_alike(champion, dtype):
    rows = observations(champion, 12).astype(dtype)
    decided = []
    for batch in (rows, np.asfortranarray(rows), np.repeat(rows, 2, axis=0)[::2], rows[::-1][::-1]):
        champion.reset_batch(range(len(rows)))
        decided.append(champion.act_batch(batch))
    for other in decided[1:]:
        assert same_bits(other, decided[0])


def test_a_mask_resets_its_rows_alone():
    policy = champion_of("hopper-b23")
    rows = observations(policy, 30)
    # At a blank observation the front end goes by what it saw before.
    rows[0] = 0
    policy.reset_batch([1, 2])
    first = [policy.act_batch(np.stack([row, row])) for row in rows]
    policy.reset_batch([1, 2], mask=[True, False])
    second = [policy.act_batch(np.stack([row, row])) for row in rows]
    assert same_bits([row[0] for row in first], [row[0] for row in second])
    assert not same_bits([row[1] for row in first], [row[1] for row in second])


def test_copies_go_on_alike_and_apart(champion):
    rows = observations(champion, 60)
    act_all(champion, rows[:30])
    twin, deep = copy.copy(champion), copy.deepcopy(champion)
    expected = [champion.act(row) for row in rows[30:]]
    for other in (twin, deep):
        assert same_bits([other.act(row) for row in rows[30:]], expected)


def test_a_pickled_policy_is_one_just_loaded(champion):
    rows = observations(champion, 30)
    expected = act_all(champion, rows, seed=0)
    loaded = pickle.loads(pickle.dumps(champion))
    assert type(loaded) is tpg.Policy
    assert same_bits([loaded.act(row) for row in rows], expected)
    assert loaded.to_bytes() == champion.to_bytes()


def test_predict_runs_several_environments_and_restarts_them():
    model = tpg.PolicyWrapper(champion_of("hopper-b23"))
    rows = observations(model.policy, 20)
    state, start, actions = None, None, []
    for t, row in enumerate(rows):
        start = np.array([t == 10, False])
        action, state = model.predict(np.stack([row, row]), state, start, deterministic=True)
        actions.append(action)
    assert np.shape(actions) == (20, 2, 3)
    policy = champion_of("hopper-b23")
    assert same_bits([row[1] for row in actions], act_all(policy, rows))
    single, _ = model.predict(rows[0])
    assert single.shape == (3,)


def test_a_policy_writes_its_file(tmp_path, champion):
    path = tmp_path / "again.tpg"
    champion.save(path)
    assert tpg.Policy(path).to_bytes() == champion.to_bytes()
    assert "team" in champion.disassemble()


def test_export_to_c_compiles(tmp_path):
    header, source = champion_of("hopper-b23").export_c(tmp_path / "hopper.c")
    assert header.read_text() and source.read_text()
    subprocess.run(["cc", "-std=c99", "-Wall", "-Werror", "-ffp-contract=off", "-c", source.name], cwd=tmp_path, check=True)
    rust = champion_of("hopper-b23").export_rust(tmp_path / "hopper.rs")
    assert "tpg_runtime" in rust.read_text()


@pytest.mark.parametrize("name", ["a-b.c", "1a.c", ".c"])
def test_a_c_module_needs_an_identifier(tmp_path, name):
    with pytest.raises(ValueError, match="only letters, digits and _"):
        champion_of("cartpole").export_c(tmp_path / name)


def test_wrong_shapes_and_types_say_what_is_wrong():
    policy = champion_of("hopper-b23")
    good = np.ones(11, np.float32)
    policy.reset(3)
    before = policy.act(good)
    policy.reset(3)
    for bad, error, message in [
        (np.ones(10), ValueError, r"the observation has shape \(10,\), but must have \(11,\)"),
        (np.ones((1, 11)), ValueError, r"has shape \(1, 11\), but must have \(11,\)"),
        (np.float32(1), ValueError, r"but must have \(11,\)"),
        (np.ones(11, complex), TypeError, "must be an array of real numbers, such as float32, not of complex128"),
        (["a"] * 11, TypeError, "real numbers"),
        (None, TypeError, "real numbers"),
    ]:
        with pytest.raises(error, match=message):
            policy.act(bad)
    # What was refused changed nothing.
    assert same_bits(policy.act(good), before)


def test_a_batch_needs_an_agent_for_each_row():
    policy = champion_of("hopper-b23")
    with pytest.raises(ValueError, match="2 rows of observations, but 0 agents: call reset_batch"):
        policy.act_batch(np.ones((2, 11)))
    policy.reset_batch([1, 2])
    with pytest.raises(ValueError, match=r"observations has shape \(2, 10\), but must have \(2, 11\)"):
        policy.act_batch(np.ones((2, 10)))
    with pytest.raises(ValueError, match="reset all of them first"):
        policy.reset_batch([1, 2, 3], mask=[True, False, False])
    with pytest.raises(ValueError, match="mask has shape"):
        policy.reset_batch([1, 2], mask=[True])
    with pytest.raises(OverflowError):
        policy.reset_batch([-1])


def test_numbers_that_are_not_finite_have_the_runtimes_meaning():
    policy = champion_of("pendulum")
    rows = observations(policy, 20)
    rows[::2, 1] = np.nan
    rows[1::2, 0] = np.inf
    expected = policy._replay(rows, 1)
    assert np.isfinite(expected).all()
    assert same_bits(act_all(policy, rows), expected)
    assert same_bits(act_all(policy, rows.astype(np.float64)), expected)
    # A float64 that float32 cannot hold is one of them.
    assert same_bits(act_all(policy, np.where(np.isinf(rows), 1e300, rows.astype(np.float64))), expected)


@pytest.mark.parametrize("name", ["standardised", "held", "believed", "believed-cubic"])
def test_missing_values_are_filled_in_as_the_runtime_does(name):
    policy = tpg.Policy(ROOT / "tests" / "golden" / "v3" / f"{name}.tpg")
    seen = observations(policy, 400)
    rows = seen.copy()
    missing = np.random.default_rng(1).random(rows.shape) < 0.3
    rows[missing] = np.nan
    rows[::7] = np.nan
    expected = policy._replay(rows, 1)
    assert np.isfinite(expected).all()
    assert same_bits(act_all(policy, rows), expected)
    assert same_bits(act_all(policy, rows.astype(np.float64)), expected)
    policy.reset_batch([1, 1])
    batched = np.array([policy.act_batch(np.stack([row, row])) for row in rows])
    assert same_bits(batched[:, 0], expected) and same_bits(batched[:, 1], expected)


def test_files_that_are_no_policies_are_refused(tmp_path):
    with pytest.raises(FileNotFoundError):
        tpg.Policy(tmp_path / "none.tpg")
    path = tmp_path / "bad.tpg"
    path.write_bytes(b"TPGB" + bytes(200))
    with pytest.raises(ValueError, match="bad.tpg"):
        tpg.Policy(path)
    blob = bytearray(champion_of("pendulum").to_bytes())
    blob[-10] ^= 1
    with pytest.raises(ValueError, match="cannot use these bytes"):
        tpg.Policy(bytes(blob))
    with pytest.raises(TypeError, match="a path or of the bytes"):
        tpg.Policy(3)
