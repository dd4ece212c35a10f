/* What the emulator does for a program: print, and end. */
#ifndef SEMIHOSTING_H
#define SEMIHOSTING_H

#include <stdint.h>

/* Prints text. */
void print(const char *text);

/* Prints a space and the eight hexadecimal digits of a word. */
void print_word(uint32_t word);

/* Ends the program with an exit status. */
_Noreturn void end_with(int status);

#endif
