/* OIO nose: two gas-sensing elements on an ATmega328P (Arduino Uno, Nano) at 16 MHz.
 *
 * Wiring (Arduino names in brackets)
 *   ADC0 [A0]      element A: V_out of its LMP91000, or the middle of its divider (sensor to +5 V, load resistor to GND)
 *   ADC1 [A1]      element B, the same
 *   PD4  [D4]      relay of the beacon, high = open; low = open if made with EXTRA=-DRELAYS_LOW
 *   PD5  [D5]      relay of the source, the same
 *   PD0, PD1       serial line, 115200 8N1; on an Arduino it is the USB socket
 *   AREF           100 nF to GND and nothing else: the reference is AVcc, that is the board's +5 V
 * Both dividers are supplied by the same +5 V as AVcc, so that the counts are ratiometric. The potentiostats take their reference
 * from it too: full scale, 1023 counts, is AVcc. Heaters and bias are wired to the supply, never to a pin: they stay on.
 * Most relay boards with optocouplers switch on a low level and need -DRELAYS_LOW: without it both sources are open until V1 or V2
 * is received, and then the wrong one. Test it with no gas connected: at power-up no relay may click, and none may be lit.
 *
 * Protocol
 *   every period   $NOSE,<ms>,<A|B>,<adcA>,<adcB>*HH    ms since boot, the selected element, both counts (10 bits)
 *   SA, SB         select an element                    $ACK,SA,<ms>*HH
 *   P<ms>          period, 20 to 10000, at first 100    $ACK,P50,<ms>*HH
 *   V0, V1, V2     no source, the beacon, the source    $ACK,V1,<ms>*HH    closes after 10 s: repeat it as a heartbeat
 *   ID                                                  $ACK,ID,OIO-NOSE,<version>,10*HH
 *   anything else                                       $NAK,<the command>*HH
 * Commands end in \n (a \r before it is dropped) and have at most 16 characters; characters that a sentence cannot hold are repeated as ?.
 * HH is the XOR of the characters between $ and *; sentences end in \r\n.
 * V1 and V2 hold for 10 s after they were last received, and a repetition does not switch the relay. The host repeats the command
 * every second as a heartbeat; after a crash or a suspension of the host the gas closes. Closing is not reported.
 *
 * The watchdog resets the board if the main loop hangs for a second: the valves close and ms restarts at 0.
 */
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/wdt.h>

#include "adc.h"
#include "clock.h"
#include "command.h"
#include "report.h"
#include "serial.h"
#include "valve.h"

/* After a watchdog reset the watchdog keeps running, at 16 ms, and cannot be stopped while WDRF is set (data sheet, "Watchdog System
 * Reset"). So it is stopped here, before memory is cleared. */
void watchdog_off(void) __attribute__((naked, used, section(".init3")));

void watchdog_off(void)
{
    MCUSR = 0;
    wdt_disable();
}

int main(void)
{
    valve_begin();
    adc_begin();
    serial_begin();
    clock_begin();
    wdt_enable(WDTO_1S);
    sei();
    for (;;) { /* no sleep mode: QEMU's AVR does not wake from it */
        char c;
        wdt_reset();
        report_if_due();
        valve_tick(clock_ms());
        if (serial_get(&c)) { /* one character per cycle, so that a flood of commands delays no report */
            command_character(c);
        }
    }
}
