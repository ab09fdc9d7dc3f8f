"""FMUs of shipped observers under FMPy: valid, and the bits of the C and of the Python twin."""

from __future__ import annotations

import io
import zipfile
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import fmpy
import numpy as np
import pytest
from fmpy import validation

from codegen.base.compiler import compile_shared
from codegen.emit.fmu import VERSIONS, Fmu, emit_fmu
from codegen.emit.package import emit_sources, make_header
from codegen.observers import observer_of
from codegen.program import Program, build_program
from codegen.replay.engine import Engine
from codegen.spec import read_spec
from codegen.spec.schema import CodeChoice
from fmu import unit as driven
from tests.app.command import SPECS, is_one_message, stiction
from tests.expected_errors import refused
from tests.slow_cases import slow_except
from tests.twin import fill, inputs_of, load_twin, values_of

ROWS = 400


@dataclass(frozen=True)
class Made:
    """An observer's FMU, unpacked, and what it is held against."""

    program: Program
    files: dict[str, str]
    fmu: Fmu
    folder: Path

    @property
    def inputs(self) -> list[str]:
        return [f.name for f in self.program.inputs]

    @property
    def outputs(self) -> list[str]:
        return [name for name, _, _ in self.program.outputs]

    @property
    def period(self) -> float:
        return next(float(p.value or 0) for p in self.program.parameters if p.name == "sample_time")

    @property
    def twin(self) -> ModuleType:
        return load_twin(self.files["__init__.py"], f"{self.program.name}_twin")

    def unit(self, instance: str = "one") -> object:
        return driven.Unit(self.folder, instance)

    def rows(self, seed: int = 1) -> np.ndarray:
        """Random walks: (ROWS, inputs)."""
        steps = np.random.default_rng(seed).normal(size=(ROWS, len(self.inputs)))
        sizes = [1e-3 if f.meaning == "measured position" else 1.0 for f in self.program.inputs]
        return np.cumsum(steps, axis=0) * sizes

    def by_twin(self, rows: np.ndarray, **parameters: float) -> np.ndarray:
        twin = self.twin
        constants = twin.Parameters()
        fill(constants, self.program, parameters)
        if hasattr(twin, "prepare"):
            twin.prepare(constants)
        state = twin.init(constants, inputs_of(twin, self.program, rows[0].tolist()))
        result = np.empty((len(rows), len(self.outputs)))
        for k, row in enumerate(rows.tolist()):
            made = twin.step(state, constants, inputs_of(twin, self.program, row))
            result[k] = values_of(made, self.program, self.outputs)
        return result


CASES = [
    *((name, version, "double") for name in ("two_mass", "two_link_arm") for version in VERSIONS),
    ("two_mass", "3.0", "single"),
    ("chain", "3.0", "double"),
]


QUICK = [*CASES[:2], CASES[3], CASES[4]]
"""Each version, precision and an arm; a chain costs most and has no more than that."""


