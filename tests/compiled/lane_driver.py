"""The lanes behind the driver's two calls: the same row in every lane, the outputs and state of the last one."""

from __future__ import annotations

from codegen.emit.package import emit_sources, make_header

from .driver import HOST_FLAGS, Loaded
from .shipped import interface, program
from .toolchain import GCC, Workshop

DRIVER = """#include "{n}_lanes.h"
#include <string.h>
typedef {real} real;
static {n}_lane_parameters parameters; static {n}_lane_state state; static {n}_lane_outputs found;
enum {{ LAST = {N}_LANES - 1 }};
void driver_start(const real *row);
void driver_run(long samples, const real *rows, real *outputs, real *states);
static void take({n}_lane_inputs *to, const real *row)
{{
    for (int lane = 0; lane <= LAST; lane++) {{
{take}
    }}
}}
void driver_start(const real *row)
{{
    {n}_lane_inputs inputs;
    take(&inputs, row);
    {n}_fill_lanes(&parameters);
    memset(&found, 0, sizeof found);
    {n}_init_lanes(&state, &parameters, &inputs);
}}
void driver_run(long samples, const real *rows, real *outputs, real *states)
{{
    for (long k = 0; k < samples; k++) {{
        {n}_lane_inputs inputs;
        take(&inputs, rows + k * {inputs});
        {n}_step_lanes(&state, &parameters, &inputs, &found);
{give}
    }}
}}
"""


def lane_files(spec: str, precision: str) -> dict[str, str]:
    """The lanes, and driver.c with the two calls."""
    face = interface(spec, precision)
    name = face.name
    files = dict(emit_sources(program(spec, precision), make_header("m.yaml", "0" * 64, ""), ("simd",)))
    take = [f"        to->{e}[lane] = row[{k}];" for k, e in enumerate(face.elements("inputs"))]
    give = []
    for part, source, target in (("outputs", "found", "outputs"), ("state", "state", "states")):
        count = len(face.elements(part))
        give += [
            f"        {target}[k * {count} + {j}] = (real){source}.{e}[LAST];"
            for j, e in enumerate(face.elements(part))
        ]
    files["driver.c"] = DRIVER.format(
        n=name,
        N=name.upper(),
        real=face.real,
        take="\n".join(take),
        give="\n".join(give),
        inputs=len(face.elements("inputs")),
    )
    return files


def load_lanes(workshop: Workshop, spec: str, precision: str) -> Loaded:
    """The lanes at -O3."""
    face, files = interface(spec, precision), lane_files(spec, precision)
    name = face.name
    driver = workshop.object(files, "driver.c", GCC, *HOST_FLAGS, "-O1")
    lanes = workshop.object(files, f"{name}_lanes.c", GCC, *HOST_FLAGS, "-O3")
    return Loaded(workshop.link(f"{name}_lanes.so", GCC, "-shared", driver, lanes, "-lm"), face)
