"""Samples and commands as JSON lines, and as messages of OSC."""

import json
import queue
import socket
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping
from typing import IO, Any
from urllib.parse import urlsplit

from calmotion.host import SettingError

from .session import Live

IN, OUT = "/calm/in", "/calm/out"
Sample = tuple[float, dict[str, float]]


class Source(ABC):
    """Where samples come from.

    Attributes:
        fault: What was wrong with the first message that was no sample, or None.
        faults: How many were none.
    """

    fault: str | None = None
    faults: int = 0

    def _refuse(self, error: SettingError) -> None:
        self.fault, self.faults = self.fault or str(error), self.faults + 1

    @abstractmethod
    def arrived(self) -> list[Sample] | None:
        """Those that arrived since the last call; None once there will be no more."""

    def samples(self) -> Iterator[Sample]:
        """All of them, of a source in which they are there already."""
        raise NotImplementedError

    def close(self) -> None:  # noqa: B027
        """Stop listening; most have nothing to close."""


class Sink(ABC):
    """Where commands go."""

    @abstractmethod
    def send(self, time_s: float, commands: Mapping[str, float], live: Live) -> None:
        """One tick's commands [rad or m], by the paths of the joints."""

    def close(self) -> None:  # noqa: B027
        """The stream has ended; most have nothing to close."""


def sample_of(line: str) -> Sample:
    """A sample from a line such as `{"t": 0.1, "joints": {"/Arm/Elbow": 0.3}}`.

    Raises:
        SettingError: It is no such line.
    """
    try:
        found = json.loads(line.lstrip("\ufeff"))
        joints = {str(path): _number(value) for path, value in found["joints"].items()}
        return _number(found["t"]), joints
    except (ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError) as error:
        raise SettingError(
            "a line of the stream is no sample",
            path="--in",
            found=line.strip()[:80],
            remedy='Send lines such as {"t": 0.1, "joints": {"/Arm/Elbow": 0.3}}, in s and rad (m of sliders).',
        ) from error


