"""Processor times of the cases, by pytest-benchmark: `make bench`."""

import time

import pytest

from tests.benchmarks.cases import CASES


@pytest.mark.benchmark(timer=time.process_time, max_time=2.0, min_rounds=5, warmup=True, warmup_iterations=1)
@pytest.mark.parametrize("name", CASES)
def test_speed(name, benchmark):
    benchmark(CASES[name]())
