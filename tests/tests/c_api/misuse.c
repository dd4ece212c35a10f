/* Calls the library wrongly in every way that it promises to notice, and prints each call that it answers otherwise. */
#include "tpg_runtime.h"

#include <stdio.h>
#include <string.h>

static union { uint64_t alignment; unsigned char bytes[1 << 18]; } memory;
static unsigned char continuous[1 << 16], discrete[1 << 16], damaged[1 << 16];
static int wrong, made;

#define EXPECT(status, call) expect(TPG_STATUS_##status, (call), #call)

static void expect(tpg_status expected, tpg_status got, const char *call)
{
    made++;
    if (got == expected) return;
    wrong++;
    printf("%s: %s\n", call, tpg_status_message((uint32_t)got));
}

static size_t load(const char *path, unsigned char *bytes, size_t size)
{
    FILE *file = fopen(path, "rb");
    if (!file) return 0;
    const size_t length = fread(bytes, 1, size, file);
    fclose(file);
    return length;
}

int main(int argc, char **argv)
{
    if (argc != 3) return 2;
    const size_t n = load(argv[1], continuous, sizeof continuous), d = load(argv[2], discrete, sizeof discrete);
    const size_t needed = tpg_memory_size(continuous, TPG_HEADER_SIZE);
    tpg_agent *agent;
    float x[64] = { 0.0f }, y[64];
    uint16_t index;

    /* The size comes from the header alone; what is no header has none. */
    if (n == 0 || d == 0 || needed == 0 || needed > sizeof memory) return 1;
    /* A header of version 1, which this file has, takes 72 bytes. */
    if (tpg_memory_size(continuous, n) != needed || tpg_memory_size(continuous, 71) != 0) return 1;
    if (tpg_memory_size(NULL, n) != 0 || tpg_memory_size(x, sizeof x) != 0 || tpg_memory_size(continuous, SIZE_MAX) != 0) return 1;

    EXPECT(NULL_POINTER, tpg_init(NULL, needed, continuous, n, &agent));
    EXPECT(NULL_POINTER, tpg_init(memory.bytes, needed, NULL, n, &agent));
    EXPECT(NULL_POINTER, tpg_init(memory.bytes, needed, continuous, n, NULL));
    EXPECT(NULL_POINTER, tpg_init(memory.bytes, needed, continuous, SIZE_MAX, &agent));
    EXPECT(MISALIGNED, tpg_init(memory.bytes + 4, needed, continuous, n, &agent));
    EXPECT(SHORT_MEMORY, tpg_init(memory.bytes, needed - 1, continuous, n, &agent));
    EXPECT(SHORT_MEMORY, tpg_init(memory.bytes, 0, continuous, n, &agent));
    EXPECT(NOT_A_POLICY, tpg_init(memory.bytes, needed, memory.bytes + 65536, n, &agent));
    EXPECT(DAMAGED, tpg_init(memory.bytes, needed, continuous, 0, &agent));
    for (size_t length = 72; length < n; length++) EXPECT(DAMAGED, tpg_init(memory.bytes, needed, continuous, length, &agent));
    EXPECT(DAMAGED, tpg_init(memory.bytes, needed, continuous, n + 1, &agent));
    for (size_t at = 0; at < n; at++) {
        memcpy(damaged, continuous, n);
        damaged[at] ^= 0x10;
        const tpg_status status = tpg_init(memory.bytes, sizeof memory, damaged, n, &agent);
        made++;
        if (status == TPG_STATUS_OK || agent != NULL) { wrong++; printf("byte %zu is damaged: accepted\n", at); }
    }
    EXPECT(NO_AGENT, tpg_reset((tpg_agent *)memory.bytes, TPG_RESET_AGENT, 1));
    EXPECT(NULL_POINTER, tpg_reset(NULL, TPG_RESET_AGENT, 1));
    EXPECT(NULL_POINTER, tpg_decide(NULL, x, 1, y, 1));
    EXPECT(MISALIGNED, tpg_decide((tpg_agent *)(void *)(memory.bytes + 1), x, 1, y, 1));
    if (tpg_observation_length(NULL) || tpg_outputs(NULL) || tpg_control_period_us(NULL)) return 1;

    EXPECT(OK, tpg_init(memory.bytes, needed, continuous, n, &agent));
    const size_t inputs = tpg_observation_length(agent), outputs = tpg_outputs(agent);
    EXPECT(RESET_KIND, tpg_reset(agent, 2, 1));
    EXPECT(OBSERVATION_LENGTH, tpg_decide(agent, x, inputs - 1, y, outputs));
    EXPECT(OBSERVATION_LENGTH, tpg_decide(agent, x, SIZE_MAX, y, outputs));
    EXPECT(ACTION_LENGTH, tpg_decide(agent, x, inputs, y, outputs + 1));
    EXPECT(NULL_POINTER, tpg_decide(agent, NULL, inputs, y, outputs));
    EXPECT(NULL_POINTER, tpg_decide(agent, x, inputs, NULL, outputs));
    EXPECT(MISALIGNED, tpg_decide(agent, (const float *)(const void *)((const char *)x + 1), inputs, y, outputs));
    EXPECT(MISALIGNED, tpg_decide(agent, x, inputs, (float *)(void *)((char *)y + 2), outputs));
    EXPECT(CONTINUOUS_POLICY, tpg_decide_discrete(agent, x, inputs, &index));
    EXPECT(OK, tpg_decide(agent, x, inputs, y, outputs));
    /* One array for both: the observation is read before the action is written. */
    EXPECT(OK, tpg_decide(agent, x, inputs, x, outputs));
    if (memcmp(x, y, outputs * sizeof *x) != 0) { wrong++; printf("action over observation differs\n"); }

    EXPECT(OK, tpg_init(memory.bytes, sizeof memory, discrete, d, &agent));
    EXPECT(DISCRETE_POLICY, tpg_decide(agent, x, tpg_observation_length(agent), y, 1));
    EXPECT(NULL_POINTER, tpg_decide_discrete(agent, x, tpg_observation_length(agent), NULL));
    EXPECT(OK, tpg_decide_discrete(agent, x, tpg_observation_length(agent), &index));
    if (strcmp(tpg_status_message(999), "no status of this library") != 0) wrong++;

    printf("%d calls, %d wrong\n", made, wrong);
    return wrong != 0;
}
