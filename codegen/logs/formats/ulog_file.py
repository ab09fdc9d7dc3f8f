"""ULog, the log format of PX4: columns ``TOPIC.field`` or ``TOPIC[instance].field``; read whole."""

import numpy as np

from codegen.logs.formats.series import ChannelFile, Signal
from codegen.logs.formats.source import LARGEST

COPIES = 3
"""Memory for reading a file over its size."""


class UlogFile(ChannelFile):
    """An opened .ulg file; the time of a topic is its ``timestamp`` of publication."""

    expected = "a ULog file of PX4 (.ulg)"

    def find(self) -> None:
        pyulog = self.library("pyulog", "ulog")
        with self.opened(LARGEST) as stream, self.reading():
            self.take(COPIES * stream.seek(0, 2))
            stream.seek(0)
            log = pyulog.ULog(stream)
            if log.file_corruption:
                raise ValueError("parts that are no messages")
            self._topics = {d.name if not d.multi_id else f"{d.name}[{d.multi_id}]": d.data for d in log.data_list}
        timed = {topic: data for topic, data in self._topics.items() if "timestamp" in data}
        self.unread = {topic: "it has no timestamp" for topic in self._topics if topic not in timed}
        self.set_columns({f"{t}.{name}": len(v) for t, data in timed.items() for name, v in data.items() if len(v)})

    def signal(self, name: str) -> Signal:
        topic, _, field = name.partition(".")
        data = self._topics[topic]
        return Signal(topic, data["timestamp"].astype(np.int64) / 1e6, np.asarray(data[field], dtype=np.float64))
