"""A controller that is no policy: pushes the cart to where the pole leans.

    python3 controller.py unix:/tmp/rule.sock &
    tpg hil champion.tpg --controller serial:/tmp/rule.sock --any-controller

For UDP: `controller.py udp:127.0.0.1:7000` and `--controller udp:127.0.0.1:7000`.
"""

import sys

import wire


def decide(observation):
    """0 pushes to the left, 1 to the right."""
    position, velocity, angle, angular_velocity = observation
    return 1 if angle > 0 else 0


def main():
    channel = wire.Channel(sys.argv[1], listen=True)
    first, last, last_frame = None, None, b""
    while (message := channel.receive()) is not None:
        number, kind, fields = wire.read_request(message)
        if kind == "hello" or first is None:
            first = number
        elif (last - number) % 2**32 <= (last - first) % 2**32:
            # The answer got lost if it is the last request again; an older one of this conversation is late.
            if number == last:
                channel.send(last_frame)
            continue
        if kind == "hello":
            frame = wire.answer(number, "identity")
        elif kind == "reset":
            frame = wire.answer(number, "ready")
        elif kind == "observe" and len(fields["values"]) == 4:
            frame = wire.answer(number, "index", index=decide(fields["values"]))
        else:
            # Reason 0: the observation has another length; 1: there are no slots for policies.
            values = fields.get("values")
            frame = wire.answer(number, "refused", reason=int(values is None), detail=len(values or ()))
        last, last_frame = number, frame
        channel.send(frame)


if __name__ == "__main__":
    main()