@pytest.fixture(scope="module", params=slow_except(CASES, QUICK), ids="-".join)
def made(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Made:
    name, version, precision = request.param
    spec = read_spec(SPECS / f"{name}.yaml")
    program = build_program(observer_of(spec), CodeChoice(precision=precision, fault="hold"))
    files = {**emit_sources(program, make_header(spec.path.name, spec.sha256, spec.source)), "README.md": "# it\n"}
    fmu = emit_fmu(program, files, version)
    folder = tmp_path_factory.mktemp("fmu")
    with zipfile.ZipFile(io.BytesIO(fmu.data)) as archive:
        archive.extractall(folder)
    (folder / fmu.name).write_bytes(fmu.data)
    return Made(program, files, fmu, folder)


def test_it_is_valid_and_holds_the_c_unchanged(made: Made) -> None:
    assert validation.validate_fmu(str(made.folder / made.fmu.name)) == []
    name = made.program.name
    assert made.fmu.members[f"sources/{name}.c"].decode() == made.files[f"{name}.c"]
    assert made.fmu.members[f"sources/{name}.h"].decode() == made.files[f"{name}.h"]


def test_its_variables_are_the_programs_with_units_and_values(made: Made) -> None:
    found = {v.name: v for v in fmpy.read_model_description(str(made.folder)).modelVariables}
    for p in made.program.parameters:
        assert float(found[p.name].start) == p.value
        assert found[p.name].unit == (None if p.unit == "1" else p.unit)
        assert found[p.name].causality == ("local" if p.name == "sample_time" else "parameter")
    assert [n for n, v in found.items() if v.causality == "input"] == made.inputs
    assert [n for n, v in found.items() if v.causality == "output" and n != "fault"] == made.outputs


def test_the_same_bytes_twice(made: Made, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("codegen.emit.fmu.cached_library", compile_shared)
    version = fmpy.read_model_description(str(made.folder)).fmiVersion
    assert emit_fmu(made.program, made.files, version).data == made.fmu.data


def test_it_gives_the_bits_of_the_c_and_of_the_twin(made: Made) -> None:
    rows = made.rows()
    unit = made.unit()
    unit.begin(dict(zip(made.inputs, rows[0].tolist(), strict=True)))
    estimates = unit.run(rows, made.inputs, made.outputs, made.period)
    unit.end()
    engine = Engine(made.program, made.files)
    engine.start(rows[0])
    assert estimates.tobytes() == engine.run(rows)[0].tobytes()
    assert estimates.tobytes() == made.by_twin(rows).tobytes()
    assert np.ptp(estimates, axis=0).min() > 0


def test_the_wrapper_compiles_without_a_warning(made: Made) -> None:
    warnings = ("-pedantic", "-Wall", "-Wextra", "-Werror", "-Wconversion", "-Wshadow")
    sources = {p.removeprefix("sources/"): c.decode() for p, c in made.fmu.members.items() if p.startswith("sources/")}
    assert compile_shared(sources, [name for name in sources if "_fmi" in name], warnings)


def test_fmpy_simulates_it(made: Made) -> None:
    rows, h = made.rows(), made.period
    signals = np.empty(len(rows), dtype=[("time", "f8"), *((n, "f8") for n in made.inputs)])
    signals["time"] = np.arange(len(rows)) * h
    for k, name in enumerate(made.inputs):
        signals[name] = rows[:, k]
    result = fmpy.simulate_fmu(
        str(made.folder / made.fmu.name), stop_time=(ROWS - 1) * h, output_interval=h, input=signals
    )
    assert len(result) == ROWS
    expected = made.by_twin(rows)[: ROWS - 1]
    found = np.column_stack([result[name][1:] for name in made.outputs])
    assert np.abs(found - expected).max() <= 1e-9 * np.abs(expected).max()


def test_rows_of_an_input_are_no_events_for_fmpy(made: Made) -> None:
    """FMPy goes through all events of the inputs at every step: 30 000 rows of discrete ones took it three minutes."""
    rows = made.rows()
    signals = np.empty(len(rows), dtype=[("time", "f8"), *((n, "f8") for n in made.inputs)])
    signals["time"] = np.arange(len(rows)) * made.period
    for k, name in enumerate(made.inputs):
        signals[name] = rows[:, k]
    description = fmpy.read_model_description(str(made.folder / made.fmu.name))
    assert fmpy.simulation.Input.findEvents(signals, description).tolist() == [float("inf")]


def test_a_parameter_that_is_set_counts(made: Made) -> None:
    """Also where the C holds constants that are derived from it: NAME_prepare is called."""
    rows = made.rows(2)
    first = dict(zip(made.inputs, rows[0].tolist(), strict=True))
    changed = {p.name: 1.3 * float(p.value or 0) for p in made.program.parameters if p.name != "sample_time"}
    unit = made.unit()
    unit.begin(first, changed)
    estimates = unit.run(rows, made.inputs, made.outputs, made.period)
    with pytest.raises(driven.FMICallException):
        unit.set(next(iter(changed)), 1.0)
    assert "parameters are fixed after initialization" in unit.said[-1]
    unit.end()
    assert estimates.tobytes() == made.by_twin(rows, **changed).tobytes()
    assert estimates.tobytes() != made.by_twin(rows).tobytes()


def test_two_instances_do_not_know_each_other(made: Made) -> None:
    one, two = made.rows(3), made.rows(4)
    units = [made.unit("a"), made.unit("b")]
    for unit, rows in zip(units, (one, two), strict=True):
        unit.begin(dict(zip(made.inputs, rows[0].tolist(), strict=True)))
    found = [np.empty((ROWS, len(made.outputs))) for _ in units]
    for k in range(ROWS):
        for unit, rows, estimates in zip(units, (one, two), found, strict=True):
            for name, value in zip(made.inputs, rows[k].tolist(), strict=True):
                unit.set(name, value)
            unit.step(k * made.period, made.period)
            estimates[k] = unit.get(made.outputs)
    for rows, estimates in zip((one, two), found, strict=True):
        assert estimates.tobytes() == made.by_twin(rows).tobytes()


@pytest.mark.parametrize("factor", [2.0, 0.5, 1.001, 0.0, -1.0])
def test_another_step_is_refused_in_words(made: Made, factor: float) -> None:
    unit = made.unit()
    unit.begin(dict.fromkeys(made.inputs, 0.0))
    before = unit.get(made.outputs)
    with pytest.raises(driven.FMICallException):
        unit.step(0.0, factor * made.period)
    assert f"this observer takes steps of {made.period:.9g} s, its sample time, and no others" in unit.said[-1]
    assert unit.get(made.outputs) == before
    unit.step(0.0, made.period * (1 + 1e-9))
    unit.end()


def test_a_state_that_was_kept_goes_on_with_the_same_bits(made: Made) -> None:
    rows = made.rows(5)
    unit = made.unit()
    unit.begin(dict(zip(made.inputs, rows[0].tolist(), strict=True)))
    unit.run(rows[:100], made.inputs, made.outputs, made.period)
    get, put = ("getFMUstate", "setFMUstate") if unit.two else ("getFMUState", "setFMUState")
    kept = getattr(unit.unit, get)()
    first = unit.run(rows[100:], made.inputs, made.outputs, made.period)
    getattr(unit.unit, put)(kept)
    again = unit.run(rows[100:], made.inputs, made.outputs, made.period)
    unit.end()
    assert first.tobytes() == again.tobytes()


def test_a_sample_that_is_not_finite_raises_the_flag(made: Made) -> None:
    rows = made.rows(6)
    rows[7, 0] = np.nan
    unit = made.unit()
    unit.begin(dict(zip(made.inputs, rows[0].tolist(), strict=True)))
    before = unit.run(rows[:7], made.inputs, made.outputs, made.period)[-1]
    assert unit.get_integer("fault") == 0
    held = unit.run(rows[7:8], made.inputs, made.outputs, made.period)[0]
    assert unit.get_integer("fault") == 1
    assert held.tobytes() == before.tobytes()
    unit.end()


def test_a_bad_first_sample_leaves_the_start_to_the_first_good_one(made: Made) -> None:
    rows = made.rows(8)
    rows[:2, 0] = np.nan
    unit = made.unit()
    unit.begin(dict(zip(made.inputs, rows[0].tolist(), strict=True)))
    found = unit.run(rows, made.inputs, made.outputs, made.period)
    unit.end()
    assert not found[:3].any() and found[3:].any(axis=1).all()
    assert found.tobytes() == made.by_twin(rows).tobytes()


def test_the_command_writes_it(tmp_path: Path) -> None:
    done = stiction("generate", SPECS / "one_mass.yaml", "--target", "fmu", "-o", tmp_path, "--fmi", "2.0")
    assert done.code == 0, done.err
    assert [p.name for p in tmp_path.iterdir()] == ["one_mass.fmu"]
    assert validation.validate_fmu(str(tmp_path / "one_mass.fmu")) == []
    again = stiction("generate", SPECS / "one_mass.yaml", "--target", "fmu", "-o", tmp_path, "--fmi", "2.0", "--check")
    assert (again.code, again.out.split(":")[0]) == (0, "current")


@pytest.mark.parametrize("wrong", [("--target", "simulink"), ("--target", "fmu", "--fmi", "1.0")])
def test_what_there_is_no_target_for_is_one_message(tmp_path: Path, wrong: tuple[str, ...]) -> None:
    assert is_one_message(stiction("generate", SPECS / "one_mass.yaml", *wrong, "-o", tmp_path))
    assert not list(tmp_path.iterdir())


def test_without_a_compiler_it_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path / "none"))
    done = stiction("generate", SPECS / "one_mass.yaml", "--target", "fmu", "-o", tmp_path)
    assert is_one_message(done) and "compiler" in done.err
    assert not list(tmp_path.iterdir())


def test_a_quantity_called_time_is_refused() -> None:
    program = build_program(observer_of(read_spec(SPECS / "one_mass.yaml")))
    clash = type(program.parameters[0])("time", "s", "model parameter", 1.0)
    files = emit_sources(program, make_header("one_mass.yaml", "0" * 64, ""))
    changed = Program(**{**vars(program), "parameters": (clash, *program.parameters)})
    with refused("SPEC009 `time`"):
        emit_fmu(changed, files)
