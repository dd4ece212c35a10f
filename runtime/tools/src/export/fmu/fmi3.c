/* The interface of FMI 3.0 for co-simulation, as the standard defines it, around the policy above.
 *
 * fmi3DoStep decides with the inputs that were set before it, once for each control period of the step. Its action is
 * the output from then on. All values are scalars. Instances share nothing. */

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* For static linking, the standard gives all names a prefix. */
#if defined(FMI3_FUNCTION_PREFIX)
#define JOIN(prefix, name) prefix##name
#define PREFIXED(prefix, name) JOIN(prefix, name)
#define FMI(name) PREFIXED(FMI3_FUNCTION_PREFIX, fmi3##name)
#define EXPORT
#else
#define FMI(name) fmi3##name
#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#elif defined(__GNUC__)
#define EXPORT __attribute__((visibility("default")))
#else
#define EXPORT
#endif
#endif

/* The standard's statuses that this unit returns. */
enum { STATUS_OK = 0, STATUS_ERROR = 3 };

typedef enum { INSTANTIATED, INITIALIZING, STEPPING, TERMINATED } mode;

/* Value references: time, inputs, outputs, seed. */
typedef uint32_t reference;
#define TIME 0u
#define FIRST_INPUT 1u
#define FIRST_OUTPUT (FIRST_INPUT + (reference)INPUTS)
#define SEED (FIRST_OUTPUT + (reference)OUTPUTS)

typedef void (*log_function)(void *environment, int status, const char *category, const char *message);

/* What a saved state holds. */
typedef struct {
    policy_state policy;
    float inputs[INPUTS];
    output outputs[OUTPUTS];
    double time;
    uint64_t seed;
    mode mode;
} snapshot;

typedef struct {
    snapshot now;
    log_function log;
    void *environment;
} instance;

static int fail(const instance *self, const char *message)
{
    if (self != NULL && self->log != NULL) self->log(self->environment, STATUS_ERROR, "logStatusError", message);
    return STATUS_ERROR;
}

static void begin(instance *self)
{
    memset(&self->now, 0, sizeof self->now);
    policy_init(&self->now.policy);
    for (int k = 0; k < INPUTS; k++) self->now.inputs[k] = first_inputs[k];
    for (int k = 0; k < OUTPUTS; k++) self->now.outputs[k] = first_outputs[k];
    self->now.mode = INSTANTIATED;
}

EXPORT const char *FMI(GetVersion)(void) { return "3.0"; }

EXPORT int FMI(SetDebugLogging)(void *self, bool on, size_t count, const char *const categories[])
{
    (void)self, (void)on, (void)count, (void)categories;
    return STATUS_OK;
}

/* Instances */

EXPORT void *FMI(InstantiateCoSimulation)(const char *name, const char *token, const char *resources, bool visible, bool logging,
    bool event_mode, bool early_return, const reference intermediate[], size_t count, void *environment, log_function log,
    void (*update)(void))
{
    (void)name, (void)resources, (void)visible, (void)logging, (void)early_return, (void)intermediate, (void)count, (void)update;
    const char *fault = NULL;
    if (token == NULL || strcmp(token, INSTANTIATION_TOKEN) != 0) {
        fault = "the instantiation token is that of another model description";
    } else if (event_mode) {
        fault = "this unit has no event mode: its model description says so";
    }
    instance *self = fault == NULL ? (instance *)malloc(sizeof *self) : NULL;
    if (self == NULL) {
        if (log != NULL) log(environment, STATUS_ERROR, "logStatusError", fault != NULL ? fault : "out of memory");
        return NULL;
    }
    self->log = log;
    self->environment = environment;
    begin(self);
    return self;
}

EXPORT void *FMI(InstantiateModelExchange)(const char *name, const char *token, const char *resources, bool visible, bool logging,
    void *environment, log_function log)
{
    (void)name, (void)token, (void)resources, (void)visible, (void)logging;
    if (log != NULL) log(environment, STATUS_ERROR, "logStatusError", "this unit is for co-simulation only");
    return NULL;
}

EXPORT void *FMI(InstantiateScheduledExecution)(const char *name, const char *token, const char *resources, bool visible,
    bool logging, void *environment, log_function log, void (*update)(void), void (*lock)(void), void (*unlock)(void))
{
    (void)name, (void)token, (void)resources, (void)visible, (void)logging, (void)update, (void)lock, (void)unlock;
    if (log != NULL) log(environment, STATUS_ERROR, "logStatusError", "this unit is for co-simulation only");
    return NULL;
}

EXPORT void FMI(FreeInstance)(void *self) { free(self); }

/* Modes */

static int change(void *target, mode from, mode to)
{
    instance *self = (instance *)target;
    if (self == NULL || self->now.mode != from) return fail(self, "a function is called in a mode that does not allow it");
    self->now.mode = to;
    return STATUS_OK;
}

