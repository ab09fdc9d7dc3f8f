"""A sliding mass whose log is computed here, in closed form, and not by the code under test."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

MASS, LEVEL = 2.0, 3.0
TEXT = f"""name: slider
coordinates: {{x: {{velocity: v, unit: m}}}}
inputs: {{w: {{unit: N}}}}
parameters:
  m: {{value: {MASS}, unit: kg}}
mass_matrix: [[m]]
force: [w]
friction:
  distribution: [[1]]
  contacts: [{{name: rail, a: {LEVEL}, unit: N}}]
"""


def rows(duration: float = 10.0, rate: float = 500.0, frequency: float = 0.5, amplitude: float = 0.1) -> dict[str, Any]:
    """x = A sin ωt, with the force m a + level·sgn(v) that makes it so."""
    t = np.arange(round(duration * rate)) / rate
    omega = 2 * np.pi * frequency
    x, v, a = (
        amplitude * np.sin(omega * t),
        amplitude * omega * np.cos(omega * t),
        -amplitude * omega**2 * np.sin(omega * t),
    )
    return {"t": t, "x": x, "v": v, "w": MASS * a + LEVEL * np.sign(v)}


def write_csv(path: Path, columns: dict[str, Any], delimiter: str = ",", fmt: str = "%.9g") -> Path:
    values = np.column_stack(list(columns.values()))
    line = delimiter.join([fmt] * len(columns)) + "\n"  # as by np.savetxt, in a fifth of its time
    path.write_text(delimiter.join(columns) + "\n" + line * len(values) % tuple(values.ravel().tolist()), "utf-8")
    return path
