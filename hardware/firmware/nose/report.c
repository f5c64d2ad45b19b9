#include "report.h"

#include "adc.h"
#include "clock.h"
#include "sentence.h"

static uint16_t period_ms = 100;
static uint32_t due_ms = 100;
static char active[2] = "A";

static void report(uint32_t now_ms)
{
    uint16_t a = adc_counts(0), b = adc_counts(1);
    sentence_begin("NOSE");
    sentence_number(now_ms); /* when the conversions began; they are over 3.5 ms later */
    sentence_text(active);
    sentence_number(a);
    sentence_number(b);
    sentence_end();
}

void report_if_due(void)
{
    uint32_t now_ms = clock_ms();
    if ((int32_t)(now_ms - due_ms) < 0) { /* right even when ms wraps after 49.7 days */
        return;
    }
    due_ms += period_ms; /* not now_ms: a late report does not shift those after it */
    if ((int32_t)(now_ms - due_ms) >= 0) {
        due_ms = now_ms + period_ms; /* so late that one was missed: no burst to make up for it */
    }
    report(now_ms);
}

void report_every(uint16_t ms)
{
    period_ms = ms;
    due_ms = clock_ms() + ms;
}

void report_select(char element)
{
    active[0] = element;
}