EXPORT int FMI(EnterInitializationMode)(void *target, bool has_tolerance, double tolerance, double start, bool has_stop, double stop)
{
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop;
    const int result = change(target, INSTANTIATED, INITIALIZING);
    if (result == STATUS_OK) ((instance *)target)->now.time = start;
    return result;
}

EXPORT int FMI(ExitInitializationMode)(void *target)
{
    const int result = change(target, INITIALIZING, STEPPING);
    instance *self = (instance *)target;
    if (result == STATUS_OK) policy_reset(&self->now.policy, POLICY_AGENT, self->now.seed);
    return result;
}

EXPORT int FMI(Terminate)(void *target) { return change(target, STEPPING, TERMINATED); }

EXPORT int FMI(Reset)(void *target)
{
    if (target == NULL) return STATUS_ERROR;
    begin((instance *)target);
    return STATUS_OK;
}

/* Values */

EXPORT int FMI(SetFloat32)(void *target, const reference which[], size_t count, const float values[], size_t length)
{
    instance *self = (instance *)target;
    if (self == NULL || length != count) return fail(self, "as many values as references are expected");
    for (size_t k = 0; k < count; k++) {
        if (which[k] < FIRST_INPUT || which[k] >= FIRST_OUTPUT) return fail(self, "a reference is not that of an input");
        self->now.inputs[which[k] - FIRST_INPUT] = values[k];
    }
    return STATUS_OK;
}

EXPORT int FMI(GetFloat32)(void *target, const reference which[], size_t count, float values[], size_t length)
{
    const instance *self = (const instance *)target;
    if (self == NULL || length != count) return fail(self, "as many values as references are expected");
    for (size_t k = 0; k < count; k++) {
        if (which[k] >= FIRST_INPUT && which[k] < FIRST_OUTPUT) {
            values[k] = self->now.inputs[which[k] - FIRST_INPUT];
#if CONTINUOUS
        } else if (which[k] >= FIRST_OUTPUT && which[k] < SEED) {
            values[k] = self->now.outputs[which[k] - FIRST_OUTPUT];
#endif
        } else {
            return fail(self, "a reference is not that of a Float32");
        }
    }
    return STATUS_OK;
}

EXPORT int FMI(GetInt32)(void *target, const reference which[], size_t count, int32_t values[], size_t length)
{
    const instance *self = (const instance *)target;
    if (self == NULL || length != count) return fail(self, "as many values as references are expected");
    for (size_t k = 0; k < count; k++) {
        if (CONTINUOUS || which[k] != FIRST_OUTPUT) return fail(self, "a reference is not that of an Int32");
        values[k] = (int32_t)self->now.outputs[0];
    }
    return STATUS_OK;
}

EXPORT int FMI(GetFloat64)(void *target, const reference which[], size_t count, double values[], size_t length)
{
    const instance *self = (const instance *)target;
    if (self == NULL || length != count) return fail(self, "as many values as references are expected");
    for (size_t k = 0; k < count; k++) {
        if (which[k] != TIME) return fail(self, "a reference is not that of a Float64");
        values[k] = self->now.time;
    }
    return STATUS_OK;
}

EXPORT int FMI(SetUInt64)(void *target, const reference which[], size_t count, const uint64_t values[], size_t length)
{
    instance *self = (instance *)target;
    if (self == NULL || length != count) return fail(self, "as many values as references are expected");
    for (size_t k = 0; k < count; k++) {
        if (which[k] != SEED) return fail(self, "a reference is not that of the seed");
        if (self->now.mode > INITIALIZING) return fail(self, "the seed is set before the simulation begins");
        self->now.seed = values[k];
    }
    return STATUS_OK;
}

EXPORT int FMI(GetUInt64)(void *target, const reference which[], size_t count, uint64_t values[], size_t length)
{
    const instance *self = (const instance *)target;
    if (self == NULL || length != count) return fail(self, "as many values as references are expected");
    for (size_t k = 0; k < count; k++) {
        if (which[k] != SEED) return fail(self, "a reference is not that of a UInt64");
        values[k] = self->now.seed;
    }
    return STATUS_OK;
}

/* Steps */

/* The number of decisions in a step; 0 if it is no whole number of control periods. */
static uint32_t decisions(double step)
{
    if (CONTROL_PERIOD_S <= 0.0) return 1;
    const double count = floor(step / CONTROL_PERIOD_S + 0.5);
    const bool whole = count >= 1.0 && count < 4294967296.0 && fabs(step - count * CONTROL_PERIOD_S) <= 1e-6 * CONTROL_PERIOD_S * count;
    return whole ? (uint32_t)count : 0;
}

