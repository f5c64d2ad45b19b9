#include "valve.h"

#include <avr/io.h>
#include <stdint.h>

#define BEACON _BV(PD4)
#define SOURCE _BV(PD5)

void valve_begin(void)
{
    PORTD &= (uint8_t)~(BEACON | SOURCE); /* low before they become outputs: no click at boot */
    DDRD |= BEACON | SOURCE;
}

void valve_open(char which)
{
    PORTD &= (uint8_t)~(BEACON | SOURCE); /* close the one before the other opens */
    if (which == '1') {
        PORTD |= BEACON;
    } else if (which == '2') {
        PORTD |= SOURCE;
    }
}
