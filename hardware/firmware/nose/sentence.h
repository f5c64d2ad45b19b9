/* Sentence encoder: `$FIELD,FIELD*HH\r\n`; the checksum HH is the XOR of the characters between $ and *. */
#ifndef SENTENCE_H
#define SENTENCE_H

#include <stdint.h>

void sentence_begin(const char *name); /* names and texts must be in RAM, not in flash: they are few and short */
void sentence_text(const char *field);
void sentence_number(uint32_t field);
void sentence_end(void);

#endif
