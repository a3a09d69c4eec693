"""The finite differences: transposes, exactness on polynomials, shares that sum to the length."""

import numpy as np
import pytest

from discs import stencils

N, LENGTH = 9, 2.6


def spaced(n, ends):
    k = stencils.spacing(n, LENGTH, ends)
    return k, k * np.arange(n)


def test_pull_is_the_transpose_of_links(ends):
    rng = np.random.default_rng(0)
    values = rng.standard_normal((3, N))
    d = stencils.links(values, ends)
    tension = rng.standard_normal(d.shape)
    # a dozen products of order 1
    assert np.vdot(tension, d) == pytest.approx(np.vdot(stencils.pull(tension, ends), values), abs=1e-13)
    np.testing.assert_allclose(values @ stencils.link_matrix(N, ends).T.toarray(), d, atol=1e-15)


@pytest.mark.parametrize("ends", ["springs", "paper", "consistent"])
def test_slopes_and_bends_are_exact_where_they_should_be(ends):
    k, s = spaced(N, ends)
    quadratic = stencils.links(1.2 + 0.7 * s - 0.4 * s**2, ends)
    np.testing.assert_allclose(stencils.slope_matrix(N, k, ends) @ quadratic, 0.7 - 0.8 * s, atol=1e-13)
    # second differences, the one-sided (2, -5, 4, -1) too, are exact on cubics
    cubic = stencils.links(0.3 * s**3 - s**2, ends)
    places = s if ends == "consistent" else s[1:-1]
    np.testing.assert_allclose(stencils.bend_matrix(N, k, ends) @ cubic, 1.8 * places - 2, atol=1e-11)


def test_consistent_end_headings_err_as_the_inner_ones_do():
    k, s = spaced(N, "consistent")
    error = stencils.slope_matrix(N, k, "consistent") @ stencils.links(s**3, "consistent") - 3 * s**2
    # k^2/6 times the third derivative, at every disc
    np.testing.assert_allclose(error, k**2, rtol=1e-9)


def test_ring_is_exact_on_waves_up_to_the_symbols():
    k, s = spaced(N, "ring")
    q = 2 * np.pi * 2 / LENGTH
    d = stencils.links(np.cos(q * s), "ring")
    np.testing.assert_allclose(stencils.slope_matrix(N, k, "ring") @ d, -np.sin(q * k) / k * np.sin(q * s), atol=1e-12)
    second = -((2 / k * np.sin(q * k / 2)) ** 2) * np.cos(q * s)
    np.testing.assert_allclose(stencils.bend_matrix(N, k, "ring") @ d, second, atol=1e-12)


def test_shares_sum_to_the_length(ends):
    k, _ = spaced(N, ends)
    extra = k if ends == "paper" else 0.0  # the paper's end discs weigh a whole share
    assert stencils.shares(N, k, ends).sum() == pytest.approx(LENGTH + extra, rel=1e-14)
    bends = {"springs": LENGTH - k, "paper": LENGTH - k}.get(ends, LENGTH)
    assert stencils.bend_shares(N, k, ends).sum() == pytest.approx(bends, rel=1e-14)
