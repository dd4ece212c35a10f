/* exact MISSING FILE.tpg...
 *
 * Decides with each policy on memory of exactly the promised sizes, for a memory checker to watch: what the library reads
 * or writes beyond its arguments, and what it reads of them before it wrote it. So many elements of the observation are
 * MISSING: of 1 the checker must complain.
 */
#include "tpg_runtime.h"

#include <stdio.h>
#include <stdlib.h>

/* A block of its own, of which nothing is known but its size. */
static void *block(size_t size)
{
    void *made = malloc(size);
    if (!made) abort();
    return made;
}

static int decides(const char *path, size_t missing)
{
    FILE *file = fopen(path, "rb");
    if (!file || fseek(file, 0, SEEK_END) != 0) return 0;
    const size_t length = (size_t)ftell(file);
    rewind(file);
    unsigned char *policy = block(length);
    if (fread(policy, 1, length, file) != length) return 0;
    fclose(file);

    const size_t needed = tpg_memory_size(policy, TPG_HEADER_SIZE);
    void *memory = block(needed);
    tpg_agent *agent;
    if (tpg_init(memory, needed, policy, length, &agent) != TPG_STATUS_OK) return 0;
    const size_t inputs = tpg_observation_length(agent), outputs = tpg_outputs(agent);
    float *observation = block((inputs - missing) * sizeof *observation), *action = block(outputs * sizeof *action);
    uint16_t *index = block(sizeof *index);
    /* What the actions come to; comparing it makes the checker look at each of them. */
    float sum = 0.0f;
    int decided = 1;
    for (unsigned step = 0; step < 60; step++) {
        const uint32_t kind = step % 20 == 0 ? TPG_RESET_AGENT : TPG_RESET_EPISODE;
        if (step % 10 == 0) decided &= tpg_reset(agent, kind, step) == TPG_STATUS_OK;
        for (size_t k = 0; k < inputs - missing; k++) observation[k] = step % 3 ? (float)(step + 7 * k) / 16.0f - 2.0f : 0.0f;
        if (outputs > 0) {
            decided &= tpg_decide(agent, observation, inputs, action, outputs) == TPG_STATUS_OK;
            for (size_t k = 0; k < outputs; k++) sum += action[k];
        } else {
            decided &= tpg_decide_discrete(agent, observation, inputs, index) == TPG_STATUS_OK;
            sum += (float)*index;
        }
    }
    decided &= sum - sum == 0.0f;
    free(index);
    free(action);
    free(observation);
    free(memory);
    free(policy);
    return decided;
}

int main(int argc, char **argv)
{
    if (argc < 2) return 2;
    for (int k = 2; k < argc; k++) {
        if (decides(argv[k], strtoul(argv[1], NULL, 10))) continue;
        printf("%s: not decided\n", argv[k]);
        return 1;
    }
    printf("%d policies\n", argc - 2);
    return 0;
}
