"""SIMD lanes: every lane has the bits of the scalar C, with its own gains and its own broken sensors."""

from __future__ import annotations

import ctypes
from dataclasses import replace

import numpy as np
import pytest

from codegen.emit.package import emit_sources, make_header

from .build import Built, compile_shared, motion
from .specs import spec_text

LANES = 16
CASES = [("two_mass", "double"), ("two_mass", "single"), ("emps", "double"), ("arm", "double"), ("arm", "single")]


def lane_struct(scalar: type[ctypes.Structure]) -> type[ctypes.Structure]:
    wide = ctypes.c_double in dict(scalar._fields_).values()  # modes are then as wide as the numbers
    kinds = [(name, ctypes.c_longlong if wide and name == "mode" else kind) for name, kind in scalar._fields_]
    fields = [(name, kind * LANES) for name, kind in kinds]
    return type(f"lanes_{scalar.__name__}", (ctypes.Structure,), {"_fields_": fields})


@pytest.mark.parametrize(("machine", "precision"), CASES)
def test_every_lane_is_the_scalar_observer(tmp_path, machine, precision):
    built = Built(tmp_path, spec_text(machine, "gcfo"), precision)
    name = built.program.name
    for file, text in emit_sources(built.program, make_header("m.yaml", "0" * 64, ""), ("simd",)).items():
        (tmp_path / file).write_text(text)
    library = ctypes.CDLL(str(compile_shared(tmp_path, f"{name}_lanes.c", "-O3")))
    constants, inputs, state, outputs = (lane_struct(s)() for s in built.structs)
    getattr(library, f"{name}_fill_lanes")(ctypes.byref(constants))
    gains = [p.name for p in built.program.parameters if p.name.startswith("K_")]
    values = {g: getattr(constants, g)[0] for g in gains}
    for lane in range(LANES):
        for gain, value in values.items():
            getattr(constants, gain)[lane] = value * (1 + lane / 64)
    getattr(library, f"{name}_prepare_lanes")(ctypes.byref(constants))
    rows = motion(built.program, 200)
    rows[50, 0], rows[120, -1] = np.nan, np.inf
    found = np.zeros((len(rows), LANES, len(built.program.outputs)))
    places = [ctypes.byref(x) for x in (state, constants, inputs, outputs)]
    for k, row in enumerate(rows):
        for (field, _), value in zip(inputs._fields_, row, strict=True):
            for lane in range(LANES):
                getattr(inputs, field)[lane] = value * (1 + (lane % 3) / 8)
        if k == 0:
            getattr(library, f"{name}_init_lanes")(*places[:3])
        getattr(library, f"{name}_step_lanes")(*places)
        assert set(outputs.fault) == {int(k in (50, 120))}
        for i, (output, _, _) in enumerate(built.program.outputs):
            found[k, :, i] = getattr(outputs, output)
    for lane in range(0, LANES, 5):
        for gain, value in values.items():
            setattr(built.parameters, gain, type(built.parameters).__dataclass_fields__[gain].default * 0 + value)
            setattr(built.parameters, gain, getattr(built.parameters, gain) * (1 + lane / 64))
        built.parameters = replace(built.parameters)
        built.twin.prepare(built.parameters)
        expected, _ = built.c_run(rows * (1 + (lane % 3) / 8))
        assert expected.tobytes() == np.ascontiguousarray(found[:, lane]).tobytes()
