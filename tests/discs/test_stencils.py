"""The finite differences: transposes, exactness on polynomials, shares that sum to the length."""

import numpy as np
import pytest

from discs.chains import stencils

N, LENGTH = 9, 2.6
FEWEST = {"springs": 3, "paper": 3, "consistent": 4, "ring": 5}


def spaced(n, ends):
    k = stencils.spacing(n, LENGTH, ends)
    return k, k * np.arange(n)


@pytest.mark.parametrize("more", range(7))
def test_transposes(ends, more):
    rng, n = np.random.default_rng(0), FEWEST[ends] + more
    values = rng.standard_normal((3, n))
    d = stencils.links(values, ends)
    tension = rng.standard_normal(d.shape)
    # a dozen products of order 1
    assert np.vdot(tension, d) == pytest.approx(np.vdot(stencils.pull(tension, ends), values), abs=1e-13)
    longer = stencils.extended(d, ends)
    tension = rng.standard_normal(longer.shape)
    assert np.vdot(tension, longer) == pytest.approx(np.vdot(stencils.gathered(tension, ends), d), abs=1e-13)


@pytest.mark.parametrize("more", range(7))
def test_bands_are_the_square_of_bends(ends, more):
    n = FEWEST[ends] + more
    stiffness = np.random.default_rng(1).uniform(0.5, 2.0, n)
    if ends in ("springs", "paper"):
        stiffness[[0, -1]] = 0
    bends = stencils.bends(stencils.links(np.eye(n), ends), ends).T
    full, bands = bends.T @ (stiffness[:, None] * bends), stencils.bend_bands(stiffness, ends)
    found, i = np.diag(bands[0]), np.arange(n)
    for j in range(1, 4):
        first = i[bands[j] != 0]
        found[first, (first + j) % n] = found[(first + j) % n, first] = bands[j, first]
    np.testing.assert_allclose(found, full, atol=1e-12)


@pytest.mark.parametrize("ends", ["springs", "paper", "consistent"])
def test_slopes_and_bends_are_exact_where_they_should_be(ends):
    k, s = spaced(N, ends)
    quadratic = stencils.links(1.2 + 0.7 * s - 0.4 * s**2, ends)
    np.testing.assert_allclose(stencils.slopes(quadratic, k, ends), 0.7 - 0.8 * s, atol=1e-13)
    # second differences, the one-sided (2, -5, 4, -1) too, are exact on cubics
    cubic = stencils.links(0.3 * s**3 - s**2, ends)
    inner = slice(None) if ends == "consistent" else slice(1, -1)
    np.testing.assert_allclose(stencils.bends(cubic, ends)[inner] / k**2, (1.8 * s - 2)[inner], atol=1e-11)


def test_consistent_end_headings_err_as_the_inner_ones_do():
    k, s = spaced(N, "consistent")
    error = stencils.slopes(stencils.links(s**3, "consistent"), k, "consistent") - 3 * s**2
    # k^2/6 times the third derivative, at every disc
    np.testing.assert_allclose(error, k**2, rtol=1e-9)


def test_ring_is_exact_on_waves_up_to_the_symbols():
    k, s = spaced(N, "ring")
    q = 2 * np.pi * 2 / LENGTH
    d = stencils.links(np.cos(q * s), "ring")
    np.testing.assert_allclose(stencils.slopes(d, k, "ring"), -np.sin(q * k) / k * np.sin(q * s), atol=1e-12)
    second = -((2 / k * np.sin(q * k / 2)) ** 2) * np.cos(q * s)
    np.testing.assert_allclose(stencils.bends(d, "ring") / k**2, second, atol=1e-12)


def test_shares_sum_to_the_length(ends):
    k, _ = spaced(N, ends)
    extra = k if ends == "paper" else 0.0  # the paper's end discs weigh a whole share
    assert stencils.shares(N, k, ends).sum() == pytest.approx(LENGTH + extra, rel=1e-14)
    bends = {"springs": LENGTH - k, "paper": LENGTH - k}.get(ends, LENGTH)
    assert stencils.bend_shares(N, k, ends).sum() == pytest.approx(bends, rel=1e-14)
