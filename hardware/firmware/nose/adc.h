/* ADC: counts of one channel, 0 to 1023, full scale AVcc. */
#ifndef ADC_H
#define ADC_H

#include <stdint.h>

#define ADC_BITS "10"

void adc_begin(void);
uint16_t adc_counts(uint8_t channel);

#endif
