# Everything a newcomer needs: `make demo`, `make test`. A virtual environment is made once and remade when pyproject.toml changes.
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin

# Other compilers, checkers and an emulator for the tests of the generated C; where one is absent, its tests skip and say so.
TOOLCHAINS := clang clang-tidy cmake cppcheck frama-c-base g++ gappa gcc-arm-none-eabi libnewlib-arm-none-eabi qemu-system-arm valgrind

.PHONY: demo test test-tools lint types toolchains goldens check-all fuzz generate certificates modules reference audit gallery benchmarks practice real clean
.DEFAULT_GOAL := test

$(VENV)/run.stamp: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e .
	@touch $@

# With the tool: in a new environment one installation is enough.
$(VENV)/test.stamp: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[test]'
	@touch $(VENV)/run.stamp $@

demo: $(VENV)/run.stamp
	$(BIN)/stiction demo

# The virtual environment with pytest, ruff and mypy; runs nothing.
test-tools: $(VENV)/test.stamp

lint: $(VENV)/test.stamp
	$(BIN)/ruff check codegen tests benchmarks
	$(BIN)/ruff format --check codegen tests benchmarks

types: $(VENV)/test.stamp
	$(BIN)/mypy

# The type checker runs beside the tests. Compiled modules are kept, whatever the environment says: the tests start the command many times.
test: lint
	@$(BIN)/mypy & types=$$!; PYTHONDONTWRITEBYTECODE= $(BIN)/python -m pytest -n 2 --dist worksteal; tests=$$?; wait $$types && exit $$tests

# Debian or Ubuntu; as root, or by sudo. Does nothing where all are there.
toolchains:
	@dpkg -s $(TOOLCHAINS) >/dev/null 2>&1 || { \
	  command -v apt-get >/dev/null || { echo "toolchains: no apt-get here; wanted: $(TOOLCHAINS)" >&2; exit 1; }; \
	  sudo=$$([ "$$(id -u)" = 0 ] || echo sudo); \
	  $$sudo apt-get update -qq && \
	  $$sudo env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $(TOOLCHAINS) >/dev/null; }

# Everything in generated/ is what the tool writes now. The specs of the figures, specs/gallery/, and of measured logs, specs/data/, are run and not generated.
goldens: $(VENV)/run.stamp
	$(BIN)/stiction generate specs/*.yaml specs/thesis/*.yaml --uncertified --check

# Every test, the slow ones too, with the peers and solvers whose tests skip in `make test`.
check-all: toolchains lint types goldens $(VENV)/benchmark.stamp
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[newton,robots,smt]'
	HYPOTHESIS_PROFILE=random $(BIN)/python -m pytest -n 2 -m ""

# An hour of damaged specs, logs, robot files and proofs (SECURITY.md); `make fuzz SECONDS=600 SEED=1000000` as long and from where you say.
SECONDS ?= 3600
fuzz: SEED ?= 1000000
fuzz: $(VENV)/test.stamp
	$(BIN)/python -m tests.fuzz.campaign --seconds $(SECONDS) --seed $(SEED)

# Write generated/ anew from the shipped specs.
generate: $(VENV)/run.stamp
	$(BIN)/stiction generate specs/*.yaml specs/thesis/*.yaml --uncertified --force

# Write docs/certificates.md anew: what is certified, refuted and bounded for each shipped spec.
certificates: $(VENV)/run.stamp
	$(BIN)/python -m benchmarks.certificate_table specs/*.yaml specs/thesis/*.yaml

# Write docs/modules.md anew: each module of codegen/ with the first sentence of its docstring.
modules: $(VENV)/test.stamp
	$(BIN)/python -m benchmarks.module_map

# Write docs/laws.md, docs/effects.md and their pictures, and docs/errors.md anew.
reference: $(VENV)/test.stamp
	$(BIN)/python -m benchmarks.reference

# Write docs/audit.md anew: the printed formulas of the thesis against the derivation.
audit: $(VENV)/run.stamp
	$(BIN)/stiction audit -o docs/audit.md

# Write docs/gallery/ anew: the figures of the thesis, and what its text says of them.
gallery: $(VENV)/run.stamp
	$(BIN)/stiction gallery

# The peers that PyPI has; one that cannot be installed here is reported as absent.
$(VENV)/benchmark.stamp: $(VENV)/test.stamp
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[benchmark]' \
	  || echo "benchmarks: not every peer can be installed here" >&2
	@touch $@

# Write docs/performance.md anew; `make benchmarks ROW=two_mass` measures that row alone and keeps the others.
# Its last part, the time of diagnoses: `python -m benchmarks.diagnosis_time --seed S`.
benchmarks: $(VENV)/benchmark.stamp
	$(BIN)/python -m benchmarks $(ROW)

# Write docs/practice.md anew: the diagnosis on ../shared/practice, its time and score, its false alarms where nothing is missing, and PySINDy
# beside it; says so where that is not here. One to two hours of two cores; kept results are not made again. A few cases: `python -m benchmarks.practice --only CASE`.
# Known effects in real logs: `python -m benchmarks.spikes`, docs/spikes.md. Machines of another simulator: `python -m benchmarks.machines --seed S`, docs/other_machines.md. False alarms on surrogates: `python -m benchmarks.surrogates`, docs/calibration.md. The probability beside a verdict: `python -m benchmarks.reliability`, docs/reliability.md.
# Beside fits of parameters alone (mujoco.sysid) and PySINDy: `python -m benchmarks.rivals`, docs/peers.md. Robot arms: `python -m benchmarks.arms`, docs/arms.md. EMPS by its benchmark's protocol: `python -m benchmarks.emps`.
# `make practice SEED=11 COUNT=60 TIER=both` instead makes a fresh set with the shared generator (10 to 60 s of CPU a case, another 15 to 40 to diagnose it; the generator's
# virtual environment is made below practice_results/), and writes the row of that seed among the others. COUNT is 60 and TIER standard by default.
COUNT ?= 60
TIER ?= standard
practice: $(VENV)/test.stamp
	$(BIN)/python -m benchmarks.practice$(if $(SEED),.seeds --seed $(SEED) --count $(COUNT) --tier $(TIER))

# Write the tables of docs/data_*.md anew, of the measured logs in ../shared/data; `make real SET=laas_cogging` those of one set.
real: $(VENV)/test.stamp
	$(BIN)/python -m benchmarks.real $(SET)

clean:
	rm -rf $(VENV) .pytest_cache .mypy_cache .ruff_cache
