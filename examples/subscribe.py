#!/usr/bin/env python3
"""A subscriber without any package: prints every list of objects that a daemon in a session sends.

usage: examples/subscribe.py CID [INTERFACE], beside `kreisel demo --cid CID` with INTERFACE 127.0.0.1
"""

import socket
import struct
import sys

OBJECT_LIST, PORT = 2021, 12175
CLASSES = ["unclassified", "car", "cyclist", "pedestrian", "truck"]


def varint(data, at):
    value = shift = 0
    while True:
        value |= (data[at] & 127) << shift
        shift, at = shift + 7, at + 1
        if data[at - 1] < 128:
            return value, at


def fields(data):
    """Fields of a protobuf message by number."""
    found, at = {}, 0
    while at < len(data):
        key, at = varint(data, at)
        if key & 7 == 0:
            found[key >> 3], at = varint(data, at)
        elif key & 7 == 1:
            found[key >> 3], at = struct.unpack_from("<d", data, at)[0], at + 8
        elif key & 7 == 5:
            found[key >> 3], at = struct.unpack_from("<f", data, at)[0], at + 4
        else:
            length, at = varint(data, at)
            found[key >> 3], at = data[at : at + length], at + length
    return found


def objects(data):
    """The objects of a list, each with its length before it."""
    at = 0
    while at < len(data):
        length, at = varint(data, at)
        yield fields(data[at : at + length])
        at += length


def main():
    group = f"225.0.0.{int(sys.argv[1])}"
    interface = sys.argv[2] if len(sys.argv) > 2 else "0.0.0.0"
    receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    receiver.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    receiver.bind((group, PORT))
    membership = socket.inet_aton(group) + socket.inet_aton(interface)
    receiver.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, membership)
    while True:
        envelope = fields(receiver.recv(65536)[5:])
        # The number of a message is zigzag-coded, as in libcluon.
        if envelope[1] != 2 * OBJECT_LIST:
            continue
        message = fields(envelope[2])
        print(f"revolution {message[1]}: {message[8]} objects", flush=True)
        for o in objects(message[11]):
            print(f"  {CLASSES[o[2]]} {o[1]} at {o[6]:.1f}, {o[7]:.1f} m, {o[10]:.1f} m/s", flush=True)


if __name__ == "__main__":
    main()
