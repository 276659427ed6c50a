"""The core's similarity against the plain reference in numpy."""

import inspect

import memo
import numpy as np
import pytest
import similarity_reference as reference


@pytest.mark.parametrize("seed", range(50))
def test_the_core_agrees_with_the_reference(seed):
    rng = np.random.default_rng(seed)
    lines = rng.uniform(0, 200, (12, 2, 2))
    near = lines[rng.integers(0, len(lines), 40)] + rng.normal(0, 6, (40, 2, 2))
    edges = np.concatenate([near, rng.uniform(0, 200, (20, 2, 2))])
    # Angles far beyond sigma are not compared by the core; this sigma keeps all of them in.
    parameters = reference.Parameters(c_l=0.8, c_d=0.6, c_r=0.3, sigma_phi_rad=0.6)
    expected = reference.similarity(lines, edges, parameters)
    value, matches = memo.similarity(lines, edges, c_l=0.8, c_d=0.6, c_r=0.3, sigma_phi_rad=0.6)
    assert value == pytest.approx(expected.total, abs=2e-5)
    scores = np.zeros(len(lines))
    scores[matches[:, 0].astype(int)] = matches[:, 5]
    assert scores == pytest.approx(expected.scores, abs=2e-3)


def test_shapes_are_named_when_wrong():
    with pytest.raises(TypeError, match=r"\(N, 2, 2\).*shape \[2, 2\]"):
        memo.similarity(np.zeros((2, 2)), np.zeros((1, 2, 2)))
    with pytest.raises(ValueError, match=r"shape \[3, 4, 2\]"):
        memo.similarity(np.zeros((1, 2, 2)), np.zeros((3, 4, 2)))


def test_the_signature_states_the_defaults_of_the_core():
    parameters = inspect.signature(memo.similarity).parameters
    usual = memo._memo.defaults("similarity")
    assert {name: parameters[name].default for name in usual} == pytest.approx(usual, rel=1e-7)
    lines = np.array([[[0.0, 0.0], [40.0, 0.0]]])
    edges = np.array([[[1.0, 1.0], [38.0, 3.0]]])
    assert memo.similarity(lines, edges)[0] == memo.similarity(lines, edges, **usual)[0] > 0
    assert "`sigma_phi_rad` is 12 degrees by default" in " ".join(memo.similarity.__doc__.split())
