#include "sentence.h"

#include "serial.h"

static uint8_t sum;

static void put(char c)
{
    sum ^= (uint8_t)c;
    serial_put(c);
}

static void put_all(const char *text)
{
    while (*text) {
        put(*text++);
    }
}

static char hex(uint8_t nibble)
{
    return (char)(nibble < 10 ? '0' + nibble : 'A' + nibble - 10);
}

void sentence_begin(const char *name)
{
    serial_put('$');
    sum = 0;
    put_all(name);
}

void sentence_text(const char *field)
{
    put(',');
    put_all(field);
}

void sentence_number(uint32_t field)
{
    char digits[11]; /* 4294967295 and the terminating zero */
    char *first = digits + sizeof digits - 1;
    *first = '\0';
    do {
        *--first = (char)('0' + field % 10U);
        field /= 10U;
    } while (field);
    sentence_text(first);
}

void sentence_end(void)
{
    uint8_t checksum = sum;
    serial_put('*');
    serial_put(hex(checksum >> 4));
    serial_put(hex(checksum & 0x0F));
    serial_put('\r');
    serial_put('\n');
}
