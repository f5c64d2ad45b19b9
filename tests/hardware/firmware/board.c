#include "board.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <avr_adc.h>
#include <avr_ioport.h>
#include <avr_uart.h>
#include <sim_avr.h>
#include <sim_elf.h>

#define HZ 16000000ULL
#define BYTE_CYCLES 1600ULL /* 100 us: 115200 8N1 takes 87, simavr counts a parity bit and takes 94 */
#define SUPPLY_MV 5000
#define VALVE_PIN 4 /* of port D, and the next */
#define VALVES 2

static avr_t *avr;
static unsigned char sent[4096];
static size_t sent_end;
static unsigned millivolts[BOARD_CHANNELS], ripple_mv;
static int valve[VALVES];

static unsigned long long us(void)
{
    return avr->cycle / (HZ / 1000000ULL);
}

double board_s(void)
{
    return (double)avr->cycle / (double)HZ;
}

static void byte_out(struct avr_irq_t *irq, uint32_t value, void *param)
{
    (void)irq, (void)param;
    if (sent_end < sizeof sent) {
        sent[sent_end++] = (unsigned char)value;
    }
    if (value == '\n') {
        printf("line %llu\n", us());
    }
}

static void pin_changed(struct avr_irq_t *irq, uint32_t value, void *param)
{
    int *pin = param;
    (void)irq;
    if (*pin != (int)value) {
        *pin = (int)value;
        printf("valve %d %d %llu\n", valve[0], valve[1], us());
    }
}

static void conversion_begins(struct avr_irq_t *irq, uint32_t value, void *param) /* simavr reads the voltage when it ends */
{
    static int up;
    (void)irq, (void)value, (void)param;
    up = !up;
    for (int i = 0; i < BOARD_CHANNELS; i++) {
        unsigned mv = up ? millivolts[i] + ripple_mv : millivolts[i] > ripple_mv ? millivolts[i] - ripple_mv : 0;
        avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_ADC0 + i), mv);
    }
}

void board_millivolts(const unsigned *mv, unsigned ripple)
{
    memcpy(millivolts, mv, sizeof millivolts);
    ripple_mv = ripple;
}

static void connect_pins(void)
{
    uint32_t flags = 0; /* neither its own print of what is sent nor its own sleeps */
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), byte_out, NULL);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_OUT_TRIGGER), conversion_begins, NULL);
    for (int i = 0; i < VALVES; i++) {
        avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('D'), VALVE_PIN + i), pin_changed, &valve[i]);
    }
}

void board_load(const char *elf)
{
    elf_firmware_t firmware;
    int told = dup(STDOUT_FILENO);
    memset(&firmware, 0, sizeof firmware);
    dup2(STDERR_FILENO, STDOUT_FILENO); /* the library chats while it reads */
    if (elf_read_firmware(elf, &firmware)) {
        fprintf(stderr, "host: %s is no firmware\n", elf);
        exit(1);
    }
    fflush(stdout);
    dup2(told, STDOUT_FILENO);
    close(told);
    avr = avr_make_mcu_by_name("atmega328p");
    if (!avr) {
        fprintf(stderr, "host: simavr has no ATmega328P\n");
        exit(1);
    }
    avr_init(avr);
    avr_load_firmware(avr, &firmware);
    avr->frequency = HZ;
    avr->vcc = avr->avcc = avr->aref = SUPPLY_MV;
    avr->log = LOG_ERROR;
    connect_pins();
}

void board_run(int byte)
{
    avr_cycle_count_t until = avr->cycle + BYTE_CYCLES;
    if (byte >= 0) {
        avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT), (uint32_t)byte);
    }
    while (avr->cycle < until) {
        int state = avr_run(avr);
        if (state == cpu_Done || state == cpu_Crashed) {
            fprintf(stderr, "host: the firmware crashed at pc %04x\n", (unsigned)avr->pc);
            exit(1);
        }
    }
}

size_t board_said(unsigned char *bytes, size_t most)
{
    size_t n = sent_end < most ? sent_end : most;
    memcpy(bytes, sent, n);
    sent_end = 0;
    return n;
}
