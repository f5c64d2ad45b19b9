#include "valve.h"

#include <avr/io.h>
#include <stdint.h>

#include "clock.h"

#define BEACON _BV(PD4)
#define SOURCE _BV(PD5)
#define BOTH (BEACON | SOURCE)

static uint8_t opened; /* BEACON, SOURCE, or 0 */
static uint32_t asked_ms;

static void drive(uint8_t open)
{
#ifdef RELAYS_LOW
    uint8_t high = BOTH ^ open;
#else
    uint8_t high = open;
#endif
    PORTD = (uint8_t)((PORTD & (uint8_t)~BOTH) | high); /* both pins in one write */
    opened = open;
}

void valve_begin(void)
{
    drive(0); /* set to closed before the pins become outputs: no relay clicks at boot */
    DDRD |= BOTH;
}

void valve_open(char which)
{
    uint8_t wanted = which == '1' ? BEACON : which == '2' ? SOURCE : 0;
    asked_ms = clock_ms();
    if (wanted != opened) { /* a repetition does not switch the relay, which would click at each heartbeat */
        drive(0);           /* close one before the other opens */
        drive(wanted);
    }
}

void valve_tick(uint32_t now_ms)
{
    if (opened && now_ms - asked_ms >= VALVE_HOLD_MS) { /* valid across the wrap of ms after 49.7 days */
        drive(0);
    }
}
