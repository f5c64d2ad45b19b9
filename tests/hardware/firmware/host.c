/* Runs the nose's firmware on a simulated ATmega328P: its UART on a pty, its ADC fed with millivolts, its valve pins told.
 *
 *   host FIRMWARE.elf [SPEED]      SPEED times real time, 1 if not given
 *
 * stdin   `<mV of ADC0> <mV of ADC1> [<mV of ripple>]` a line; ripple is added to both at one conversion and taken off at the next;
 *         the end of stdin ends the host
 * stdout  `pty <path>` first, then
 *         `valve <PD4> <PD5> <us>` whenever one of these pins changes, and
 *         `line <us>` whenever the firmware has handed the last byte of a line to its UART;
 *         us are microseconds of the simulated crystal, so that a busy machine does not blur them
 *
 * A tool of the tests alone: they build it, link it with simavr, which is under the GPL version 3, and run it. No binary of it is
 * shipped, and this file is in no wheel.
 */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <pty.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include <avr_adc.h>
#include <avr_ioport.h>
#include <avr_uart.h>
#include <sim_avr.h>
#include <sim_elf.h>

#define HZ 16000000ULL
#define BYTE_CYCLES 1600ULL /* one byte in per 100 us: 115200 8N1 takes 87, simavr counts a parity bit and takes 94 */
#define BYTES_PER_TURN 10   /* 1 ms between looks at the host's side */
#define SUPPLY_MV 5000
#define PINS 2

static avr_t *avr;
static int pty_fd, pty_held_open;
static char pty_path[64];
static unsigned char from_host[4096], from_device[4096];
static size_t from_host_at, from_host_end, from_device_end;
static int valve[PINS];
static unsigned millivolts[PINS], ripple_mv;

static unsigned long long us(void)
{
    return avr->cycle / (HZ / 1000000ULL);
}

static void die(const char *why)
{
    fprintf(stderr, "host: %s: %s\n", why, strerror(errno));
    exit(1);
}

static void byte_out(struct avr_irq_t *irq, uint32_t value, void *param)
{
    (void)irq, (void)param;
    if (from_device_end < sizeof from_device) {
        from_device[from_device_end++] = (unsigned char)value;
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
    for (int i = 0; i < PINS; i++) {
        unsigned mv = up ? millivolts[i] + ripple_mv : millivolts[i] > ripple_mv ? millivolts[i] - ripple_mv : 0;
        avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_ADC0 + i), mv);
    }
}

static void load(const char *path)
{
    elf_firmware_t firmware;
    int told = dup(STDOUT_FILENO);
    memset(&firmware, 0, sizeof firmware);
    dup2(STDERR_FILENO, STDOUT_FILENO); /* the library chats while it reads */
    if (elf_read_firmware(path, &firmware)) {
        die(path);
    }
    fflush(stdout);
    dup2(told, STDOUT_FILENO);
    close(told);
    avr = avr_make_mcu_by_name("atmega328p");
    if (!avr) {
        die("atmega328p");
    }
    avr_init(avr);
    avr_load_firmware(avr, &firmware);
    avr->frequency = HZ;
    avr->vcc = avr->avcc = avr->aref = SUPPLY_MV;
    avr->log = LOG_ERROR;
}

static void connect_pins(void)
{
    uint32_t flags = 0; /* neither its own print of what is sent nor its own sleeps */
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), byte_out, NULL);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_OUT_TRIGGER), conversion_begins, NULL);
    for (int i = 0; i < PINS; i++) {
        avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ('D'), 4 + i), pin_changed, &valve[i]);
    }
}

static void open_pty(void)
{
    struct termios raw;
    memset(&raw, 0, sizeof raw);
    cfmakeraw(&raw);
    raw.c_cflag |= CS8 | CREAD | CLOCAL;
    if (openpty(&pty_fd, &pty_held_open, pty_path, &raw, NULL)) { /* our own end of it stays open: no hang-up between visitors */
        die("openpty");
    }
    fcntl(pty_fd, F_SETFL, O_NONBLOCK);
    fcntl(STDIN_FILENO, F_SETFL, O_NONBLOCK);
    printf("pty %s\n", pty_path);
}

static void set_millivolts(const char *line)
{
    unsigned a, b, ripple = 0;
    if (sscanf(line, "%u %u %u", &a, &b, &ripple) >= PINS) {
        millivolts[0] = a;
        millivolts[1] = b;
        ripple_mv = ripple;
    }
}

static int read_stdin(void) /* 0 at its end */
{
    static char line[64];
    static size_t length;
    char c;
    ssize_t n;
    while ((n = read(STDIN_FILENO, &c, 1)) == 1) {
        if (c != '\n' && length < sizeof line - 1) {
            line[length++] = c;
        } else if (c == '\n') {
            line[length] = '\0';
            set_millivolts(line);
            length = 0;
        }
    }
    return n < 0 && errno == EAGAIN;
}

static void exchange(void) /* what nobody takes off the pty is lost, as on a real line */
{
    ssize_t n = write(pty_fd, from_device, from_device_end);
    (void)n;
    from_device_end = 0;
    if (from_host_at == from_host_end) {
        n = read(pty_fd, from_host, sizeof from_host);
        from_host_at = 0;
        from_host_end = n > 0 ? (size_t)n : 0;
    }
}

static void run_for_a_byte(void)
{
    avr_cycle_count_t until = avr->cycle + BYTE_CYCLES;
    if (from_host_at < from_host_end) {
        avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT), from_host[from_host_at++]);
    }
    while (avr->cycle < until) {
        int state = avr_run(avr);
        if (state == cpu_Done || state == cpu_Crashed) {
            fprintf(stderr, "host: the firmware crashed at pc %04x\n", (unsigned)avr->pc);
            exit(1);
        }
    }
}

static double now_s(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void wait_until(double t_s) /* behind time it does not wait, and so catches up */
{
    double left_s = t_s - now_s();
    if (left_s > 0) {
        struct timespec t = {(time_t)left_s, (long)(1e9 * (left_s - (double)(time_t)left_s))};
        nanosleep(&t, NULL);
    }
}

int main(int argc, char **argv)
{
    double speed = argc > 2 ? atof(argv[2]) : 1.0, began_s;
    if (argc < 2 || speed <= 0) {
        fprintf(stderr, "usage: %s FIRMWARE.elf [SPEED above 0]\n", argv[0]);
        return 2;
    }
    setvbuf(stdout, NULL, _IOLBF, 0);
    load(argv[1]);
    connect_pins();
    open_pty();
    began_s = now_s();
    while (read_stdin()) {
        for (int i = 0; i < BYTES_PER_TURN; i++) {
            run_for_a_byte();
        }
        exchange();
        wait_until(began_s + (double)avr->cycle / (double)HZ / speed);
    }
    return 0;
}
