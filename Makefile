# make run: the main job, results in out/.   make test: the whole suite.   Both make .venv first.
PYTHON ?= python3
BIN := .venv/bin
# one thread for linear algebra: the matrices are small, threads only get in each other's way
export OPENBLAS_NUM_THREADS := 1
export OMP_NUM_THREADS := 1

.PHONY: run test clean

run: .venv/installed
	$(BIN)/python -m compare --out out

test: .venv/installed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/pytest

.venv/installed: pyproject.toml
	$(PYTHON) -m venv .venv
	$(BIN)/pip install --quiet --disable-pip-version-check --editable ".[test]"
	touch .venv/installed

clean:
	rm -rf .venv out
