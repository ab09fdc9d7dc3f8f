# Everything a newcomer needs: `make demo`, `make test`. A virtual environment is made once and remade when pyproject.toml changes.
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin

.PHONY: demo test lint types check-all generate audit benchmarks clean
.DEFAULT_GOAL := test

$(VENV)/run.stamp: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e .
	@touch $@

$(VENV)/test.stamp: $(VENV)/run.stamp
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[test]'
	@touch $@

demo: $(VENV)/run.stamp
	$(BIN)/stiction demo

lint: $(VENV)/test.stamp
	$(BIN)/ruff check codegen tests benchmarks
	$(BIN)/ruff format --check codegen tests benchmarks

types: $(VENV)/test.stamp
	$(BIN)/mypy

test: lint types
	$(BIN)/python -m pytest -n 2

check-all: test
	$(BIN)/python -m pytest -n 2 -m slow
	$(BIN)/stiction generate specs/*.yaml specs/thesis/*.yaml --uncertified --check

# Write generated/ anew from the shipped specs.
generate: $(VENV)/run.stamp
	$(BIN)/stiction generate specs/*.yaml specs/thesis/*.yaml --uncertified

# Write docs/audit.md anew: the printed formulas of the thesis against the derivation.
audit: $(VENV)/run.stamp
	$(BIN)/stiction audit -o docs/audit.md

benchmarks: $(VENV)/test.stamp
	$(BIN)/python -m benchmarks.step

clean:
	rm -rf $(VENV) .pytest_cache .mypy_cache .ruff_cache
