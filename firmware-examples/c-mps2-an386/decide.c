/* Decides 600 times from C and prints the bits of every action. Ends with 0 if every call of the library succeeded, else with 1. */
#include "semihosting.h"
#include "sensors.h"
#include "tpg_runtime.h"

enum { DECISIONS = 600, EPISODE = 250, SEED = 1, CHANNELS = 64 };

extern const unsigned char champion[], champion_end[];

/* Nothing is allocated: an agent that needs more than this is refused. */
static union { uint64_t alignment; unsigned char bytes[64 * 1024]; } memory;

static int fail(tpg_status status)
{
    print("error: ");
    print(tpg_status_message((uint32_t)status));
    print("\n");
    return 1;
}

/* edit 3: drive your actuators. */
static void act(const float *action, size_t outputs)
{
    for (size_t k = 0; k < outputs; k++) {
        const union { float value; uint32_t bits; } both = {action[k]};
        print_word(both.bits);
    }
    print("\n");
}

/* edit 3, for a policy that chooses one of several actions. */
static void act_discrete(uint16_t index)
{
    print_word(index);
    print("\n");
}

int main(void)
{
    tpg_agent *agent;
    tpg_status status =
        tpg_init(memory.bytes, sizeof memory, champion, (size_t)(champion_end - champion), &agent);
    if (status == TPG_STATUS_OK) status = tpg_reset(agent, TPG_RESET_AGENT, SEED);
    if (status != TPG_STATUS_OK) return fail(status); /* On a robot: the safe action. */

    const size_t inputs = tpg_observation_length(agent), outputs = tpg_outputs(agent);
    float observation[CHANNELS], action[CHANNELS];
    if (inputs > CHANNELS || outputs > CHANNELS) return 1;
    sensors sensors = {SEED};
    for (int number = 1; number <= DECISIONS; number++) {
        sensors_observe(&sensors, observation, inputs); /* edit 2: read your sensors. */
        if (outputs > 0) {
            status = tpg_decide(agent, observation, inputs, action, outputs);
            if (status == TPG_STATUS_OK) act(action, outputs);
        } else {
            uint16_t index = 0;
            status = tpg_decide_discrete(agent, observation, inputs, &index);
            if (status == TPG_STATUS_OK) act_discrete(index);
        }
        if (status == TPG_STATUS_OK && number % EPISODE == 0)
            status = tpg_reset(agent, TPG_RESET_EPISODE, sensors_bits(&sensors));
        if (status != TPG_STATUS_OK) return fail(status);
    }
    return 0;
}
