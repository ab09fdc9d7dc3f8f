"""1000 sets of gains over one log: our scalar C and our lanes as libraries, and numba."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.measure.build import run_compiler
from benchmarks.model import NUDGE, Model
from benchmarks.peers import two_mass_by_hand as by_hand
from benchmarks.peers.plain_c import SOURCES
from benchmarks.peers.python_peers import compiled

FLAGS = ("-std=gnu99", "-O3", "-ffp-contract=off", "-march=native", "-mprefer-vector-width=512", "-fPIC", "-shared")
REALS = {"double": np.float64, "single": np.float32}
COMPILE_LIMIT = 120.0
NOMINAL = (500.0, 700.0, 10.0, 10.0)

Study = Callable[[np.ndarray, np.ndarray], np.ndarray]
"""(gains, sets by four; rows, samples by three) → a sum for each set."""


def gain_sets(sets: int) -> np.ndarray:
    """Random gains between 0.5 and 1.5 times those of the spec, (sets, 4)."""
    scale = 0.5 + np.random.default_rng(1).random((sets, len(NOMINAL)))
    return scale * np.array(NOMINAL)


def in_c(model: Model, folder: Path, kind: str, precision: str) -> Study:
    """``kind``: scalar or lanes. Raises Missing where it does not compile."""
    folder.mkdir(parents=True)
    files = {**model.files(precision, targets=("c",)), **model.files(precision, targets=("simd",))}
    files |= {name: (SOURCES / name).read_text(encoding="utf-8") for name in ("study.h", f"study_{kind}.c")}
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")
    real = REALS[precision]
    macros = (f"-DREAL={'float' if precision == 'single' else 'double'}", f"-DNUDGE=(REAL){NUDGE}")
    run_compiler(["gcc", *FLAGS, *macros, f"study_{kind}.c", "-o", "study.so", "-lm"], folder, COMPILE_LIMIT)
    library = ctypes.CDLL(str(folder / "study.so"))

    def run(gains: np.ndarray, rows: np.ndarray) -> np.ndarray:
        gains, rows = (np.ascontiguousarray(a, dtype=real) for a in (gains, rows))
        found = np.empty(len(gains), real)
        places = [a.ctypes.data_as(ctypes.c_void_p) for a in (gains, rows, found)]
        library.study(places[0], ctypes.c_long(len(gains)), places[1], ctypes.c_long(len(rows)), places[2])
        return found

    return run


def on_threads(study: Study, threads: int) -> Study:
    """The sets split among threads; a call of C lets the others run."""

    def run(gains: np.ndarray, rows: np.ndarray) -> np.ndarray:
        with ThreadPoolExecutor(threads) as pool:
            return np.concatenate(list(pool.map(lambda part: study(part, rows), np.split(gains, threads))))

    return run


def in_numba() -> Study:
    """Python by hand, its loops over sets and samples compiled. Raises Missing where numba is not installed."""
    step = compiled(by_hand.scalar_step)

    @compiled
    def loop(gains: Any, constants: Any, levels: Any, rows: Any, found: Any) -> None:
        state, outputs = np.empty(4), np.empty(8)
        for n in range(gains.shape[0]):
            K_between, K_ground, K_v1, K_v2 = gains[n, 0], gains[n, 1], gains[n, 2], gains[n, 3]
            k1, k2, coupling, over_m1, over_m2, _, _, _, _, h = constants
            own = (k1, k2, coupling, over_m1, over_m2, K_between, K_ground, K_v1, K_v2, h)
            state[0], state[1] = NUDGE - K_v1 * rows[0, 0], 2 * NUDGE - K_v2 * rows[0, 1]
            state[2], state[3] = levels
            total = 0.0
            for k in range(rows.shape[0]):
                step(state, own, rows[k], outputs)
                total += outputs[5] * outputs[5]
            found[n] = total

    def run(gains: np.ndarray, rows: np.ndarray) -> np.ndarray:
        found = np.empty(len(gains))
        loop(gains, by_hand.CONSTANTS, by_hand.LEVELS, rows, found)
        return found

    return run
