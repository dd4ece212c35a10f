/* A controller in C: a policy that `tpg export` has turned into C, behind the open protocol.

       tpg export champion.tpg --c champion.c
       cc -std=gnu99 -ffp-contract=off -I. controller.c champion.c -o controller
       ./controller udp:127.0.0.1:7000 &
       tpg hil champion.tpg --controller udp:127.0.0.1:7000 --any-controller

   Another policy needs other names below, and a discrete one the answer WIRE_INDEX. */

#include "champion.h"
#include "wire.h"

int main(int count, char **arguments)
{
    static champion policy;
    static wire_channel channel;
    static wire_message request, answer, repeat;
    uint32_t first = 0, last = 0;
    int greeted = 0;
    if (count != 2) {
        fprintf(stderr, "usage: controller unix:PATH|udp:HOST:PORT\n");
        return 2;
    }
    champion_init(&policy);
    wire_open(&channel, arguments[1], 1);
    while (channel.socket >= 0) {
        float observation[CHAMPION_INPUTS], action[CHAMPION_OUTPUTS];
        uint32_t number;
        uint64_t kind;
        if (!wire_receive(&channel, &request, -1)) {
            continue;
        }
        number = (uint32_t)wire_take_number(&request);
        kind = wire_take_number(&request);
        if (kind == WIRE_HELLO || !greeted) {
            first = number;
        } else if (last - number <= last - first) {
            /* The answer got lost if it is the last request again; an older one of this conversation is late. */
            if (number == last) {
                wire_message again = repeat;
                wire_send(&channel, &again);
            }
            continue;
        }
        memset(&answer, 0, sizeof answer);
        wire_put_number(&answer, number);
        if (kind == WIRE_HELLO) {
            int k;
            wire_put_number(&answer, WIRE_IDENTITY);
            wire_put_number(&answer, WIRE_PROTOCOL);
            /* File format, instruction set, length and checksum of the policy, provenance, slot, damaged frames. */
            for (k = 0; k < 4 + 16 + 1 + 1; k++) {
                wire_put(&answer, 0);
            }
        } else if (kind == WIRE_RESET) {
            int begins = wire_take(&request);
            champion_reset(&policy, begins ? CHAMPION_AGENT : CHAMPION_EPISODE, wire_take_number(&request));
            wire_put_number(&answer, WIRE_READY);
        } else if (kind == WIRE_OBSERVE
                   && wire_take_floats(&request, observation, CHAMPION_INPUTS) == CHAMPION_INPUTS && !request.bad) {
            champion_decide(&policy, observation, action);
            wire_put_number(&answer, WIRE_VALUES);
            wire_put_floats(&answer, action, CHAMPION_OUTPUTS);
            wire_put_number(&answer, policy.instructions);
        } else {
            /* Reason 0: the observation has another length; 1: there are no slots for policies. */
            wire_put_number(&answer, WIRE_REFUSED);
            wire_put_number(&answer, kind == WIRE_OBSERVE ? 0 : 1);
            wire_put_number(&answer, 0);
        }
        greeted = 1;
        last = number;
        repeat = answer;
        wire_send(&channel, &answer);
    }
    return 0;
}
