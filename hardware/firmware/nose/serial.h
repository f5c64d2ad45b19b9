/* UART, 115200 8N1, with an interrupt-driven ring buffer in each direction. */
#ifndef SERIAL_H
#define SERIAL_H

#include <stdbool.h>

#define SERIAL_LOST '\0' /* replaces bytes lost by framing errors or overruns: it invalidates the command that contains it */

void serial_begin(void);
bool serial_get(char *c);
void serial_put(char c); /* blocks until there is room; for the main loop only */

#endif
