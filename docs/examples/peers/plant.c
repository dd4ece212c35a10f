/* A plant in C: CartPole, written here, under a policy that runs elsewhere. What plant.py does.

       cc -std=gnu99 -ffp-contract=off plant.c -o plant
       tpg-controller champion.tpg --listen unix:/tmp/champion.sock &
       ./plant unix:/tmp/champion.sock episodes.txt */

#include <inttypes.h>

#include "wire.h"

#define GRAVITY 9.8
#define CART 1.0
#define POLE 0.1
#define TOTAL (POLE + CART)
#define LENGTH 0.5
#define POLE_LENGTH (POLE * LENGTH)
#define FORCE 10.0
#define PERIOD 0.02

/* Polynomials for angles below pi/4, as in FreeBSD's mathematical library: the same bits everywhere. */
static double sine(double x)
{
    const double z = x * x;
    const double r = 8.33333333332248946124e-03 + z * (-1.98412698298579493134e-04 + z * 2.75573137070700676789e-06)
                     + z * (z * z) * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10);
    return x + z * x * (-1.66666666666666324348e-01 + z * r);
}

static double cosine(double x)
{
    const double z = x * x;
    const double half = 0.5 * z, w = 1.0 - half;
    double r = z * (4.16666666666666019037e-02 + z * (-1.38888888888741095749e-03 + z * 2.48015872894767294178e-05));
    r += z * z * (z * z)
         * (-2.75573143513906633035e-07 + z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11));
    return w + ((1.0 - w - half) + z * r);
}

/* Moves the state (position, velocity, angle, angular velocity) by a period; whether the pole has fallen. */
static int step(double *state, unsigned action)
{
    const double force = action == 1 ? FORCE : -FORCE, omega = state[3];
    const double s = sine(state[2]), c = cosine(state[2]);
    const double temp = (force + POLE_LENGTH * (omega * omega) * s) / TOTAL;
    const double turn = (GRAVITY * s - c * temp) / (LENGTH * (4.0 / 3.0 - POLE * (c * c) / TOTAL));
    const double push = temp - POLE_LENGTH * turn * c / TOTAL;
    const double limit = 12.0 * 2.0 * 3.141592653589793 / 360.0;
    state[0] += PERIOD * state[1];
    state[1] += PERIOD * push;
    state[2] += PERIOD * omega;
    state[3] += PERIOD * turn;
    return state[0] > 2.4 || state[0] < -2.4 || state[2] > limit || state[2] < -limit;
}

static wire_channel channel;
static uint32_t number;

/* Sends a request until its answer comes, and reads its number and its kind. Ends the program where none comes. */
static void ask(wire_message *request, wire_message *answer, uint64_t due)
{
    int attempt;
    for (attempt = 0; attempt < 20 && channel.socket >= 0; attempt++) {
        wire_message copy = *request;
        wire_send(&channel, &copy);
        while (wire_receive(&channel, answer, 250)) {
            uint64_t answered = wire_take_number(answer), kind = wire_take_number(answer);
            if (answered == number && kind == due) {
                return;
            }
            if (answered == number) {
                fprintf(stderr, "the controller refused the request\n");
                exit(1);
            }
        }
    }
    fprintf(stderr, "the controller does not answer\n");
    exit(1);
}

static void begin(wire_message *request, unsigned kind)
{
    memset(request, 0, sizeof *request);
    wire_put_number(request, ++number);
    wire_put_number(request, kind);
}

int main(int count, char **arguments)
{
    static wire_message request, answer;
    double state[4];
    uint64_t seed;
    int episode;
    FILE *episodes = count == 3 ? fopen(arguments[2], "r") : NULL;
    if (episodes == NULL) {
        fprintf(stderr, "usage: plant unix:PATH|udp:HOST:PORT EPISODES\n");
        return 2;
    }
    wire_open(&channel, arguments[1], 0);
    begin(&request, WIRE_HELLO);
    ask(&request, &answer, WIRE_IDENTITY);
    if (wire_take_number(&answer) != WIRE_PROTOCOL) {
        fprintf(stderr, "the controller speaks another version of the protocol\n");
        return 1;
    }
    for (episode = 0; fscanf(episodes, "%" SCNu64 " %lf %lf %lf %lf", &seed, &state[0], &state[1], &state[2],
                             &state[3]) == 5; episode++) {
        int steps = 0, fallen = 0;
        begin(&request, WIRE_RESET);
        wire_put(&request, episode == 0);
        wire_put_number(&request, seed);
        ask(&request, &answer, WIRE_READY);
        while (steps < 500 && !fallen) {
            const float seen[4] = {(float)state[0], (float)state[1], (float)state[2], (float)state[3]};
            begin(&request, WIRE_OBSERVE);
            wire_put_floats(&request, seen, 4);
            ask(&request, &answer, WIRE_INDEX);
            fallen = step(state, (unsigned)wire_take_number(&answer));
            steps++;
        }
        printf("%d %.17g %.17g %.17g %.17g\n", steps, state[0], state[1], state[2], state[3]);
    }
    fclose(episodes);
    return 0;
}
