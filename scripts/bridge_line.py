"""Lines between a plant and a controller that lose, change, delay, swap and repeat what they carry; for bridge-harness."""

import contextlib
import random
import socket
import threading


class Proxy:
    """A UDP port in front of a controller's. Each datagram, either way, suffers the fault with a small probability."""

    def __init__(self, place, fault, seed):
        host, port = place.removeprefix("udp:").rsplit(":", 1)
        self.fault, self.dice = fault, random.Random(seed)
        self.front = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.front.bind(("127.0.0.1", 0))
        self.back = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.back.connect((host, int(port)))
        self.place = f"udp:127.0.0.1:{self.front.getsockname()[1]}"
        self.plant, self.silent, self.over = None, False, False
        self.threads = [threading.Thread(target=self.carry, args=ends) for ends in [(self.front, True), (self.back, False)]]

    def __enter__(self):
        for thread in self.threads:
            thread.start()
        return self

    def __exit__(self, *_):
        self.over = True
        for thread in self.threads:
            thread.join()
        self.front.close()
        self.back.close()

    def cut(self):
        self.silent = True

    def hand_on(self, data, to_controller):
        # A peer that has left refuses.
        with contextlib.suppress(OSError):
            if to_controller:
                self.back.send(data)
            elif self.plant:
                self.front.sendto(data, self.plant)

    def carry(self, end, to_controller):
        end.settimeout(0.05)
        held = None
        while not self.over:
            try:
                data, sender = end.recvfrom(4096)
            except TimeoutError:
                data = None
            except OSError:
                continue
            if data is not None and to_controller:
                self.plant = sender
            if held is not None:
                # What was held back comes after its successor, or late if there is none.
                data, held = [data, held] if data is not None else [held], None
            for one in data if isinstance(data, list) else [data]:
                if one is not None and not self.silent:
                    held = self.suffer(one, to_controller) or held

    def suffer(self, data, to_controller):
        """Hands a datagram on in whatever way; the datagram itself if it is held back."""
        fault = self.dice.choice(["twice", "swapped", "late", "lost", "garbled", "foreign"]) if self.fault == "all" else self.fault
        # What costs the plant a repetition is rarer.
        if self.dice.random() >= (0.2 if fault in ("twice", "foreign") else 0.02):
            fault = "none"
        if fault == "swapped":
            return data
        if fault == "lost":
            return None
        if fault == "late":
            # Mostly longer than the plant waits before it asks again.
            timer = threading.Timer(self.dice.uniform(0.0, 0.6), self.hand_on, (data, to_controller))
            timer.daemon = True
            timer.start()
            return None
        if fault == "garbled":
            at = self.dice.randrange(len(data))
            data = data[:at] + bytes([data[at] ^ 1 << self.dice.randrange(8)]) + data[at + 1 :]
        if fault == "foreign":
            self.hand_on(self.dice.randbytes(self.dice.randint(1, 300)), to_controller)
        self.hand_on(data, to_controller)
        if fault == "twice":
            self.hand_on(data, to_controller)
        return None


@contextlib.contextmanager
def stream_between(line, controller, fault, seed):
    """A Unix socket at `line` in front of the controller's, whose bytes are garbled or lost, or which is closed."""
    dice = random.Random(seed)
    line.unlink(missing_ok=True)
    listener = socket.socket(socket.AF_UNIX)
    listener.bind(str(line))
    listener.listen(1)
    listener.settimeout(30)

    def bad(data):
        out = bytearray()
        for byte in data:
            strikes = dice.random() < 0.0005
            if strikes and fault == "lost":
                continue
            out.append(byte ^ 1 << dice.randrange(8) if strikes and fault == "garbled" else byte)
        return bytes(out)

    def carry(one, other, most):
        carried = 0
        with contextlib.suppress(OSError):
            while (data := one.recv(4096)) and carried < most:
                carried += len(data)
                other.sendall(bad(data))
        for end in (one, other):
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)

    def serve():
        with contextlib.suppress(OSError):
            front, _ = listener.accept()
            back = socket.socket(socket.AF_UNIX)
            back.connect(str(controller))
            most = dice.randint(100, 5000) if fault == "closed" else 2**40
            ways = [threading.Thread(target=carry, args=(*ends, most)) for ends in [(front, back), (back, front)]]
            for way in ways:
                way.start()
            for way in ways:
                way.join()
            front.close()
            back.close()

    thread = threading.Thread(target=serve)
    thread.start()
    try:
        yield
    finally:
        # It may be the plant that has not come.
        with contextlib.suppress(OSError):
            listener.shutdown(socket.SHUT_RDWR)
        thread.join()
        listener.close()
        line.unlink(missing_ok=True)
