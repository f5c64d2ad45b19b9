#include "command.h"

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#include "adc.h"
#include "clock.h"
#include "report.h"
#include "sentence.h"
#include "valve.h"

#define NAME "OIO-NOSE"
#define VERSION "1"
#define LONGEST 16U /* characters of a command without its \n */

static char text[LONGEST + 1];
static uint8_t length;
static bool returned; /* \r was received last: ignored if \n follows, as terminals send it */

static void acknowledge(void)
{
    sentence_begin("ACK");
    sentence_text(text);
    sentence_number(clock_ms());
    sentence_end();
}

static void refuse(void)
{
    sentence_begin("NAK");
    sentence_text(text);
    sentence_end();
}

static void identify(void)
{
    sentence_begin("ACK");
    sentence_text("ID");
    sentence_text(NAME);
    sentence_text(VERSION);
    sentence_text(ADC_BITS);
    sentence_end();
}

static uint16_t period(const char *digits) /* period [ms]; 0 if invalid */
{
    uint16_t ms = 0;
    for (; *digits; digits++) {
        if (*digits < '0' || *digits > '9' || ms > REPORT_MOST_MS / 10U) {
            return 0;
        }
        ms = (uint16_t)(ms * 10U + (uint16_t)(*digits - '0'));
    }
    return (ms >= REPORT_LEAST_MS && ms <= REPORT_MOST_MS) ? ms : 0;
}

static bool two(char first, const char *seconds) /* whether the command is `first` and one of `seconds` */
{
    return length == 2 && text[0] == first && strchr(seconds, text[1]);
}

static bool obeyed(void)
{
    if (two('S', "AB")) {
        report_select(text[1]);
    } else if (two('V', "012")) {
        valve_open(text[1]);
    } else if (text[0] == 'P' && period(text + 1)) {
        report_every(period(text + 1));
    } else {
        return false;
    }
    return true;
}

static void answer(void)
{
    text[length] = '\0';
#ifdef WEDGE /* for the watchdog test: a command that hangs the main loop */
    while (text[0] == 'W') {
    }
#endif
    if (two('I', "D")) {
        identify();
    } else if (obeyed()) {
        acknowledge();
    } else {
        refuse();
    }
}

/* A character that a sentence cannot repeat is stored as ?, and so is the end of an overlong command: no command has a question mark. */
static void keep(char c)
{
    bool sayable = c >= ' ' && c <= '~' && c != '$' && c != '*' && c != ','; /* else it would corrupt the reply that repeats it */
    if (length == LONGEST) {
        text[LONGEST - 1] = '?';
        return;
    }
    text[length++] = sayable ? c : '?';
}

static void end(void)
{
    if (length) {
        answer();
    }
    length = 0;
}

void command_character(char c)
{
    if (returned && c != '\n') {
        keep('\r');
    }
    returned = c == '\r';
    if (c == '\n') {
        end();
    } else if (!returned) {
        keep(c);
    }
}
