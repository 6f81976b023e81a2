"""Two hosts in network namespaces of their own, and between them a wire that can lose, damage and hold up frames."""

import contextlib
import ctypes
import os
import random
import select
import socket
import struct
import subprocess
import threading

PREFIX = f"kreisel-{os.getpid()}"
PEER, WIRE, CAR = (f"{PREFIX}-{name}" for name in ("peer", "wire", "car"))
PEER_ADDRESS, OTHER_ADDRESS, CAR_ADDRESS = "10.77.0.1", "10.77.0.9", "10.77.0.2"
CLONE_NEWNET = 0x40000000
EVERY_PROTOCOL = 0x0003
ETHERNET, IP_PROTOCOL_UDP = 14, 17
OUTGOING = 4

_libc = ctypes.CDLL(None, use_errno=True)


def ip(words, namespace=None, check=True):
    where = ["-n", namespace] if namespace else []
    subprocess.run(["ip", *where, *words.split()], check=check, stderr=None if check else subprocess.DEVNULL)


@contextlib.contextmanager
def inside(namespace):
    """This thread in a namespace; sockets that are made there stay there."""

    def enter(path):
        with open(path) as file:
            if _libc.setns(file.fileno(), CLONE_NEWNET):
                raise OSError(ctypes.get_errno(), f"cannot enter {path}")

    with open(f"/proc/{os.getpid()}/task/{threading.get_native_id()}/ns/net") as before:
        enter(f"/run/netns/{namespace}")
        try:
            yield
        finally:
            if _libc.setns(before.fileno(), CLONE_NEWNET):
                raise OSError(ctypes.get_errno(), "cannot leave a namespace")


class Wire:
    """Carries frames between two interfaces, and does to those that go to the car what it is told."""

    def __init__(self):
        # Shares of the frames to the car that are lost, and of which a byte is turned.
        self.lost, self.damaged = 0.0, 0.0
        # Whether nothing passes at all.
        self.cut = False
        self._chance = random.Random(1)
        self._stop = threading.Event()
        self._thread = None

    def start(self):
        self._stop.clear()
        with inside(WIRE):
            self._ends = [socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(EVERY_PROTOCOL)) for _ in range(2)]
        for end, name in zip(self._ends, ("to-peer", "to-car")):
            end.bind((name, 0))
            end.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 24)
        self._thread = threading.Thread(target=self._carry, daemon=True)
        self._thread.start()

    def stop(self):
        self._stop.set()
        self._thread.join()
        for end in self._ends:
            end.close()

    def _carry(self):
        to_peer, to_car = self._ends
        while not self._stop.is_set():
            for end in select.select(self._ends, [], [], 0.1)[0]:
                with contextlib.suppress(OSError):
                    frame, address = end.recvfrom(65535)
                    if address[2] == OUTGOING or self.cut:
                        continue
                    is_to_car = end is to_peer
                    frame = self._passed(frame) if is_to_car else checked(frame)
                    if frame:
                        (to_car if is_to_car else to_peer).send(frame)

    def _passed(self, frame):
        if self._chance.random() < self.lost:
            return None
        frame = checked(frame)
        if self._chance.random() < self.damaged and len(frame) > 100:
            frame = frame[:-1] + bytes([frame[-1] ^ 0x55])
        return frame


def checked(frame):
    """A frame whose sender left the checksum of UDP to its hardware, without one."""
    header = ETHERNET
    if frame[12:14] != b"\x08\x00" or frame[header + 9] != IP_PROTOCOL_UDP:
        return frame
    fragment = struct.unpack("!H", frame[header + 6 : header + 8])[0]
    if fragment & 0x3FFF:
        return frame
    at = header + 4 * (frame[header] & 15) + 6
    return frame[:at] + b"\0\0" + frame[at + 2 :]


# What README advises where packets are lost, and what a kernel does otherwise: how long it keeps fragments, and how many
# bytes of them.
ADVISED, STOCK = (1, 1 << 26), (30, 1 << 22)
# Half of it, as a few seconds do not fill that on every kernel.
CROWDED = (30, 1 << 21)


def keep_fragments(seconds, most_bytes):
    # The kernel refuses a high threshold below the low one.
    values = {"time": seconds, "low_thresh": 1 << 20, "high_thresh": most_bytes}
    settings = [f"net.ipv4.ipfrag_{name}={value}" for name, value in values.items()]
    subprocess.run(["ip", "netns", "exec", CAR, "sysctl", "-qw", *settings], check=True)


def connect_car():
    """The car's interface, and the wire's end of it."""
    ip(f"link add to-car netns {WIRE} type veth peer name car0 netns {CAR}")
    ip("link set to-car up", WIRE)
    ip(f"address add {CAR_ADDRESS}/24 dev car0", CAR)
    ip("link set car0 up multicast on", CAR)


@contextlib.contextmanager
def hosts():
    """The two hosts and the wire between them."""
    made = []
    try:
        for namespace in (PEER, WIRE, CAR):
            ip(f"netns add {namespace}")
            made.append(namespace)
            ip("link set lo up", namespace)
        ip(f"link add to-peer netns {WIRE} type veth peer name peer0 netns {PEER}")
        ip("link set to-peer up", WIRE)
        for address in (PEER_ADDRESS, OTHER_ADDRESS):
            ip(f"address add {address}/24 dev peer0", PEER)
        ip("link set peer0 up multicast on", PEER)
        connect_car()
        keep_fragments(*ADVISED)
        wire = Wire()
        wire.start()
        try:
            yield wire
        finally:
            wire.stop()
    finally:
        for namespace in made:
            ip(f"netns delete {namespace}", check=False)
