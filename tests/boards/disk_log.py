"""What a disk holds when power is cut: the log of its writes that QEMU's blklogwrites kept, replayed up to a moment. Of what
the board wrote since it last flushed the disk's cache each write is kept or lost at random."""
import dataclasses
import json
import pathlib
import struct
import subprocess
import threading
import time

MAGIC = 0x6A736677736872
SECTOR = 512
FLUSH, DISCARD = 1, 4  # virtio-blk writes nothing past the cache
LOOK_S = 0.05


@dataclasses.dataclass
class Moment:
    """How far the logs, one a start of the board, had come at a time."""
    at_s: float
    log: int
    end: int


@dataclasses.dataclass
class Entry:
    end: int  # its place in the log
    flags: int
    offset: int
    data: bytes


def entries(log):
    """What was written, in its order; a flush may come with no data."""
    with log.open("rb") as file:
        head = file.read(SECTOR)
        if len(head) < SECTOR:
            return  # nothing was written
        magic, version, _, sector = struct.unpack("<QQQI", head[:28])
        if (magic, version, sector) != (MAGIC, 1, SECTOR):
            raise RuntimeError(f"{log}: expected a log of writes in sectors of {SECTOR}, found {magic:x}, {version}, {sector}")
        while len(head := file.read(SECTOR)) == SECTOR:
            first, count, flags, _ = struct.unpack("<QQQQ", head[:32])
            data = b"" if flags & DISCARD else file.read(count * SECTOR)
            yield Entry(file.tell(), flags, first * SECTOR, data)


class Recorder:
    """Looks all the time how far the logs are; `logs` grows with each start of the board."""

    def __init__(self, logs):
        self.logs, self.moments = logs, []
        self.over = threading.Event()
        self.thread = threading.Thread(target=self.look, daemon=True)

    def look(self):
        while not self.over.wait(LOOK_S):
            log = len(self.logs) - 1
            # Not on the disk when QEMU has only begun: the log begins with what the first flush writes.
            end = self.logs[log].stat().st_size if self.logs[log].exists() else 0
            self.moments.append(Moment(time.monotonic(), log, end))

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.over.set()
        self.thread.join()

    def save(self, file, begin_s, end_s):
        """Keeps what was between two times, as s from the first."""
        kept = [[moment.at_s - begin_s, moment.log, moment.end] for moment in self.moments if begin_s <= moment.at_s <= end_s]
        file.write_text(json.dumps({"logs": [str(log) for log in self.logs], "moments": kept}))


def load(file):
    """The logs of a Recorder, and the moments of its time in their order."""
    kept = json.loads(file.read_text())
    return [pathlib.Path(log) for log in kept["logs"]], [Moment(*moment) for moment in kept["moments"]]


class Replay:
    """Makes the disk as it is after a cut, of moments in their order."""

    def __init__(self, start, logs, dice):
        """`start`: the disk before the first of the logs."""
        self.durable, self.logs, self.dice = start.with_name("durable.img"), logs, dice
        subprocess.run(["cp", "--sparse=always", start, self.durable], check=True)
        self.number, self.entries = -1, iter(())
        self.ahead = None      # read, but behind the last moment
        self.in_cache = []     # written since the last flush
        self.flushed = 0       # writes before that

    def flush(self):
        with self.durable.open("r+b") as disk:
            for entry in self.in_cache:
                disk.seek(entry.offset)
                disk.write(entry.data)
        self.flushed += len(self.in_cache)
        self.in_cache = []

    def take(self, entry):
        if entry.flags & FLUSH:
            self.flush()
        if entry.data:
            self.in_cache.append(entry)

    def forward(self, log, end):
        """Takes what comes before the place `end` in the log of this number; all of those before."""
        while True:
            entry = self.ahead or next(self.entries, None)
            self.ahead = None
            if entry is None and self.number < log:
                self.flush()  # QEMU has ended, and written what it had
                self.number += 1
                self.entries = entries(self.logs[self.number])
            elif entry is None:
                return
            elif self.number == log and entry.end > end:
                self.ahead = entry
                return
            else:
                self.take(entry)

    def cut(self, moment, disk: pathlib.Path):
        """Writes `disk`; gives how many writes were in the cache, how many of them are lost, and which writes the disk has: two
        disks of the same writes are the same."""
        self.forward(moment.log, moment.end)
        subprocess.run(["cp", "--sparse=always", self.durable, disk], check=True)
        kept = [number for number in range(len(self.in_cache)) if self.dice.random() < 0.5]
        with disk.open("r+b") as file:
            for number in kept:
                file.seek(self.in_cache[number].offset)
                file.write(self.in_cache[number].data)
        return len(self.in_cache), len(self.in_cache) - len(kept), (self.flushed, *kept)
