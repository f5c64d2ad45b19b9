/* Two relays: PD4 opens the beacon, PD5 the source; never both, and neither for longer than the hold time after a command. */
#ifndef VALVE_H
#define VALVE_H

#include <stdint.h>

#ifndef VALVE_HOLD_MS
#define VALVE_HOLD_MS 10000UL /* hold time of a command: ten heartbeats of the host */
#endif

void valve_begin(void);
void valve_open(char which);      /* '0' none, '1' the beacon, '2' the source */
void valve_tick(uint32_t now_ms); /* closes the source after the hold time; now_ms must not be older than the last valve_open */

#endif
