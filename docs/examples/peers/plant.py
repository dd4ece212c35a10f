"""A plant of your own: CartPole, written here, under a policy that runs elsewhere.

    tpg-controller champion.tpg --listen udp:127.0.0.1:7000 &
    python3 plant.py udp:127.0.0.1:7000 episodes.txt

Each line of episodes.txt is one episode: the seed of the agent's random numbers, then position, velocity, angle and
angular velocity at the start. For each episode the plant prints its number of steps, which is its return, and its last
state.
"""

import sys

import wire

GRAVITY, CART, POLE, LENGTH, FORCE, PERIOD = 9.8, 1.0, 0.1, 0.5, 10.0, 0.02
TOTAL, POLE_LENGTH = POLE + CART, POLE * LENGTH
# Polynomials of sine and cosine for angles below pi/4, as in FreeBSD's mathematical library: the same bits everywhere.
SINE = (-1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04,
        2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10)
COSINE = (4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05,
          -2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11)


def sine(x):
    z = x * x
    r = SINE[1] + z * (SINE[2] + z * SINE[3]) + z * (z * z) * (SINE[4] + z * SINE[5])
    return x + z * x * (SINE[0] + z * r)


def cosine(x):
    z = x * x
    r = z * (COSINE[0] + z * (COSINE[1] + z * COSINE[2]))
    r += z * z * (z * z) * (COSINE[3] + z * (COSINE[4] + z * COSINE[5]))
    half = 0.5 * z
    w = 1.0 - half
    return w + ((1.0 - w - half) + z * r)


def step(state, action):
    """The state after a period of pushing to the left (0) or to the right (1), and whether the pole has fallen."""
    x, v, angle, omega = state
    force = FORCE if action == 1 else -FORCE
    sin, cos = sine(angle), cosine(angle)
    temp = (force + POLE_LENGTH * (omega * omega) * sin) / TOTAL
    turn = (GRAVITY * sin - cos * temp) / (LENGTH * (4.0 / 3.0 - POLE * (cos * cos) / TOTAL))
    push = temp - POLE_LENGTH * turn * cos / TOTAL
    state = (x + PERIOD * v, v + PERIOD * push, angle + PERIOD * omega, omega + PERIOD * turn)
    return state, abs(state[0]) > 2.4 or abs(state[2]) > 12.0 * 2.0 * 3.141592653589793 / 360.0


class Controller:
    """The policy at the other end. A request without an answer is sent again after a quarter of a second."""

    def __init__(self, place):
        self.channel, self.number = wire.Channel(place), 0

    def ask(self, kind, **fields):
        self.number += 1
        frame = wire.request(self.number, kind, **fields)
        for _ in range(20):
            self.channel.send(frame)
            while (message := self.channel.receive(timeout=0.25)) is not None:
                number, kind, answer = wire.read_answer(message)
                if kind == "refused":
                    raise SystemExit(f"the controller refused the request: reason {answer['reason']}")
                if number == self.number:
                    return answer
        raise SystemExit("the controller does not answer")


def main():
    controller = Controller(sys.argv[1])
    if controller.ask("hello")["protocol"] != wire.PROTOCOL:
        raise SystemExit("the controller speaks another version of the protocol")
    for episode, line in enumerate(open(sys.argv[2], encoding="ascii")):
        seed, *state = line.split()
        state = tuple(float(number) for number in state)
        controller.ask("reset", agent=episode == 0, seed=int(seed))
        steps, fallen = 0, False
        while steps < 500 and not fallen:
            action = controller.ask("observe", values=state)["index"]
            state, fallen = step(state, action)
            steps += 1
        print(steps, *map(repr, state))


if __name__ == "__main__":
    main()
