/* Reads arguments from standard input and writes what the function that is named writes of them: words of 32 bits. */

#include <stdio.h>
#include <string.h>

enum { BLOCK = 1 << 14 };

static float classic_log_of(float x) { return op_classic_log(0.5f, x); }

static const struct { const char *name; float (*call)(float x); } FUNCTIONS[] = {
    { "exp", op_exp }, { "log", op_log }, { "atan", op_atan }, { "asin", op_asin }, { "acos", op_acos },
    { "tanh", op_tanh }, { "sin", op_sin }, { "cos", op_cos }, { "tan", op_tan }, { "sqrt", op_sqrt },
    { "classic-exp", op_classic_exp }, { "classic-log", classic_log_of },
};

int main(int argc, char **argv)
{
    static float x[2 * BLOCK];
    static float results[BLOCK];
    size_t function = 0;
    const size_t count = sizeof FUNCTIONS / sizeof FUNCTIONS[0];
    const char *name = argc > 1 ? argv[1] : "";
    const int binary = strcmp(name, "pow") == 0;
    while (!binary && function < count && strcmp(FUNCTIONS[function].name, name) != 0) function++;
    if (function == count) return 2;
    for (;;) {
        const size_t read = fread(x, binary ? 8 : 4, BLOCK, stdin);
        if (read == 0) return 0;
        for (size_t k = 0; k < read; k++) results[k] = binary ? op_pow(x[2 * k], x[2 * k + 1]) : FUNCTIONS[function].call(x[k]);
        if (fwrite(results, 4, read, stdout) != read) return 1;
    }
}
