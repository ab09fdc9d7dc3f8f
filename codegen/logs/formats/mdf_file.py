"""MDF 4, the measurement format of ASAM: channels in groups, each group with its own time."""

from collections import Counter
from typing import Any

import numpy as np

from codegen.base.user_text import brief
from codegen.logs.formats.series import ChannelFile, Signal

PLAIN = {0: "none", 1: "linear", 2: "rational"}
"""Conversions by numbers; the others are tables, or formulas in the file, which are not evaluated."""


class MdfFile(ChannelFile):
    """An opened .mf4 file; a channel whose name occurs in several groups is called NAME@GROUP, counted from 0."""

    expected = "an MDF 4 log (.mf4)"

    def find(self) -> None:
        asammdf = self.library("asammdf", "mdf")
        with self.opened() as stream:
            head = stream.read(16)
        if head[:8].rstrip() not in (b"MDF", b"UnFinMF") or head[8:9] != b"4":
            raise self.fault(f"the first bytes {head[:12]!r}")
        self._spots: dict[str, tuple[int, int]] = {}
        lengths: dict[str, int] = {}
        units: dict[str, str] = {}
        with self.reading():
            self._mdf = asammdf.MDF(self.path)
            masters = self._mdf.masters_db
            parts = [(g, c, group) for g, group in enumerate(self._mdf.groups) for c in range(len(group.channels))]
            parts = [(g, c, group) for g, c, group in parts if masters.get(g) != c]
            counts = Counter(group.channels[c].name for _, c, group in parts)
            for g, c, group in parts:
                channel = group.channels[c]
                name = channel.name if counts[channel.name] == 1 else f"{channel.name}@{g}"
                why = _unread(masters.get(g), group, channel)
                if why:
                    self.unread[name] = why
                    continue
                self._spots[name], lengths[name] = (g, c), int(group.channel_group.cycles_nr)
                units[name] = str(channel.unit or "")
        self.units = units
        self.set_columns(lengths)

    def signal(self, name: str) -> Signal:
        g, c = self._spots[name]
        read = self._mdf.get(group=g, index=c)
        if read.samples.ndim != 1 or read.samples.dtype.kind not in "fiub":
            raise ValueError(f"`{brief(name)}` holds no numbers")
        values = np.array(read.samples, dtype=np.float64)
        if read.invalidation_bits is not None:
            values[np.asarray(read.invalidation_bits, dtype=bool)] = np.nan
        return Signal(f"group {g}", np.array(read.timestamps, dtype=np.float64), values)


def _unread(master: int | None, group: Any, channel: Any) -> str:
    """Why a channel is no column; empty for one that is."""
    if master is None:
        return "its group has no time"
    for one in (channel, group.channels[master]):
        kind = one.conversion.conversion_type if one.conversion is not None else 0
        if kind not in PLAIN:
            return "it has a conversion by a table or a formula of the file, which nothing evaluates here"
    if not group.channel_group.cycles_nr:
        return "it has no sample"
    return "" if channel.data_type in range(6) else "it holds no numbers"
