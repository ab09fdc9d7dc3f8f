"""TDMS, the log of LabVIEW: channels ``GROUP.CHANNEL``, timed by their ``wf_increment``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from codegen.base.errors import BadInput, Place
from codegen.base.input_files import opened
from codegen.logs.description import LogDescription
from codegen.logs.library import library, reading
from codegen.logs.log import Array
from codegen.logs.signal_source import Signal, SignalSource
from codegen.logs.source import LARGEST_STREAM, Allowance

EXPECTED = "a TDMS log (.tdms)"
STEP, DELAY, BEGIN = "wf_increment", "wf_start_offset", "wf_start_time"


def open_tdms(path: Path, allowance: Allowance, description: LogDescription) -> SignalSource:
    """Open a .tdms file. A channel without ``wf_increment`` has the times of its group's first channel of times, or
    else one that is called time or t.

    Raises:
        BadInput: where its library is not installed, or for a file that is none or damaged.
    """
    nptdms = library("nptdms", "tdms", path)
    with opened(path, EXPECTED, LARGEST_STREAM) as stream:
        if stream.read(4) != b"TDSm":
            raise BadInput(Place(str(path)), "no TDMS file", EXPECTED, code="LOG001")
    channels: dict[str, tuple[Any, Any]] = {}
    unread: dict[str, str] = {}
    with reading(path, EXPECTED):
        file = nptdms.TdmsFile.open(path)
        for group in file.groups():
            clock = next((c for c in group.channels() if _is_clock(c)), None)
            for channel in group.channels():
                name = f"{group.name}.{channel.name}"
                if channel is not clock and channel.dtype.kind not in "fiub":
                    unread[name] = "it holds no numbers"
                elif not len(channel):
                    unread[name] = "it has no sample"
                elif STEP not in channel.properties and (clock is None or len(clock) != len(channel)):
                    unread[name] = f"it has no `{STEP}`, and its group no channel of as many times"
                elif channel is not clock:
                    channels[name] = channel, clock
        begins = [c.properties[BEGIN] for c, _ in channels.values() if BEGIN in c.properties]
        origin = min(begins, default=None)
    units = {name: str(c.properties.get("unit_string", "")) for name, (c, _) in channels.items()}

    def signal(name: str) -> Signal:
        channel, clock = channels[name]
        time = _times(channel, origin) if STEP in channel.properties else _clock_times(clock)
        return name.partition(".")[0], time, np.asarray(channel[:], dtype=np.float64)

    lengths = {name: len(channel) for name, (channel, _) in channels.items()}
    return SignalSource(path, EXPECTED, lengths, units, unread, signal, description, allowance)


def _is_clock(channel: Any) -> bool:
    return channel.dtype.kind == "M" or channel.name.strip().lower() in ("time", "t")


def _times(channel: Any, origin: Any) -> Array:
    """By the channel's own properties, from the earliest start of all channels."""
    properties = channel.properties
    start = float(properties.get(DELAY, 0.0))
    if origin is not None and BEGIN in properties:
        start += float((properties[BEGIN] - origin) / np.timedelta64(1, "ns")) * 1e-9
    step = float(properties[STEP])
    if not step > 0:
        raise ValueError(f"{STEP} {step:g}")
    return np.asarray(start + step * np.arange(len(channel)), dtype=np.float64)


def _clock_times(clock: Any) -> Array:
    values = np.asarray(clock[:])
    if values.dtype.kind == "M":
        return np.asarray((values - values[0]) / np.timedelta64(1, "ns"), dtype=np.float64) * 1e-9
    return values.astype(np.float64)
