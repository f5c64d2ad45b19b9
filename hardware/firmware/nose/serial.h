/* The UART, 115200 8N1, with a ring of bytes each way; interrupts move them and wait for nothing. */
#ifndef SERIAL_H
#define SERIAL_H

#include <stdbool.h>

#define SERIAL_LOST '\0' /* stands where bytes were damaged or had no room: it spoils the command it falls into */

void serial_begin(void);
bool serial_get(char *c);
void serial_put(char c); /* waits for room; for the main loop alone */

#endif
