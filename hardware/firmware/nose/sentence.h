/* Writes `$FIELD,FIELD*HH\r\n`; HH is the XOR of the characters between $ and *. */
#ifndef SENTENCE_H
#define SENTENCE_H

#include <stdint.h>

void sentence_begin(const char *name); /* names and texts may lie in RAM alone: they are few and short */
void sentence_text(const char *field);
void sentence_number(uint32_t field);
void sentence_end(void);

#endif