EXPORT int FMI(DoStep)(void *target, double time, double step, bool no_earlier_state, bool *needs_event, bool *terminate,
    bool *early_return, double *last_time)
{
    (void)no_earlier_state;
    instance *self = (instance *)target;
    if (self == NULL || self->now.mode != STEPPING) return fail(self, "a step is made after initialization and before termination");
    const uint32_t count = decisions(step);
    if (count == 0) return fail(self, "a communication step is a whole number of control periods: see fixedInternalStepSize");
    for (uint32_t k = 0; k < count; k++) decide(&self->now.policy, self->now.inputs, self->now.outputs);
    self->now.time = time + step;
    *needs_event = false;
    *terminate = false;
    *early_return = false;
    *last_time = self->now.time;
    return STATUS_OK;
}

/* States */

EXPORT int FMI(GetFMUState)(void *target, void **state)
{
    const instance *self = (const instance *)target;
    if (self == NULL || state == NULL) return fail(self, "a state needs a place");
    if (*state == NULL) *state = malloc(sizeof(snapshot));
    if (*state == NULL) return fail(self, "out of memory");
    memcpy(*state, &self->now, sizeof(snapshot));
    return STATUS_OK;
}

EXPORT int FMI(SetFMUState)(void *target, void *state)
{
    instance *self = (instance *)target;
    if (self == NULL || state == NULL) return fail(self, "there is no state");
    memcpy(&self->now, state, sizeof(snapshot));
    return STATUS_OK;
}

EXPORT int FMI(FreeFMUState)(void *target, void **state)
{
    (void)target;
    if (state != NULL) {
        free(*state);
        *state = NULL;
    }
    return STATUS_OK;
}

EXPORT int FMI(SerializedFMUStateSize)(void *target, void *state, size_t *size)
{
    (void)target, (void)state;
    *size = sizeof(snapshot);
    return STATUS_OK;
}

EXPORT int FMI(SerializeFMUState)(void *target, void *state, uint8_t bytes[], size_t size)
{
    if (state == NULL || size != sizeof(snapshot)) return fail((const instance *)target, "a serialized state has another size");
    memcpy(bytes, state, sizeof(snapshot));
    return STATUS_OK;
}

EXPORT int FMI(DeserializeFMUState)(void *target, const uint8_t bytes[], size_t size, void **state)
{
    const instance *self = (const instance *)target;
    if (state == NULL || size != sizeof(snapshot)) return fail(self, "a serialized state has another size");
    if (*state == NULL) *state = malloc(sizeof(snapshot));
    if (*state == NULL) return fail(self, "out of memory");
    memcpy(*state, bytes, sizeof(snapshot));
    return STATUS_OK;
}

/* What this unit does not have. Nothing of it is in its model description, so no importer should call it. */

static int absent(const void *self) { return fail((const instance *)self, "this unit does not have what a function is for"); }

