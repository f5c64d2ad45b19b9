/* Two relays: PD4 opens the beacon, PD5 the source; never both, and neither for longer than somebody asks for it. */
#ifndef VALVE_H
#define VALVE_H

#include <stdint.h>

#ifndef VALVE_HOLD_MS
#define VALVE_HOLD_MS 10000UL /* so long a command holds: ten beats of the host, after which it is taken for dead */
#endif

void valve_begin(void);
void valve_open(char which);      /* '0' none, '1' the beacon, '2' the source */
void valve_tick(uint32_t now_ms); /* closes what has not been asked for anew; now_ms is no older than the last valve_open */

#endif
