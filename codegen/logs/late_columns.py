"""Columns that are logged late or early: their values are brought to the rows at whose times they were valid."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from codegen.base.errors import BadInput
from codegen.logs.cleaning import Clean
from codegen.logs.description import LogDescription
from codegen.logs.uniform import held_means


def in_time(cleaned: Clean, symbols: Sequence[str], held: Sequence[bool], description: LogDescription) -> Clean:
    """The rows with the columns of ``late`` moved by their times; rows without such a value at the ends are left out.

    A sampled column is interpolated linearly. A held one, a zero-order hold from row to row, is given by its mean over
    each row, which is the value of a later row where the time is a whole number of rows.

    Args:
        symbols, held: (1 + c), of time and of the columns of ``cleaned.data``.

    Raises:
        BadInput: for a time as long as the log, or one stated for ``t``.
    """
    late = {symbol: by for symbol, by in description.late.items() if by and symbol in symbols}
    if not late:
        return cleaned
    if "t" in late:
        raise BadInput(description.place("late.t"), "`t`", "a coordinate, velocity or input", code="LOG013")
    time, data = cleaned.time, cleaned.data.copy()
    ends = np.append(time, 2 * time[-1] - time[-2])  # of the rows
    slack = 1e-6 * float(np.median(np.diff(time)))
    used = np.ones(len(time), dtype=bool)
    for symbol, by in late.items():
        used &= (time + by >= time[0] - slack) & (time + by <= time[-1] + slack)
        if used.sum() < 2:
            expected = f"a time below the {time[-1] - time[0]:.4g} s of the log"
            raise BadInput(description.place(f"late.{symbol}"), f"{by:g} s", expected, code="LOG013")
        k = symbols.index(symbol) - 1
        data[:, k] = held_means(time, data[:, k], ends + by) if held[k + 1] else np.interp(time + by, time, data[:, k])
    words = ", ".join(f"{symbol} is taken {1e3 * by:.4g} ms earlier than logged" for symbol, by in late.items())
    notes = (*cleaned.notes, f"{words}, as the description says (`late`)")
    return replace(cleaned, time=time[used], data=data[used], source=cleaned.source.rows(used), notes=notes)
