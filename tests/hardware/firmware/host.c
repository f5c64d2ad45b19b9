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

#include "board.h"

#define BYTES_PER_TURN 10 /* 1 ms between looks at the host's side */

static int pty_fd, pty_held_open;
static char pty_path[64];

static void open_pty(void)
{
    struct termios raw;
    memset(&raw, 0, sizeof raw);
    cfmakeraw(&raw);
    raw.c_cflag |= CS8 | CREAD | CLOCAL;
    if (openpty(&pty_fd, &pty_held_open, pty_path, &raw, NULL)) { /* our own end of it stays open: no hang-up between visitors */
        perror("host: openpty");
        exit(1);
    }
    fcntl(pty_fd, F_SETFL, O_NONBLOCK);
    fcntl(STDIN_FILENO, F_SETFL, O_NONBLOCK);
    printf("pty %s\n", pty_path);
}

static void set_millivolts(const char *line)
{
    unsigned mv[BOARD_CHANNELS], ripple = 0;
    if (sscanf(line, "%u %u %u", &mv[0], &mv[1], &ripple) >= BOARD_CHANNELS) {
        board_millivolts(mv, ripple);
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

static int next_byte(void) /* from the host; -1: none */
{
    static unsigned char bytes[4096];
    static ssize_t at, end;
    if (at >= end) {
        end = read(pty_fd, bytes, sizeof bytes);
        at = 0;
    }
    return at < end ? bytes[at++] : -1;
}

static void turn(void)
{
    unsigned char said[4096];
    for (int i = 0; i < BYTES_PER_TURN; i++) {
        board_run(next_byte());
    }
    ssize_t n = write(pty_fd, said, board_said(said, sizeof said)); /* what nobody takes off the pty is lost, as on a real line */
    (void)n;
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
    board_load(argv[1]);
    open_pty();
    began_s = now_s();
    while (read_stdin()) {
        turn();
        wait_until(began_s + board_s() / speed);
    }
    return 0;
}
