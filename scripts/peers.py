"""A peer of an OpenDaVINCI session: what it sends, and what it hears back."""

import socket
import struct
import threading
import time

from envelopes import POINT_CLOUD, entry, fields

CID = 111
GROUP, PORT = f"225.0.0.{CID}", 12175
OBJECTS, TILE, STATUS = 2021, 2022, 2023
# Fields of Status that are asked for, by name.
STATUS_FIELDS = {
    "received": 2, "published": 3, "refused": 4, "queue_dropped": 5, "kernel_dropped": 7, "faults": 11, "p99": 13,
    "clock_behind": 47, "distrusted": 48, "missed": 49, "health": 50, "not_sent": 51, "fragmented_lost": 52,
}  # fmt: skip


class Peer:
    """Sends into the session from an address, and keeps count of what comes back."""

    def __init__(self, address, listens=True):
        self.sent = 0
        self.lists, self.maps, self.status, self.listed_at = 0, set(), {}, None
        self._out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._out.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(address))
        self._out.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 1)
        self._out.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_LOOP, 0)
        self._out.bind((address, 0))
        self._in = None
        if listens:
            self._in = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            self._in.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            self._in.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 23)
            self._in.bind((GROUP, PORT))
            joined = socket.inet_aton(GROUP) + socket.inet_aton(address)
            self._in.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, joined)
            self._in.settimeout(0.1)
            self._ends = threading.Event()
            self._thread = threading.Thread(target=self._listen, daemon=True)
            self._thread.start()

    def close(self):
        if self._in:
            self._ends.set()
            self._thread.join()
            self._in.close()
        self._out.close()

    def send(self, frame):
        try:
            self._out.sendto(frame, (GROUP, PORT))
        except OSError:
            pass

    def play(self, recording, more=lambda entry, since_s: (), replace=lambda entry, since_s: entry.frame):
        """Sends the entries of a recording at their own pace; `more` says what is sent after each, `replace` what in
        its place."""
        begin, first_us = time.monotonic(), recording[0].sampled_us
        for entry in recording:
            since_s = 1e-6 * (entry.sampled_us - first_us)
            time.sleep(max(0.0, begin + since_s - time.monotonic()))
            frame = replace(entry, since_s)
            if frame:
                self.send(frame)
                self.sent += entry.kind == POINT_CLOUD
            for other in more(entry, since_s):
                self.send(other)

    def _listen(self):
        while not self._ends.is_set():
            try:
                heard = entry(self._in.recv(65535))
            except (TimeoutError, OSError):
                continue
            except (IndexError, KeyError, struct.error):
                continue
            if heard.kind == OBJECTS:
                self.lists += 1
                self.listed_at = time.monotonic()
            elif heard.kind == TILE:
                self.maps.add(dict(fields(heard.payload)).get(1, 0))
            elif heard.kind == STATUS:
                values = dict(fields(heard.payload))
                self.status = {name: values.get(number, 0) for name, number in STATUS_FIELDS.items()}
                for name in ("faults", "health", "distrusted"):
                    self.status[name] = (self.status[name] or b"").decode()
