/* Two relays: PD4 opens the beacon, PD5 the source; never both. */
#ifndef VALVE_H
#define VALVE_H

void valve_begin(void);
void valve_open(char which); /* '0' none, '1' the beacon, '2' the source */

#endif
