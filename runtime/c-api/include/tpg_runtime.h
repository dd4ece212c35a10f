// Policies on microcontrollers and elsewhere, from C: no heap, no globals, the same bits as everywhere.
//
// Made from runtime/c-api by cbindgen; do not edit. docs/export.md says how to build and link the library.
// One agent belongs to one thread at a time; agents in separate memory are independent.

#ifndef TPG_RUNTIME_H
#define TPG_RUNTIME_H

#include <stddef.h>
#include <stdint.h>

// Bytes of a policy's header: what `tpg_memory_size` needs of it.
#define TPG_HEADER_SIZE 72

// What the address of an agent's memory must be a multiple of.
#define TPG_ALIGNMENT 8

// The agent starts: its first episode of an evaluation.
#define TPG_RESET_AGENT 0

// A further episode of the same agent.
#define TPG_RESET_EPISODE 1

// What a call returns: `TPG_STATUS_OK`, or why it did nothing.
typedef enum {
  // Done.
  TPG_STATUS_OK = 0,
  // A pointer is null.
  TPG_STATUS_NULL_POINTER = 1,
  // Memory or an array of floats does not begin at a multiple of its alignment.
  TPG_STATUS_MISALIGNED = 2,
  // The memory is shorter than `tpg_memory_size` says.
  TPG_STATUS_SHORT_MEMORY = 3,
  // The memory holds no agent: `tpg_init` has not succeeded on it.
  TPG_STATUS_NO_AGENT = 4,
  // The bytes are no policy.
  TPG_STATUS_NOT_A_POLICY = 5,
  // The policy was made for another version of the format.
  TPG_STATUS_VERSION = 6,
  // The policy was made for another instruction table.
  TPG_STATUS_INSTRUCTION_SET = 7,
  // The policy's bytes are damaged, too few or too many.
  TPG_STATUS_DAMAGED = 8,
  // The policy's tables contradict each other.
  TPG_STATUS_INVALID = 9,
  // The policy has a part that this version does not execute.
  TPG_STATUS_UNSUPPORTED = 10,
  // The library was built for policies of another vector width.
  TPG_STATUS_WIDTH = 11,
  // The observation has another length than the policy's.
  TPG_STATUS_OBSERVATION_LENGTH = 12,
  // The array for the action has another length than the policy's outputs.
  TPG_STATUS_ACTION_LENGTH = 13,
  // The policy's actions are discrete: call `tpg_decide_discrete`.
  TPG_STATUS_DISCRETE_POLICY = 14,
  // The policy's actions are continuous: call `tpg_decide`.
  TPG_STATUS_CONTINUOUS_POLICY = 15,
  // What is reset is neither `TPG_RESET_AGENT` nor `TPG_RESET_EPISODE`.
  TPG_STATUS_RESET_KIND = 16,
} tpg_status;

// A policy with its state, at the start of the caller's memory.
typedef struct tpg_agent tpg_agent;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// The meaning of a status in English, ended by a zero; never null, and valid for ever.
const char *tpg_status_message(uint32_t status);

// Bytes of memory that an agent of a policy needs; 0 if these bytes are no header of a policy for this library.
//
// The fixed header alone is read: `TPG_HEADER_SIZE` bytes, the first of the file. What it promises, `tpg_init` checks.
//
// # Safety
// `header` must be null or point to `header_length` readable bytes.
size_t tpg_memory_size(const void *header,
                       size_t header_length);

// Makes an agent for a policy in the caller's memory, reset with agent seed 0, and points `agent` to it.
//
// Every table of the policy is checked first; memory is written only if it passes. The memory belongs to the agent until the
// caller uses it for something else; nothing has to be freed. The policy's bytes must stay where they are, unchanged.
//
// # Safety
// `memory` must be null or point to `memory_length` writable bytes, `policy` null or to `policy_length` readable ones that do
// not overlap it, and `agent` null or to a place for a pointer.
tpg_status tpg_init(void *memory,
                    size_t memory_length,
                    const void *policy,
                    size_t policy_length,
                    tpg_agent **agent);

// Begins an agent's evaluation (`TPG_RESET_AGENT`) or a further episode of it (`TPG_RESET_EPISODE`).
//
// `agent_seed` determines the random streams; where nothing is reset it is not used.
//
// # Safety
// `agent` must be null or come from `tpg_init`.
tpg_status tpg_reset(tpg_agent *agent,
                     uint32_t what,
                     uint64_t agent_seed);

// Decides and writes one value for each output, within the policy's limits.
//
// Non-finite elements of the observation count as 0. If the status is not `TPG_STATUS_OK`, nothing has changed.
//
// # Safety
// `agent` must be null or come from `tpg_init`; `observation` must be null or point to as many readable floats as
// `observation_length` says, `action` null or to as many writable ones as `action_length` says.
tpg_status tpg_decide(tpg_agent *agent,
                      const float *observation,
                      size_t observation_length,
                      float *action,
                      size_t action_length);

// Decides and writes the index of the chosen action.
//
// As `tpg_decide`, for policies whose actions are discrete.
//
// # Safety
// `agent` must be null or come from `tpg_init`; `observation` must be null or point to as many readable floats as
// `observation_length` says, `action` null or to a place for its number.
tpg_status tpg_decide_discrete(tpg_agent *agent,
                               const float *observation,
                               size_t observation_length,
                               uint16_t *action);

// Length of the policy's observation; 0 if there is no agent.
//
// # Safety
// `agent` must be null or come from `tpg_init`.
size_t tpg_observation_length(tpg_agent *agent);

// Number of the policy's outputs; 0 if its actions are discrete or there is no agent.
//
// # Safety
// `agent` must be null or come from `tpg_init`.
size_t tpg_outputs(tpg_agent *agent);

// Time between two decisions, in microseconds; 0 if there is no agent.
//
// # Safety
// `agent` must be null or come from `tpg_init`.
uint32_t tpg_control_period_us(tpg_agent *agent);

// x to the power y; 0 where it is not finite.
float tpg_math_pow(float x, float y);

// Square root; 0 for negative numbers.
float tpg_math_sqrt(float x);

// Sine of an angle in radians.
float tpg_math_sin(float x);

// Cosine of an angle in radians.
float tpg_math_cos(float x);

// Tangent of an angle in radians, as sine over cosine.
float tpg_math_tan(float x);

// Arc sine in radians; 0 outside [-1, 1].
float tpg_math_asin(float x);

// Arc cosine in radians; 0 outside [-1, 1].
float tpg_math_acos(float x);

// Arc tangent in radians.
float tpg_math_atan(float x);

// Hyperbolic tangent.
float tpg_math_tanh(float x);

// Exponential; 0 where it overflows.
float tpg_math_exp(float x);

// Natural logarithm; 0 where it is undefined.
float tpg_math_log(float x);

// Cosine of the classic set.
float tpg_math_classic_cos(float x);

// Logarithm of the classic set: log y for y > 0, else x.
float tpg_math_classic_log(float x, float y);

// Exponential of the classic set: the largest number where it overflows.
float tpg_math_classic_exp(float x);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* TPG_RUNTIME_H */
