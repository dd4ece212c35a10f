// Executes policies from C. It uses no heap and no globals, and computes the same bits on every machine.
//
// Made from runtime/c-api by cbindgen; do not edit. docs/export.md says how to build and link the library.
// Use an agent from one thread at a time. Agents in separate memory are independent.

#ifndef TPG_RUNTIME_H
#define TPG_RUNTIME_H

#include <stddef.h>
#include <stdint.h>

// Number of bytes of a policy's header. `tpg_memory_size` needs no more of the file.
#define TPG_HEADER_SIZE 96

// The address of an agent's memory must be a multiple of this number.
#define TPG_ALIGNMENT 8

// Begin an evaluation of the agent with its first episode.
#define TPG_RESET_AGENT 0

// Begin another episode of the same evaluation.
#define TPG_RESET_EPISODE 1

// The result of a call: `TPG_STATUS_OK`, or the reason why it did nothing.
typedef enum {
  // Done.
  TPG_STATUS_OK = 0,
  // A pointer is null.
  TPG_STATUS_NULL_POINTER = 1,
  // The address of the memory or of an array of floats is not a multiple of its alignment.
  TPG_STATUS_MISALIGNED = 2,
  // The memory has fewer bytes than `tpg_memory_size` says.
  TPG_STATUS_SHORT_MEMORY = 3,
  // The memory holds no agent. Call `tpg_init` first.
  TPG_STATUS_NO_AGENT = 4,
  // The bytes are not a policy.
  TPG_STATUS_NOT_A_POLICY = 5,
  // The policy was made for another version of the format.
  TPG_STATUS_VERSION = 6,
  // The policy was made for another instruction table.
  TPG_STATUS_INSTRUCTION_SET = 7,
  // The policy's bytes are damaged, or there are too few or too many.
  TPG_STATUS_DAMAGED = 8,
  // The policy's tables contradict each other.
  TPG_STATUS_INVALID = 9,
  // The policy has a part that this build does not execute.
  TPG_STATUS_UNSUPPORTED = 10,
  // The library was built for policies of another vector width.
  TPG_STATUS_WIDTH = 11,
  // The observation has the wrong length. `tpg_observation_length` says the right one.
  TPG_STATUS_OBSERVATION_LENGTH = 12,
  // The array for the action has the wrong length. `tpg_outputs` says the right one.
  TPG_STATUS_ACTION_LENGTH = 13,
  // The policy's actions are discrete. Call `tpg_decide_discrete`.
  TPG_STATUS_DISCRETE_POLICY = 14,
  // The policy's actions are continuous. Call `tpg_decide`.
  TPG_STATUS_CONTINUOUS_POLICY = 15,
  // The argument `what` is neither `TPG_RESET_AGENT` nor `TPG_RESET_EPISODE`.
  TPG_STATUS_RESET_KIND = 16,
} tpg_status;

// A policy and its state, at the start of the caller's memory.
typedef struct tpg_agent tpg_agent;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// The meaning of a status in English, as a C string. It is never null and stays valid.
const char *tpg_status_message(uint32_t status);

// Number of bytes of memory that an agent of a policy needs.
//
// Returns 0 if the bytes are not the header of a policy, or of one that this library does not execute.
//
// `header` is the first `TPG_HEADER_SIZE` bytes of the file or more. This function trusts the header. `tpg_init` checks it.
//
// # Safety
// `header` must be null or point to `header_length` readable bytes.
size_t tpg_memory_size(const void *header,
                       size_t header_length);

// Makes an agent for a policy in the caller's memory and points `agent` to it. The agent is reset with seed 0.
//
// It checks every table of the policy first and writes to the memory only if all are valid. The caller frees nothing: the
// agent ends when the caller uses the memory for something else. Until then the policy's bytes must stay in their place,
// unchanged.
//
// # Safety
// - `memory` must be null or point to `memory_length` writable bytes.
// - `policy` must be null or point to `policy_length` readable bytes that do not overlap `memory`.
// - `agent` must be null or point to a place for a pointer.
tpg_status tpg_init(void *memory,
                    size_t memory_length,
                    const void *policy,
                    size_t policy_length,
                    tpg_agent **agent);

// Begins an evaluation of an agent (`TPG_RESET_AGENT`) or another of its episodes (`TPG_RESET_EPISODE`).
//
// `agent_seed` determines the agent's random streams. It has no effect if none of them is reset.
//
// # Safety
// `agent` must be null or come from `tpg_init`.
tpg_status tpg_reset(tpg_agent *agent,
                     uint32_t what,
                     uint64_t agent_seed);

// Decides and writes one value for each output. Values are finite and within the policy's limits.
//
// An element of the observation that is not finite, such as NaN, is missing: the policy's front end fills it in. Without a
// front end, and in policies of format versions 1 and 2, it counts as 0. On any status but `TPG_STATUS_OK` nothing has changed.
//
// # Safety
// - `agent` must be null or come from `tpg_init`.
// - `observation` must be null or point to `observation_length` readable floats.
// - `action` must be null or point to `action_length` writable floats.
tpg_status tpg_decide(tpg_agent *agent,
                      const float *observation,
                      size_t observation_length,
                      float *action,
                      size_t action_length);

// Decides and writes the index of the chosen action.
//
// It is the counterpart of `tpg_decide` for policies whose actions are discrete.
//
// # Safety
// - `agent` must be null or come from `tpg_init`.
// - `observation` must be null or point to `observation_length` readable floats.
// - `action` must be null or point to a place for the number of the action.
tpg_status tpg_decide_discrete(tpg_agent *agent,
                               const float *observation,
                               size_t observation_length,
                               uint16_t *action);

// Number of elements of the policy's observation, 0 if there is no agent.
//
// # Safety
// `agent` must be null or come from `tpg_init`.
size_t tpg_observation_length(tpg_agent *agent);

// Number of the policy's outputs, 0 if its actions are discrete or there is no agent.
//
// # Safety
// `agent` must be null or come from `tpg_init`.
size_t tpg_outputs(tpg_agent *agent);

// Time between two decisions in microseconds, 0 if there is no agent.
//
// # Safety
// `agent` must be null or come from `tpg_init`.
uint32_t tpg_control_period_us(tpg_agent *agent);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* TPG_RUNTIME_H */
