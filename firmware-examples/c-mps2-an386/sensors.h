/* Stands in for sensors: the same numbers on every machine. */
#ifndef SENSORS_H
#define SENSORS_H

#include <stddef.h>
#include <stdint.h>

typedef struct {
    uint64_t state;
} sensors;

/* The next 64 bits. */
uint64_t sensors_bits(sensors *self);

/* An observation: in 16 of 32 cases ordinary, in 8 blank, in 8 with values of every kind, NaN and infinities too. */
void sensors_observe(sensors *self, float *observation, size_t length);

#endif
