"""Statistics, and whether the stubs say what there is."""

import ast

import numpy as np
import pytest
from conftest import ROOT

import tpg
from tpg import _tpg


def test_the_interquartile_mean_leaves_out_the_outer_quarters():
    assert tpg.iqm([8, 1, 100, 4, -50, 3, 6, 5]) == np.mean([3, 4, 5, 6])
    rng = np.random.default_rng(0)
    runs = rng.normal(10, 1, size=(40, 3))
    mean, low, high = tpg.iqm(runs, confidence=0.95)
    assert mean == tpg.iqm(runs) and low < mean < high and high - low < 1
    assert tpg.iqm(runs, confidence=0.95) == (mean, low, high)
    narrow = tpg.iqm(runs, confidence=0.5)
    assert low < narrow[1] < narrow[2] < high


@pytest.mark.parametrize(
    ("scores", "how", "message"),
    [
        ([], {}, "must have shape"),
        (np.ones((2, 2, 2)), {}, "must have shape"),
        ([1, np.nan], {}, "must be finite"),
        ([1, 2], {"confidence": 1.0}, "between 0 and 1"),
    ],
)
def test_scores_that_have_no_mean(scores, how, message):
    with pytest.raises(ValueError, match=message):
        tpg.iqm(scores, **how)


def test_the_stubs_name_what_there_is():
    stubs = ast.parse((ROOT / "trainer" / "python" / "tpg" / "_tpg.pyi").read_text())
    functions, classes = set(), {}
    for node in stubs.body:
        if isinstance(node, ast.FunctionDef):
            functions.add(node.name)
        if isinstance(node, ast.ClassDef):
            names = [item.target.id if isinstance(item, ast.AnnAssign) else getattr(item, "name", None) for item in node.body]
            classes[node.name] = {name for name in names if name} - {"__new__"}
    public = {name for name, value in vars(_tpg).items() if not name.startswith("__")}
    assert public == functions | set(classes)
    for name, stubbed in classes.items():
        own = {k for k in vars(getattr(_tpg, name)) if not k.startswith("__") or k == "__len__"}
        # `_replay` is for tests alone.
        assert own - {"_replay"} == stubbed, name


def test_everything_public_has_a_docstring():
    for name in set(tpg.__all__) - {"__version__"}:
        assert getattr(tpg, name).__doc__, name