def _number(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError
    return float(value)


class Lines(Source):
    """JSON lines; a line that is no sample is left out.

    Args:
        lines: A file.
        waits: Whether a thread of its own reads them as they come; else all are there.
    """

    def __init__(self, lines: IO[str], waits: bool = True):
        self._queue: queue.SimpleQueue[Sample | None] = queue.SimpleQueue()
        self._lines, self._ended = lines, False
        if waits:
            threading.Thread(target=self._read, daemon=True).start()

    def samples(self) -> Iterator[Sample]:
        """Those of the file, in its order; empty lines count for nothing."""
        for line in self._lines:
            try:
                if line.strip():
                    yield sample_of(line)
            except SettingError as error:
                self._refuse(error)

    def _read(self) -> None:
        for sample in self.samples():
            self._queue.put(sample)
        self._queue.put(None)

    def arrived(self) -> list[Sample] | None:
        """Those that the thread has read."""
        found: list[Sample] = []
        while not (self._ended or self._queue.empty()):
            item = self._queue.get()
            self._ended = item is None
            found += [] if item is None else [item]
        return None if self._ended and not found else found


class Samples(Source):
    """Samples that are known; they arrive at once, and are used at the times of their stamps."""

    def __init__(self, samples: Iterable[Sample]):
        self._samples: Iterator[Sample] = iter(samples)

    def samples(self) -> Iterator[Sample]:
        """Those that have not arrived."""
        return self._samples

    def arrived(self) -> list[Sample] | None:
        """All of them, and then None."""
        return list(self._samples) or None


class OscSource(Source):
    """Messages `/calm/in/<joint path>` with one float each, stamped when they arrive; time tags are not used.

    Raises:
        SettingError: The port cannot be opened.
    """

    def __init__(self, host: str, port: int):
        self._queue: queue.SimpleQueue[Sample] = queue.SimpleQueue()
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.bind((host, port))
        except OSError as error:
            self._socket.close()
            raise SettingError(
                "this port cannot be opened",
                path="--in",
                found=f"osc://{host}:{port}: {error.strerror}",
                remedy="Choose another port, or end the program that has it.",
            ) from error
        self._socket.settimeout(0.2)
        self._open = True
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        from pythonosc.osc_packet import OscPacket

        while self._open:
            try:
                packet = OscPacket(self._socket.recv(65536))
            except TimeoutError:
                continue
            except OSError:
                return
            except Exception as error:  # whatever the parser makes of bytes that are no message
                self._refuse_message(f"{type(error).__name__}: {error}"[:80])
                continue
            for timed in packet.messages:
                self._given(timed.message.address, timed.message.params)

    def _given(self, address: str, values: list[Any]) -> None:
        try:
            if not address.startswith(f"{IN}/") or len(values) != 1:
                raise ValueError
            self._queue.put((time.monotonic(), {address[len(IN) :]: _number(values[0])}))
        except ValueError:
            self._refuse_message(f"{address} {' '.join(map(str, values))}"[:80])

    def _refuse_message(self, found: str) -> None:
        remedy = f"Send messages such as {IN}/Arm/Elbow with one float, in rad (m of sliders)."
        self._refuse(SettingError("a message of OSC is no sample", path="--in", found=found, remedy=remedy))

    def arrived(self) -> list[Sample]:
        """At most one sample, with the last values of all faders that moved."""
        stamp, values = 0.0, dict[str, float]()
        while not self._queue.empty():
            stamp, moved = self._queue.get()
            values |= moved
        return [(stamp, values)] if values else []

    def close(self) -> None:
        """Close the port."""
        self._open = False
        self._socket.close()


class LineSink(Sink):
    """Lines such as `{"t": 0.22, "joints": {...}, "late": 0, "limited": []}`."""

    def __init__(self, file: IO[str]):
        self._file = file

    def send(self, time_s: float, commands: Mapping[str, float], live: Live) -> None:
        """Write and flush a line."""
        line = {"t": round(time_s, 9), "joints": commands, "late": live.late, "limited": list(live.limited)}
        self._file.write(json.dumps(line) + "\n")
        self._file.flush()


class OscSink(Sink):
    """Messages `/calm/out/<joint path>` with one float each."""

    def __init__(self, host: str, port: int):
        from pythonosc.udp_client import SimpleUDPClient

        self._client = SimpleUDPClient(host, port)

    def send(self, time_s: float, commands: Mapping[str, float], live: Live) -> None:
        """One message for each joint."""
        for path, value in commands.items():
            self._client.send_message(f"{OUT}{path}", value)


def osc_place(text: str, option: str) -> tuple[str, int] | None:
    """Host and port of `osc://HOST:PORT`; the host is this machine where none is given. None for `-`.

    Raises:
        SettingError: It is neither, or python-osc is not installed.
    """
    if text == "-":
        return None
    place = urlsplit(text)
    try:
        port = place.port
    except ValueError:
        port = None
    if place.scheme != "osc" or not port:
        raise SettingError(
            "this is no place of a stream",
            path=option,
            found=text,
            remedy="Use - for standard input and output, or osc://127.0.0.1:9000.",
        )
    try:
        import pythonosc  # noqa: F401
    except ImportError as error:
        raise SettingError(
            "OSC needs python-osc, which is not installed",
            path=option,
            found=text,
            remedy='Install it: pip install "python-osc>=1.9,<2".',
        ) from error
    host = place.hostname or "127.0.0.1"
    try:
        found = socket.getaddrinfo(host, port, socket.AF_INET, socket.SOCK_DGRAM)
    except OSError as error:
        raise SettingError(
            "no machine of this name is known", path=option, found=host, remedy="Name its address, such as 127.0.0.1."
        ) from error
    return str(found[0][4][0]), port
