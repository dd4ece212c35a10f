/* decide FILE.tpg [SEED] < observations
 *
 * Runs a policy from C. It reads observations from standard input, one a line, and prints the bits of each action.
 * A line `reset SEED` begins another episode. On a microcontroller the policy lies in flash and `memory` is a static array.
 */
#include "tpg_runtime.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MEMORY = 1 << 20, POLICY = 1 << 22, LINE = 1 << 16, CHANNELS = 256 };

/* The library allocates nothing. The caller may give it any memory. */
static union { uint64_t alignment; unsigned char bytes[MEMORY]; } memory;
static unsigned char policy[POLICY];
static char line[LINE];

static int fail(tpg_status status)
{
    fprintf(stderr, "decide: %s\n", tpg_status_message((uint32_t)status));
    return 1;
}

static void print(float x)
{
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    printf(" %08x", (unsigned)bits);
}

int main(int argc, char **argv)
{
    FILE *file = argc > 1 ? fopen(argv[1], "rb") : NULL;
    if (!file) {
        fprintf(stderr, "usage: decide FILE.tpg [SEED] < observations\n");
        return 2;
    }
    const size_t length = fread(policy, 1, sizeof policy, file);
    fclose(file);

    const size_t needed = tpg_memory_size(policy, length < TPG_HEADER_SIZE ? length : TPG_HEADER_SIZE);
    if (needed > sizeof memory) {
        fprintf(stderr, "decide: the policy needs %zu bytes of memory\n", needed);
        return 1;
    }
    tpg_agent *agent;
    tpg_status status = tpg_init(memory.bytes, sizeof memory, policy, length, &agent);
    if (status != TPG_STATUS_OK) return fail(status);
    status = tpg_reset(agent, TPG_RESET_AGENT, argc > 2 ? strtoull(argv[2], NULL, 16) : 0);
    if (status != TPG_STATUS_OK) return fail(status);

    const size_t inputs = tpg_observation_length(agent), outputs = tpg_outputs(agent);
    float observation[CHANNELS], action[CHANNELS];
    if (inputs > CHANNELS || outputs > CHANNELS) return 1;
    while (fgets(line, sizeof line, stdin)) {
        if (strncmp(line, "reset ", 6) == 0) {
            status = tpg_reset(agent, TPG_RESET_EPISODE, strtoull(line + 6, NULL, 16));
            if (status != TPG_STATUS_OK) return fail(status);
            continue;
        }
        char *at = line;
        for (size_t k = 0; k < inputs; k++) {
            const uint32_t bits = (uint32_t)strtoul(at, &at, 16);
            memcpy(&observation[k], &bits, sizeof bits);
        }
        if (outputs > 0) {
            status = tpg_decide(agent, observation, inputs, action, outputs);
            for (size_t k = 0; k < outputs; k++) print(action[k]);
        } else {
            uint16_t index = 0;
            status = tpg_decide_discrete(agent, observation, inputs, &index);
            printf(" %08x", (unsigned)index);
        }
        if (status != TPG_STATUS_OK) return fail(status);
        printf("\n");
    }
    return 0;
}
