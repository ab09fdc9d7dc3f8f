"""TDMS, the log format of LabVIEW: channels ``GROUP.CHANNEL``, with times from their ``wf_increment``."""

from typing import Any

import numpy as np

from codegen.base.arrays import Array
from codegen.logs.formats.series import ChannelFile, Signal
from codegen.logs.formats.source import listing

STEP, DELAY, BEGIN = "wf_increment", "wf_start_offset", "wf_start_time"


class TdmsFile(ChannelFile):
    """An opened .tdms file.

    A channel without ``wf_increment`` has the times of its group's first channel of times, or of one called time or t;
    without these, those of the description's sample rate.
    """

    expected = "a TDMS log (.tdms)"

    def find(self) -> None:
        nptdms = self.library("nptdms", "tdms")
        with self.opened() as stream:
            if stream.read(4) != b"TDSm":
                raise self.fault("no TDMS file")
        self._channels: dict[str, tuple[Any, Any]] = {}  # name → channel, and the channel of its times or None
        rate, counted = self.description.sample_rate_hz, list[str]()
        with self.reading():
            for group in nptdms.TdmsFile.open(self.path).groups():
                clocks = (c for c in group.channels() if c.dtype.kind == "M" or c.name.strip().lower() in ("time", "t"))
                clock = next(clocks, None)
                for channel in group.channels():
                    name = f"{group.name}.{channel.name}"
                    if why := self._why_unread(channel, clock):
                        self.unread[name] = why
                    elif not _has_times(channel, clock):
                        counted.append(name)
                        self._channels[name] = channel, None
                    elif channel is not clock:
                        self._channels[name] = channel, clock
            begins = [c.properties[BEGIN] for c, _ in self._channels.values() if BEGIN in c.properties]
            self._origin = min(begins, default=None)
        if counted:
            self.own_notes.append(f"{listing(counted)}: times counted at the description's {rate:g} Hz")
        self.units = {name: str(c.properties.get("unit_string", "")) for name, (c, _) in self._channels.items()}
        self.set_columns({name: len(channel) for name, (channel, _) in self._channels.items()})

    def signal(self, name: str) -> Signal:
        channel, clock = self._channels[name]
        if STEP in channel.properties:
            time = self._times(channel)
        elif clock is None:
            assert self.description.sample_rate_hz is not None
            time = np.arange(len(channel)) / self.description.sample_rate_hz
        elif (stamps := np.asarray(clock[:])).dtype.kind == "M":
            time = np.asarray((stamps - stamps[0]) / np.timedelta64(1, "ns"), dtype=np.float64) * 1e-9
        else:
            time = stamps.astype(np.float64)
        return Signal(name.partition(".")[0], time, np.asarray(channel[:], dtype=np.float64))

    def _why_unread(self, channel: Any, clock: Any) -> str:
        """Why a channel cannot be read, in words; "" if it can. ``clock``: its group's channel of times, or None."""
        if channel is not clock and channel.dtype.kind not in "fiub":
            return "it holds no numbers"
        if not len(channel):
            return "it has no sample"
        if _has_times(channel, clock) or self.description.sample_rate_hz is not None:
            return ""
        stated = "`sample_time: SECONDS` in meta.yaml beside the log states it"
        return f"it has no `{STEP}`, and its group no channel of as many times; {stated}"

    def _times(self, channel: Any) -> Array:
        """The times by the channel's own properties, s, from the earliest start of all channels."""
        properties = channel.properties
        start = float(properties.get(DELAY, 0.0))
        if self._origin is not None and BEGIN in properties:
            start += float((properties[BEGIN] - self._origin) / np.timedelta64(1, "ns")) * 1e-9
        step = float(properties[STEP])
        if not step > 0:
            raise ValueError(f"{STEP} {step:g}")
        return np.asarray(start + step * np.arange(len(channel)), dtype=np.float64)


def _has_times(channel: Any, clock: Any) -> bool:
    """Whether the file has the times of a channel: a step of its own, or a channel of as many times in its group."""
    return STEP in channel.properties or (clock is not None and len(clock) == len(channel))
