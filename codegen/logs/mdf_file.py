"""MDF 4, the measurement format of ASAM: channels of groups, each group with a time of its own."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from codegen.base.errors import BadInput, Place
from codegen.base.input_files import opened
from codegen.logs.description import LogDescription
from codegen.logs.library import library, reading
from codegen.logs.signal_source import Signal, SignalSource
from codegen.logs.source import LARGEST_STREAM, Allowance, shown

EXPECTED = "an MDF 4 log (.mf4)"
PLAIN = {0: "none", 1: "linear", 2: "rational"}
"""Conversions that are numbers; the others are tables, or formulas of the file, which nothing evaluates here."""


def open_mdf(path: Path, allowance: Allowance, description: LogDescription) -> SignalSource:
    """Open an .mf4 file; a channel whose name stands in several groups is called NAME@GROUP, groups counted from 0.

    Raises:
        BadInput: where its library is not installed, or for a file that is none or damaged.
    """
    asammdf = library("asammdf", "mdf", path)
    with opened(path, EXPECTED, LARGEST_STREAM) as stream:
        head = stream.read(16)
    if head[:8].rstrip() not in (b"MDF", b"UnFinMF") or head[8:9] != b"4":
        raise BadInput(Place(str(path)), f"the first bytes {head[:12]!r}", EXPECTED, code="LOG001")
    spots: dict[str, tuple[int, int]] = {}
    lengths: dict[str, int] = {}
    units: dict[str, str] = {}
    unread: dict[str, str] = {}
    with reading(path, EXPECTED):
        mdf = asammdf.MDF(path)
        found = [
            (g, c, group, channel) for g, group in enumerate(mdf.groups) for c, channel in enumerate(group.channels)
        ]
        counts = Counter(channel.name for g, c, _, channel in found if mdf.masters_db.get(g) != c)
        for g, c, group, channel in found:
            if mdf.masters_db.get(g) == c:
                continue
            name = channel.name if counts[channel.name] == 1 else f"{channel.name}@{g}"
            why = _unread(mdf, g, group, channel)
            if why:
                unread[name] = why
                continue
            spots[name], lengths[name] = (g, c), int(group.channel_group.cycles_nr)
            units[name] = str(channel.unit or "")

    def signal(name: str) -> Signal:
        g, c = spots[name]
        read = mdf.get(group=g, index=c)
        if read.samples.ndim != 1 or read.samples.dtype.kind not in "fiub":
            raise ValueError(f"`{shown(name)}` holds no numbers")
        values = np.array(read.samples, dtype=np.float64)
        if read.invalidation_bits is not None:
            values[np.asarray(read.invalidation_bits, dtype=bool)] = np.nan
        return f"group {g}", np.array(read.timestamps, dtype=np.float64), values

    return SignalSource(path, EXPECTED, lengths, units, unread, signal, description, allowance)


def _unread(mdf: Any, g: int, group: Any, channel: Any) -> str:
    """Why a channel is no column; empty for one that is."""
    master = mdf.masters_db.get(g)
    if master is None:
        return "its group has no time"
    for one in (channel, group.channels[master]):
        kind = one.conversion.conversion_type if one.conversion is not None else 0
        if kind not in PLAIN:
            return "it has a conversion by a table or a formula of the file, which nothing evaluates here"
    if not group.channel_group.cycles_nr:
        return "it has no sample"
    return "" if channel.data_type in range(6) else "it holds no numbers"