#define NO_VALUES(type, c_type) \
    EXPORT int FMI(Get##type)(void *self, const reference which[], size_t count, c_type values[], size_t length) \
    { \
        (void)which, (void)values; \
        return count == 0 && length == 0 ? STATUS_OK : absent(self); \
    } \
    NO_INPUTS(type, c_type)

#define NO_INPUTS(type, c_type) \
    EXPORT int FMI(Set##type)(void *self, const reference which[], size_t count, const c_type values[], size_t length) \
    { \
        (void)which, (void)values; \
        return count == 0 && length == 0 ? STATUS_OK : absent(self); \
    } \
    struct needs_a_semicolon

typedef const char *string;
NO_INPUTS(Float64, double);
NO_INPUTS(Int32, int32_t);
NO_VALUES(Int8, int8_t);
NO_VALUES(UInt8, uint8_t);
NO_VALUES(Int16, int16_t);
NO_VALUES(UInt16, uint16_t);
NO_VALUES(UInt32, uint32_t);
NO_VALUES(Int64, int64_t);
NO_VALUES(Boolean, bool);
NO_VALUES(String, string);

#define NO_CALL(name) \
    EXPORT int FMI(name)(void *self) { return absent(self); } \
    struct needs_a_semicolon

NO_CALL(EnterEventMode);
NO_CALL(EnterStepMode);
NO_CALL(EnterConfigurationMode);
NO_CALL(ExitConfigurationMode);
NO_CALL(EvaluateDiscreteStates);

#define NO_BINARY(name, sizes_type, values_type) \
    EXPORT int FMI(name)(void *self, const reference which[], size_t count, sizes_type sizes[], values_type values[], size_t length) \
    { \
        (void)which, (void)sizes, (void)values; \
        return count == 0 && length == 0 ? STATUS_OK : absent(self); \
    } \
    struct needs_a_semicolon

typedef const uint8_t *binary;
NO_BINARY(GetBinary, size_t, binary);
NO_BINARY(SetBinary, const size_t, const binary);

#define NO_CLOCK(name, type) \
    EXPORT int FMI(name)(void *self, const reference which[], size_t count, type values[]) \
    { \
        (void)which, (void)values; \
        return count == 0 ? STATUS_OK : absent(self); \
    } \
    struct needs_a_semicolon

NO_CLOCK(GetClock, bool);
NO_CLOCK(SetClock, const bool);
NO_CLOCK(GetShiftDecimal, double);
NO_CLOCK(SetShiftDecimal, const double);
NO_CLOCK(SetIntervalDecimal, const double);

#define NO_FRACTION(name, type) \
    EXPORT int FMI(name)(void *self, const reference which[], size_t count, type counters[], type resolutions[]) \
    { \
        (void)which, (void)counters, (void)resolutions; \
        return count == 0 ? STATUS_OK : absent(self); \
    } \
    struct needs_a_semicolon

NO_FRACTION(GetShiftFraction, uint64_t);
NO_FRACTION(SetShiftFraction, const uint64_t);
NO_FRACTION(SetIntervalFraction, const uint64_t);

EXPORT int FMI(GetIntervalDecimal)(void *self, const reference which[], size_t count, double intervals[], int qualifiers[])
{
    (void)which, (void)intervals, (void)qualifiers;
    return count == 0 ? STATUS_OK : absent(self);
}

EXPORT int FMI(GetIntervalFraction)(void *self, const reference which[], size_t count, uint64_t counters[], uint64_t resolutions[],
    int qualifiers[])
{
    (void)which, (void)counters, (void)resolutions, (void)qualifiers;
    return count == 0 ? STATUS_OK : absent(self);
}

EXPORT int FMI(UpdateDiscreteStates)(void *self, bool *again, bool *terminate, bool *nominals, bool *values, bool *has_time, double *time)
{
    (void)again, (void)terminate, (void)nominals, (void)values, (void)has_time, (void)time;
    return absent(self);
}

EXPORT int FMI(GetNumberOfVariableDependencies)(void *self, reference which, size_t *count)
{
    (void)which, (void)count;
    return absent(self);
}

EXPORT int FMI(GetVariableDependencies)(void *self, reference dependent, size_t elements[], reference independents[],
    size_t independent_elements[], int kinds[], size_t count)
{
    (void)dependent, (void)elements, (void)independents, (void)independent_elements, (void)kinds, (void)count;
    return absent(self);
}

#define NO_DERIVATIVE(name) \
    EXPORT int FMI(name)(void *self, const reference unknowns[], size_t unknown_count, const reference knowns[], size_t known_count, \
        const double seed[], size_t seed_length, double sensitivity[], size_t sensitivity_length) \
    { \
        (void)unknowns, (void)unknown_count, (void)knowns, (void)known_count; \
        (void)seed, (void)seed_length, (void)sensitivity, (void)sensitivity_length; \
        return absent(self); \
    } \
    struct needs_a_semicolon

NO_DERIVATIVE(GetDirectionalDerivative);
NO_DERIVATIVE(GetAdjointDerivative);

EXPORT int FMI(GetOutputDerivatives)(void *self, const reference which[], size_t count, const int32_t orders[], double values[],
    size_t length)
{
    (void)which, (void)orders, (void)values;
    return count == 0 && length == 0 ? STATUS_OK : absent(self);
}

/* Functions of the standard's other interface types. */

NO_CALL(EnterContinuousTimeMode);

EXPORT int FMI(CompletedIntegratorStep)(void *self, bool no_earlier_state, bool *enter_event_mode, bool *terminate)
{
    (void)no_earlier_state, (void)enter_event_mode, (void)terminate;
    return absent(self);
}

EXPORT int FMI(SetTime)(void *self, double time)
{
    (void)time;
    return absent(self);
}

#define NO_STATES(name, type) \
    EXPORT int FMI(name)(void *self, type values[], size_t length) \
    { \
        (void)values; \
        return length == 0 ? STATUS_OK : absent(self); \
    } \
    struct needs_a_semicolon

NO_STATES(SetContinuousStates, const double);
NO_STATES(GetContinuousStates, double);
NO_STATES(GetContinuousStateDerivatives, double);
NO_STATES(GetNominalsOfContinuousStates, double);
NO_STATES(GetEventIndicators, double);

#define NO_COUNT(name) \
    EXPORT int FMI(name)(void *self, size_t *count) \
    { \
        (void)count; \
        return absent(self); \
    } \
    struct needs_a_semicolon

NO_COUNT(GetNumberOfContinuousStates);
NO_COUNT(GetNumberOfEventIndicators);

EXPORT int FMI(ActivateModelPartition)(void *self, reference clock, double time)
{
    (void)clock, (void)time;
    return absent(self);
}
