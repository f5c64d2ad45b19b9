#include "serial.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <stdint.h>

/* 16 MHz / 8 / 17 is 2.1 % fast; without the doubled clock (U2X0) the nearest rate is 3.5 % slow. */
#define DIVISOR 16U

/* Powers of two. 64 bytes take 5.5 ms to arrive, more than the 3.5 ms for which the ADC blocks the main loop. */
#define IN_SIZE 64U
#define OUT_SIZE 128U

/* Single producer (head), single consumer (tail); both indices are single bytes, so no lock is needed. */
static volatile char in[IN_SIZE], out[OUT_SIZE];
static volatile uint8_t in_head, in_tail, out_head, out_tail;

ISR(USART_RX_vect)
{
    bool damaged = UCSR0A & (_BV(FE0) | _BV(DOR0)); /* must be read before the byte */
    char c = UDR0;
    uint8_t room = (uint8_t)(in_tail - in_head - 1U) % IN_SIZE;
    if (room == 0) {
        return; /* the last place holds SERIAL_LOST */
    }
    in[in_head] = (damaged || room == 1) ? SERIAL_LOST : c;
    in_head = (in_head + 1U) % IN_SIZE;
}

ISR(USART_UDRE_vect)
{
    if (out_tail == out_head) {
        UCSR0B &= (uint8_t)~_BV(UDRIE0); /* nothing to send; the next serial_put enables the interrupt again */
        return;
    }
    UDR0 = out[out_tail];
    out_tail = (out_tail + 1U) % OUT_SIZE;
}

void serial_begin(void)
{
    UCSR0A = _BV(U2X0); /* before the divisor: simavr computes its baud rate when that is written */
    UBRR0 = DIVISOR;
    UCSR0C = _BV(UCSZ01) | _BV(UCSZ00); /* 8N1 */
    UCSR0B = _BV(RXEN0) | _BV(TXEN0) | _BV(RXCIE0);
}

bool serial_get(char *c)
{
    if (in_tail == in_head) {
        return false;
    }
    *c = in[in_tail];
    in_tail = (in_tail + 1U) % IN_SIZE;
    return true;
}

void serial_put(char c)
{
    uint8_t next = (out_head + 1U) % OUT_SIZE;
    while (next == out_tail) {
    }
    out[out_head] = c;
    out_head = next;
    UCSR0B |= _BV(UDRIE0);
}
