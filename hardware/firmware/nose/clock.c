#include "clock.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <util/atomic.h>

#define PRESCALER 64UL
#define TICKS_PER_MS (F_CPU / PRESCALER / 1000UL) /* 250 at 16 MHz: exact, so the clock is as accurate as its crystal */

static volatile uint32_t ms;

ISR(TIMER0_COMPA_vect)
{
    ms++;
}

void clock_begin(void)
{
    TCCR0A = _BV(WGM01); /* clear on compare match */
    OCR0A = TICKS_PER_MS - 1;
    TIMSK0 = _BV(OCIE0A);
    TCCR0B = _BV(CS01) | _BV(CS00); /* clock / 64 */
}

uint32_t clock_ms(void)
{
    uint32_t now;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) /* four bytes: an interrupt could change them during the read */
    {
        now = ms;
    }
    return now;
}
