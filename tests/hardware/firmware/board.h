/* An ATmega328P at 16 MHz and 5 V on simavr: what a byte's time on its UART does.
 *
 * A tool of the tests alone; see host.c for the licence of what it is linked with. */
#ifndef BOARD_H
#define BOARD_H

#include <stddef.h>

#define BOARD_CHANNELS 2

void board_load(const char *elf);
void board_millivolts(const unsigned *mv, unsigned ripple_mv); /* of ADC0 and ADC1; ripple: added at one conversion, taken off at the next */
void board_run(int byte);                                      /* the time of one byte; -1: none comes in */
size_t board_said(unsigned char *bytes, size_t most);          /* what it has sent since it was asked last */
double board_s(void);                                          /* seconds of its crystal */

#endif
