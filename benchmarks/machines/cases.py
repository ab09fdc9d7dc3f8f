"""Files of a case: spec.yaml and meta.yaml as a user would write them, train.csv, test.csv, and truth.json."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.machines.draw import TEST_S, TRAIN_S, Machine, draw
from benchmarks.machines.drive import Record
from benchmarks.machines.families import G
from benchmarks.machines.judge import seen
from benchmarks.text import render
from codegen.base.files import write_atomically

DELAYS = ("input_delay", "actuator_lag")
TWINS = {"offset": "coulomb_asymmetry", "input_gain": "inertia_error"}
"""Kinds that are the same motion on one axis; gain and inertia only where no other declared force acts."""


def made(seed: int, index: int, folder: Path) -> Path:
    """The folder of a case, written where it is not there."""
    if not (folder / "truth.json").is_file():
        machine = draw(seed, index)
        rng = np.random.default_rng([seed, index, 1])
        train = machine.record(rng, rng.uniform(*TRAIN_S))
        test = machine.record(rng, TEST_S)
        write_atomically(folder / "spec.yaml", spec_text(machine, f"case_{index:04d}"))
        write_atomically(folder / "meta.yaml", meta_text(machine))
        for name, record in (("train", train), ("test", test)):
            write_atomically(folder / f"{name}.csv", log_text(machine, record))
        truth = json.dumps(truth_of(machine, train), indent=1, default=float)
        write_atomically(folder / "truth.json", truth + "\n")
    return folder


def spec_text(machine: Machine, name: str) -> str:
    """The declared model: parameters some percent off with their tolerances, friction levels off too."""
    quantities = machine.family.quantities
    damping = f" - b*{machine.family.axes[0].v}" if "b" in machine.values else ""
    return render(
        "machine_spec.yaml.j2",
        name=f"{machine.family.name}_{name}",
        axes=machine.family.axes,
        parameters=[
            (key, value, quantities[key].unit, "" if key in machine.fixed else f"{100 * quantities[key].tolerance:g}%")
            for key, value in machine.declared.items()
        ],
        weight=G if "*g" in machine.family.spec else None,
        motion=machine.family.spec.format(viscous=damping),
        levels=machine.declared_levels,
        units_of_input=[axis.driven for axis in machine.family.axes if axis.driven],
    )


def meta_text(machine: Machine) -> str:
    """How the log names its columns: a counter of the encoder, the current in A or in counts of the drive."""
    return render(
        "machine_meta.yaml.j2",
        axes=machine.family.axes,
        steps=machine.recorder.encoder,
        resolution=machine.recorder.resolution,
        hold="linear" if machine.recorder.measured else "zero-order",
    )


def log_text(machine: Machine, record: Record) -> str:
    """CSV with time in ms, encoder counts, and currents in counts."""
    axes = machine.family.axes
    driven = [k for k, axis in enumerate(axes) if axis.driven]
    names = ["t_ms", *(f"{axis.x}_counts" for axis in axes), *(f"{axes[k].driven}_counts" for k in driven)]
    counts = np.round(record.x / np.array(machine.recorder.encoder)).astype(int)
    currents = np.round(record.i[:, driven] / machine.recorder.resolution).astype(int)
    rows = np.column_stack([np.round(1000 * record.t).astype(int), counts, currents])
    return "\n".join([",".join(names), *(",".join(map(str, row)) for row in rows)]) + "\n"


def truth_of(machine: Machine, train: Record) -> dict[str, Any]:
    """The true machine and effects of a case, for the score; never an input to a diagnosis."""
    lacks = machine.lacks()
    kinds = [d.kind for d in lacks]
    known = machine.group in ("single", "double")
    refitted = [name for name in machine.values if name not in machine.fixed]
    held = not machine.recorder.measured
    shown = seen(machine.family, machine.values, machine.levels, train, held, refitted, any(k in DELAYS for k in kinds))
    return {
        "family": machine.family.name,
        "group": machine.group,
        "effects": [{"kind": d.kind, "on": d.on, "parameters": d.p} for d in lacks if known],
        "equivalents": [twins(machine, d.kind) for d in lacks if known],
        "foreign": kinds[0] if machine.group == "foreign" else "",
        "shown": asdict(shown),
        "identifiable": shown.identifiable,
        "values": machine.values,
        "levels": machine.levels,
        "recorder": asdict(machine.recorder),
    }


def twins(machine: Machine, kind: str) -> list[str]:
    """Other right names of an effect."""
    found = [b if kind == a else a for a, b in TWINS.items() if kind in (a, b)]
    return [] if machine.family.gravity and kind in ("input_gain", "inertia_error") else found
