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
    sentence_number(now_ms); /* start of the conversions, which take 3.5 ms */
    sentence_text(active);
    sentence_number(a);
    sentence_number(b);
    sentence_end();
}

void report_if_due(void)
{
    uint32_t now_ms = clock_ms();
    if ((int32_t)(now_ms - due_ms) < 0) { /* valid across the wrap of ms after 49.7 days */
        return;
    }
    due_ms += period_ms; /* not now_ms: the delay of one report does not shift the following ones */
    if ((int32_t)(now_ms - due_ms) >= 0) {
        due_ms = now_ms + period_ms; /* a report was missed: no burst to catch up */
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
