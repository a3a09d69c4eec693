# make run: the main job, results in out/.   make test: the whole suite.   Both make .venv first.
PYTHON ?= python3
BIN := .venv/bin
PIP := $(BIN)/pip install --quiet --disable-pip-version-check --editable
# one thread for linear algebra: the matrices are small, threads only get in each other's way
export OPENBLAS_NUM_THREADS := 1
export OMP_NUM_THREADS := 1
# no advertisement of another tool in the middle of `make docs`
export NO_MKDOCS_2_WARNING := 1
# what touches every dependency, in some minutes, most of them for compiling with the oldest numba
MINIMAL := $(addprefix tests/, $(addprefix discs/test_, system.py mechanics.py archive.py figures.py view.py contact.py) \
    $(addprefix continuum/test_, cells.py lattice.py lagrangian.py))

.PHONY: run test docs minimal coverage clean

run: .venv/run
	$(BIN)/python -m compare --out out

test: .venv/test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/python -m discs.kernels
	$(BIN)/python -m continuum.kernels
	$(BIN)/pytest

# the lessons with their pictures, and the site; open site/index.html
docs: .venv/docs
	$(BIN)/jupyter nbconvert --log-level WARN --execute --to notebook --output-dir out/notebooks notebooks/*.ipynb
	$(BIN)/mkdocs build --strict

# the oldest versions that pyproject.toml allows, in an environment of their own; they warn of newer ones they meet there
minimal: .venv/minimal
	.venv/oldest/bin/python -m pytest -W default $(MINIMAL)

# lines of the three packages that the suite reaches, command lines and workers included; those of kernels as plain Python
coverage: .venv/test
	$(BIN)/python -m discs.kernels
	$(BIN)/python -m continuum.kernels
	$(BIN)/pytest --cov --cov-report= --cov-fail-under=0
	NUMBA_DISABLE_JIT=1 $(BIN)/pytest --cov --cov-append --cov-report=term-missing -k "twins or elimination or reduced or collapse" \
	    tests/discs/test_kernels.py tests/discs/test_simulate.py tests/continuum/test_spectral.py

.venv/made:
	$(PYTHON) -m venv .venv
	touch $@

.venv/run: .venv/made pyproject.toml
	$(PIP) .
	touch $@

# where a peer has no wheel its tests are skipped, and say so
.venv/test: .venv/made pyproject.toml
	$(PIP) ".[test,peers]" || $(PIP) ".[test]"
	touch $@

.venv/minimal: .venv/made pyproject.toml
	$(BIN)/pip install --quiet --disable-pip-version-check uv
	$(BIN)/uv venv --quiet --clear --python 3.11 .venv/oldest
	VIRTUAL_ENV=.venv/oldest $(BIN)/uv pip install --quiet --resolution lowest-direct --editable ".[test]"
	touch $@

.venv/docs: .venv/made pyproject.toml
	$(PIP) ".[docs]"
	touch $@

clean:
	rm -rf .venv out site
