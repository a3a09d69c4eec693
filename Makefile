# make run: the main job, results in out/.   make test: the suite, as in CI.   make long: every test.   All make .venv first.
PYTHON ?= python3
BIN := .venv/bin
INSTALL := $(BIN)/uv pip install --quiet --compile-bytecode --python $(BIN)/python
# one thread for linear algebra: the matrices are small, threads only get in each other's way
export OPENBLAS_NUM_THREADS := 1
export OMP_NUM_THREADS := 1
# modules are kept compiled: otherwise each process compiles a thousand of them, which takes longer than many runs
unexport PYTHONDONTWRITEBYTECODE
# no advertisement of another tool in the middle of `make docs`
export NO_MKDOCS_2_WARNING := 1
# what touches every dependency, in some minutes, most of them for compiling with the oldest numba
MINIMAL := $(addprefix tests/, $(addprefix discs/test_, system.py mechanics.py archive.py figures.py view.py contact.py) \
    $(addprefix continuum/test_, cells.py lattice.py lagrangian.py))

.PHONY: run test bench long quick lint types kernels tested field docs paper minimal coverage clean

run: .venv/run
	$(BIN)/python -m compare --out out

# side by side, as two cores are what every machine has
test: .venv/dev
	$(MAKE) --no-print-directory --jobs 4 lint types tested field
	$(BIN)/pytest -m "not long"

# before a release: all lessons and the site too, every peer on every chain, and every kernel
long: .venv/dev kernels field
	$(BIN)/pytest

# a contributor's loop: no lessons, sites, browsers or methods that take long to compile
quick: .venv/dev
	$(MAKE) --no-print-directory --jobs 2 lint types
	$(BIN)/pytest -m "not slow and not long"

# processor times of kernels, calls, "auto" and the field; `make bench AGAINST=v0.1.0`, or a wheel: ratios to it, in turns
bench: .venv/dev kernels field
ifdef AGAINST
	$(BIN)/python -m tests.benchmarks.against $(AGAINST)
else
	$(BIN)/pytest -p no:xdist -o addopts= tests/benchmarks/bench_speed.py
endif

lint: .venv/dev
	$(BIN)/ruff check --quiet .
	$(BIN)/ruff format --check --quiet .
	$(BIN)/typos

types: .venv/dev
	$(BIN)/mypy

# compiled ahead, once on a machine: of discs, a process for each kind of chain, and of the field
kernels: .venv/dev
	$(BIN)/python -m discs.kernels

# those that the short suite runs
tested: .venv/dev
	$(BIN)/python -m discs.kernels --tested

field: .venv/dev
	$(BIN)/python -m continuum.kernels

# the lessons and the gallery with their pictures, and the site; open site/index.html
docs: .venv/docs
	$(BIN)/jupyter nbconvert --log-level WARN --execute --to notebook --output-dir out/notebooks notebooks/*.ipynb
	mkdir -p out/gallery
	cd out/gallery && for script in ../../docs/gallery/*.py; do ../../$(BIN)/python $$script || exit 1; done
	$(BIN)/mkdocs build --strict

# the paper in out/paper, as a PDF and as pictures
paper: .venv/paper
	$(BIN)/python paper/build.py out/paper

# the oldest versions that pyproject.toml allows, in an environment of their own; they warn of newer ones they meet there
minimal: .venv/minimal
	.venv/oldest/bin/python -m pytest -W default $(MINIMAL)

# lines of the three packages that the suite reaches, command lines and workers included; those of kernels as plain Python
coverage: .venv/dev kernels field
	$(BIN)/pytest --cov --cov-report= --cov-fail-under=0
	NUMBA_DISABLE_JIT=1 $(BIN)/pytest --cov --cov-append --cov-report=term-missing -k "twins or elimination or reduced or collapse" \
	    tests/discs/test_kernels.py tests/discs/test_simulate.py tests/continuum/test_spectral.py

.venv/made:
	$(PYTHON) -m venv .venv
	$(BIN)/pip install --quiet --disable-pip-version-check uv # installs in seconds what takes pip over a minute
	touch $@

.venv/run: .venv/made pyproject.toml
	$(INSTALL) --editable .
	touch $@

# where a peer has no wheel its tests are skipped, and say so
.venv/dev: .venv/made pyproject.toml
	$(INSTALL) --group dev --editable ".[cluster,contact,peers]" || $(INSTALL) --group dev --editable ".[cluster,contact]"
	touch $@

.venv/minimal: .venv/made pyproject.toml
	$(BIN)/uv venv --quiet --clear --python 3.11 .venv/oldest
	$(BIN)/uv pip install --quiet --python .venv/oldest --resolution lowest-direct --group test --editable ".[cluster,contact]"
	touch $@

.venv/docs: .venv/made pyproject.toml
	$(INSTALL) --group docs --editable ".[contact]"
	touch $@

.venv/paper: .venv/made pyproject.toml
	$(INSTALL) --group paper
	touch $@

clean:
	rm -rf .venv out site
