# `make help` lists what can be done. Everything is installed into $(VENV), nothing outside it.
VENV ?= .venv
PYTHON ?= python3
PIP_ARGS ?=
DATA ?=

PY := $(VENV)/bin/python
KINTRACK := $(VENV)/bin/kintrack
PIP := $(PY) -m pip install --disable-pip-version-check $(PIP_ARGS) -c constraints.txt
NEEDS := pyproject.toml constraints.txt
RUN := $(VENV)/.kintrack-run
DEV := $(VENV)/.kintrack-dev
MODEL := $(VENV)/.kintrack-model

.DEFAULT_GOAL := help
.PHONY: help demo test lint model results clean distclean

help:  ## list the targets
	@awk -F ':.*## ' '/^[a-z]+:.*## / { printf "make %-10s %s\n", $$1, $$2 }' Makefile
	@echo "Variables: VENV (environment, $(VENV)), PYTHON (makes it, $(PYTHON)),"
	@echo "           PIP_ARGS (for pip install), DATA (folder of recordings for make results)"

demo: $(RUN)  ## fit the recording that ships; page, video and scores in kintrack-demo/
	@if [ -z "$${CI:-}" ] && { [ -n "$${DISPLAY:-}$${WAYLAND_DISPLAY:-}" ] || [ "$$(uname)" = Darwin ]; }; \
	then $(KINTRACK) demo; \
	else $(KINTRACK) demo --no-open && echo "no display: open kintrack-demo/track.html in a browser"; fi

test: lint  ## format, lint and type checks, then all tests
	$(PY) -m pytest

lint: $(DEV)  ## format, lint and type checks
	$(PY) -m ruff check src tests
	$(PY) -m ruff format --check src tests
	$(PY) -m mypy

model: $(MODEL)  ## rebuild model/ and its pictures in docs/
	$(KINTRACK) model build
	$(KINTRACK) model pictures

results: $(DEV)  ## measure accuracy and speed; writes docs/results.md
	$(PY) tests/benchmarks/real_recordings.py $(if $(DATA),--data "$(DATA)")
	$(PY) tests/benchmarks/speed.py $(if $(DATA),--data "$(DATA)")
	$(PY) tests/benchmarks/sensor_statistics.py $(if $(DATA),--data "$(DATA)")
	$(PY) tests/benchmarks/data_engine.py $(if $(DATA),--data "$(DATA)")
	$(PY) tests/benchmarks/accuracy.py $(if $(DATA),--data "$(DATA)")
	$(PY) tests/benchmarks/solvers.py $(if $(DATA),--data "$(DATA)")
	$(PY) tests/benchmarks/part_segmentation.py $(if $(DATA),--data "$(DATA)")
	$(PY) tests/benchmarks/from_recordings.py --write $(if $(DATA),--data "$(DATA)")

clean:  ## remove what the other targets wrote, but not the environment
	rm -rf kintrack-demo build dist out .pytest_cache .ruff_cache .mypy_cache
	find src tests -name __pycache__ -type d -prune -exec rm -rf {} +

distclean: clean  ## remove .venv too
	rm -rf .venv

$(PY):
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 10))' || \
	{ echo "$(PYTHON) is no Python 3.10 or later; choose one: make PYTHON=python3.11 ..." >&2; exit 1; }
	$(PYTHON) -m venv $(VENV)

$(RUN): $(NEEDS) | $(PY)
	$(PIP) -e .
	@touch $@

# torch first: it is by far the largest and the one whose version matters most
$(DEV): $(NEEDS) | $(PY)
	$(PIP) torch
	$(PIP) -e '.[dev]'
	@touch $@ $(RUN)

$(MODEL): $(NEEDS) | $(PY)
	$(PIP) torch
	$(PIP) -e '.[model]'
	@touch $@ $(RUN)
