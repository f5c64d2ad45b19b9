# Two commands do all the set-up: `make run` and `make test`.
PYTHON ?= python3
VENV ?= .venv
PY := $(VENV)/bin/python

.PHONY: run wheel test test-long test-all bench lint format docs venv lock clean help
.DEFAULT_GOAL := help

help:  ## this list
	@awk -F':.*## ' '/^[a-z-]+:.*## /{printf "  make %-10s %s\n", $$1, $$2}' Makefile

venv: $(VENV)/.ready  ## .venv with the pinned dependencies and the project

# The stamp is written last, so an interrupted install is begun again.
$(VENV)/.ready: requirements-dev.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(0 if (3, 11) <= sys.version_info[:2] < (3, 14) else "oio needs Python 3.11 to 3.13, this is %d.%d: make PYTHON=python3.11 run" % sys.version_info[:2])'
	$(PYTHON) -m venv $(VENV)
	$(PY) -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements-dev.lock
	$(PY) -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	$(PY) -c 'from oio.cli.first_compile import first_compile; first_compile()'
	@touch $@

run: venv  ## one whole calibration and search in simulation
	$(PY) -m oio.run sensor=ec dof=5

wheel: venv  ## a wheel in dist/ that brings its compiled code, for this Python and system
	rm -rf build/compiled
	$(PY) -m oio.cli.ship_compiled build/compiled
	OIO_COMPILED=build/compiled $(PY) -m hatchling build -t wheel -d dist

lint: venv  ## format, style, types, import contracts
	$(PY) -m ruff format --check .
	$(PY) -m ruff check .
	$(PY) -m mypy
	$(VENV)/bin/lint-imports

format: venv  ## format the code, mend what ruff can mend
	$(PY) -m ruff format .
	$(PY) -m ruff check --fix .

docs: venv  ## the site, in site/; a warning is an error
	$(PY) docs/architecture.py
	$(PY) docs/ranges.py
	$(PY) docs/commands.py
	NO_MKDOCS_2_WARNING=1 $(PY) -m mkdocs build --quiet --strict

test: lint  ## lint, types, contracts and the quick tests, about ten minutes on two cores
	$(PY) -m pytest -n 2 --dist worksteal

test-long: venv  ## whole runs, sweeps, emulated benches: twice as long; CI runs both
	$(PY) -m pytest -n 2 --dist worksteal -m 'long and not slow'

test-all: lint  ## the same with the slow tests, an hour or two
	$(PY) -m pytest -n 2 --dist worksteal -m 'not alone'
	$(PY) -m pytest -m alone

bench: venv  ## what a step costs beside the least that it could, a minute or two
	$(PY) tests/benchmarks docs/benchmarks.md

lock: venv  ## make both lock files anew from pyproject.toml
	$(PY) -m pip install --quiet uv
	$(PY) -m uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-emit-index-url --custom-compile-command "make lock" pyproject.toml -o requirements.lock
	$(PY) -m uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-emit-index-url --custom-compile-command "make lock" --extra dev pyproject.toml -o requirements-dev.lock

clean:  ## remove the venv and the caches, keep outputs/
	rm -rf $(VENV) .numba_cache .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache site
	find oio hardware pipelines tests -name __pycache__ -prune -exec rm -rf {} +
