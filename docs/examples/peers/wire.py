"""The open protocol of docs/wire.md, with Python's standard library alone.

Frames are bytes; a request is (number, kind, fields), an answer likewise. `Channel` carries frames over a Unix socket
or UDP.
"""

import socket
import struct
import zlib

PROTOCOL = 2
REQUESTS = ("hello", "reset", "observe")
ANSWERS = ("identity", "ready", "index", "values", "refused")


def varint(number):
    """A whole number in groups of seven bits, the lowest first; all but the last group have bit 7 set."""
    out = bytearray()
    while number > 0x7F:
        out.append(number & 0x7F | 0x80)
        number >>= 7
    out.append(number)
    return bytes(out)


class Reader:
    """Takes fields off the front of a message; raises IndexError where it is too short."""

    def __init__(self, data):
        self.data, self.at = data, 0

    def byte(self):
        self.at += 1
        return self.data[self.at - 1]

    def varint(self):
        number, shift = 0, 0
        while True:
            byte = self.byte()
            number |= (byte & 0x7F) << shift
            shift += 7
            if byte < 0x80:
                return number

    def bytes(self, length):
        if self.at + length > len(self.data):
            raise IndexError("message too short")
        self.at += length
        return self.data[self.at - length:self.at]


def floats_to_bytes(values):
    """Four bytes for each value, little-endian; NaN stands for a missing one."""
    return struct.pack(f"<{len(values)}f", *values)


def bytes_to_floats(data):
    return struct.unpack(f"<{len(data) // 4}f", data)


def seal(message):
    """A frame: zero, COBS(message, CRC-32), zero."""
    data = message + struct.pack("<I", zlib.crc32(message))
    out, block = bytearray([0]), bytearray()
    for byte in data:
        if byte:
            block.append(byte)
        if not byte or len(block) == 254:
            out.append(255 if byte else len(block) + 1)
            out += block
            block.clear()
    return bytes(out) + bytes([len(block) + 1]) + bytes(block) + b"\0"


def unseal(coded):
    """The message in what lies between two zeros; None if it is damaged."""
    data, at = bytearray(), 0
    while at < len(coded):
        length = coded[at]
        block = coded[at + 1:at + length]
        if len(block) != length - 1:
            return None
        data += block
        at += length
        if length < 255 and at < len(coded):
            data.append(0)
    message, crc = bytes(data[:-4]), bytes(data[-4:])
    good = len(crc) == 4 and struct.unpack("<I", crc)[0] == zlib.crc32(message)
    return message if good else None


def request(number, kind, **fields):
    """The frame of a request of a plant."""
    body = varint(number) + varint(REQUESTS.index(kind))
    if kind == "reset":
        body += bytes([fields["agent"]]) + varint(fields["seed"])
    elif kind == "observe":
        values = floats_to_bytes(fields["values"])
        body += varint(len(values)) + values
    return seal(body)


def read_request(message):
    """(number, kind, fields) of a message; kind is None for those that only boards need."""
    reader = Reader(message)
    number, code = reader.varint(), reader.varint()
    kind = REQUESTS[code] if code < len(REQUESTS) else None
    fields = {}
    if kind == "reset":
        fields = {"agent": bool(reader.byte()), "seed": reader.varint()}
    elif kind == "observe":
        fields = {"values": bytes_to_floats(reader.bytes(reader.varint()))}
    return number, kind, fields


def answer(number, kind, **fields):
    """The frame of an answer of a controller."""
    body = varint(number) + varint(ANSWERS.index(kind))
    if kind == "identity":
        # Protocol, file format, instruction set, length and checksum of the policy, provenance, slot, damaged frames.
        body += varint(PROTOCOL) + varint(0) * 4 + bytes(16) + bytes(1) + varint(0)
    elif kind == "index":
        body += varint(fields["index"]) + varint(fields.get("instructions", 0))
    elif kind == "values":
        values = floats_to_bytes(fields["values"])
        body += varint(len(values)) + values + varint(fields.get("instructions", 0))
    elif kind == "refused":
        body += varint(fields["reason"]) + varint(fields["detail"])
    return seal(body)


def read_answer(message):
    """(number, kind, fields) of a message."""
    reader = Reader(message)
    number, code = reader.varint(), reader.varint()
    kind = ANSWERS[code] if code < len(ANSWERS) else None
    fields = {}
    if kind == "identity":
        names = ("protocol", "format", "instruction_set", "policy_bytes", "policy_crc")
        fields = {name: reader.varint() for name in names}
    elif kind == "index":
        fields = {"index": reader.varint(), "instructions": reader.varint()}
    elif kind == "values":
        fields = {"values": bytes_to_floats(reader.bytes(reader.varint())), "instructions": reader.varint()}
    elif kind == "refused":
        fields = {"reason": reader.varint(), "detail": reader.varint()}
    return number, kind, fields


class Channel:
    """Messages over `unix:PATH` or `udp:HOST:PORT`, to a peer or, with listen, from one."""

    def __init__(self, place, listen=False):
        kind, _, address = place.partition(":")
        self.pending, self.peer, self.messages = b"", None, []
        # A socket without a connection learns from each datagram where to answer.
        self.listens = listen and kind == "udp"
        if kind == "unix":
            self.socket = socket.socket(socket.AF_UNIX)
            if listen:
                self.socket.bind(address)
                self.socket.listen(1)
                self.socket = self.socket.accept()[0]
            else:
                self.socket.connect(address)
        elif kind == "udp":
            host, _, port = address.rpartition(":")
            self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            if listen:
                self.socket.bind((host, int(port)))
            else:
                self.socket.connect((host, int(port)))
        else:
            raise ValueError(f"{place!r}: use unix:PATH or udp:HOST:PORT")

    def send(self, frame):
        if self.peer is None:
            self.socket.send(frame)
        else:
            self.socket.sendto(frame, self.peer)

    def receive(self, timeout=None):
        """The next good message. None when the peer has left, or after so many seconds without one."""
        self.socket.settimeout(timeout)
        while not self.messages:
            try:
                data, sender = self.socket.recvfrom(4096)
            except TimeoutError:
                return None
            if not data and self.socket.type == socket.SOCK_STREAM:
                return None
            if self.listens:
                self.peer = sender
            *whole, self.pending = (self.pending + data).split(b"\0")
            messages = (unseal(coded) for coded in whole if coded)
            self.messages += [message for message in messages if message is not None]
        return self.messages.pop(0)
