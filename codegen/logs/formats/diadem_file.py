"""DIAdem's header files, as KUKA's trace writes them: channels in text, .dat, and their numbers in binary files beside.

A channel is implicit, start + k step, or explicit: numbers of a file that are stored one after the other (CHANNEL) or
in turn with those of the other channels (BLOCK), times a factor, plus an offset. Source: DIAdem's help, *Header File
Format*, whose numbers of the keys are those of ``_Channel``; KUKA writes some of its words in German.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from codegen.base.arrays import Array
from codegen.base.input_files import read_bytes
from codegen.base.user_text import brief
from codegen.logs.formats.source import Columns, File, LogFile

BEGINS = rb"DIAEXTENDED"
LARGEST_HEADER = 10_000_000
"""Most bytes of a header, which has about 300 for each channel."""
_TYPES = {"REAL64": "<f8", "REAL32": "<f4"}
_BEGIN, _END = "#BEGINCHANNELHEADER", "#ENDCHANNELHEADER"
_Channel = Mapping[str, str]
"""Key → value: 200 name, 202 unit, 210 implicit or explicit, 211 file, 213 storage, 214 type, 220 number of values,
221 place of the first from 1, 240 start or offset, 241 step or factor."""


class DiademFile(LogFile):
    """An opened header file; the files of numbers must be in its folder."""

    expected = "a DIAdem header (.dat), and its files of REAL64 or REAL32 beside it"

    def find(self) -> None:
        self._channels: dict[str, _Channel] = {}
        found: dict[str, str] | None = None
        header = read_bytes(self.path, self.expected, LARGEST_HEADER)
        for line in header.decode("cp1252", errors="replace").splitlines():
            key, _, value = line.strip().partition(",")
            if key == _BEGIN:
                found = {}
            elif key == _END and found is not None:
                name = found.get("200", "") or str(len(self._channels) + 1)
                self._channels[f"{name} ({len(self._channels) + 1})" if name in self._channels else name] = found
                found = None
            elif found is not None:
                found[key] = value.strip()
        if not self._channels:
            raise self.fault("no channel")
        self.names = tuple(self._channels)
        self.units = {name: c.get("202", "").strip("[]") for name, c in self._channels.items()}

    def load(self, wanted: Sequence[str]) -> Columns:
        counts = {name: self._number(name, "220") for name in wanted}
        self.require_equal({name: int(count) for name, count in counts.items()})
        self.take(int(8 * sum(counts.values())))
        vectors = [self._vector(name, int(counts[name])) for name in wanted]
        return Columns(str(self.path), tuple(wanted), np.column_stack(vectors))

    def _vector(self, name: str, count: int) -> Array:
        channel = self._channels[name]
        start, step = self._number(name, "240", "0"), self._number(name, "241", "1")
        if channel.get("210", "").upper().startswith("IMPLI"):
            return np.asarray(start + step * np.arange(count), dtype=np.float64)
        stored, file = _TYPES.get(channel.get("214", "")), channel.get("211", "")
        if stored is None:
            raise self.fault(
                f"numbers of type `{brief(channel.get('214', ''), 20)}`", "REAL64 or REAL32", name, "LOG005"
            )
        data = File(self.path.parent / file.replace("\\", "/").rpartition("/")[2], self.expected).read_bytes()
        numbers = np.frombuffer(data[: len(data) - len(data) % np.dtype(stored).itemsize], dtype=stored)
        first = int(self._number(name, "221", "1")) - 1
        if channel.get("213", "").upper() == "BLOCK":
            alike = ("211", "213", "214")
            width = sum(all(c.get(k) == channel.get(k) for k in alike) for c in self._channels.values())
            numbers = numbers[first::width] if len(numbers) == width * count and 0 <= first < width else numbers[:0]
        else:
            numbers = numbers[first : first + count] if first >= 0 else numbers[:0]
        if len(numbers) != count:
            raise self.fault(f"{len(data)} bytes in {brief(file)}", f"{count} values of each channel in it", name)
        return np.asarray(start + step * numbers.astype(np.float64), dtype=np.float64)

    def _number(self, name: str, key: str, default: str = "") -> float:
        """The number of a key of a channel; a count is positive."""
        text = self._channels[name].get(key) or default
        try:
            number = float(text)
        except ValueError:
            number = np.nan
        if not abs(number) < 1e300 or (key == "220" and not 1 <= number <= 1e9):
            raise self.fault(f"`{brief(text, 20)}` for the key {key}", "a number", name)
        return number
