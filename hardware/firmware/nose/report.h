/* Periodic report: `$NOSE,<ms>,<A|B>,<adcA>,<adcB>*HH`. */
#ifndef REPORT_H
#define REPORT_H

#include <stdint.h>

#define REPORT_LEAST_MS 20U
#define REPORT_MOST_MS 10000U

void report_if_due(void);
void report_every(uint16_t ms); /* set the period; the next report is one period from now */
void report_select(char element); /* 'A' or 'B': the element named in the report; both are always measured */

#endif
