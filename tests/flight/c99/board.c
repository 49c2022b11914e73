/* A board without an operating system: all that the replay calls, and a place for its files.

   The emulator writes a record into board_in and reads what is said and answered; `board_files` of
   them are named to the replay: 0 for the record in the image, 1 to compare, 2 to write answers. */
#include "adcs.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#define ROOM (1u << 20)

int main(int count, char **arguments);
int board_main(void);

typedef struct {
    unsigned char *bytes;
    size_t at;
    size_t end;
} memory_file;

volatile uint32_t board_state;
volatile uint32_t board_inputs;
volatile uint32_t board_files;
volatile uint32_t board_in_size;
volatile uint32_t board_out_size;
unsigned char board_in[ROOM];
unsigned char board_out[ROOM];
char board_said[1024];

static memory_file files[2] = {{board_in, 0, 0}, {board_out, 0, ROOM}};
static size_t said;

FILE *fopen(const char *name, const char *mode)
{
    (void)name;
    files[0].end = board_in_size;
    return (FILE *)(void *)&files[mode[0] == 'w'];
}

int fclose(FILE *file)
{
    (void)file;
    board_out_size = (uint32_t)files[1].at;
    return 0;
}

static unsigned char *taken(FILE *file, size_t count)
{
    memory_file *own = (memory_file *)(void *)file;
    unsigned char *first = own->bytes + own->at;
    if (own->end - own->at < count) {
        return NULL;
    }
    own->at += count;
    return first;
}

size_t fread(void *to, size_t size, size_t count, FILE *file)
{
    const unsigned char *from = taken(file, size * count);
    for (size_t k = 0; from != NULL && k < size * count; k++) {
        ((unsigned char *)to)[k] = from[k];
    }
    return (from != NULL) ? count : 0u;
}

size_t fwrite(const void *from, size_t size, size_t count, FILE *file)
{
    unsigned char *to = taken(file, size * count);
    for (size_t k = 0; to != NULL && k < size * count; k++) {
        to[k] = ((const unsigned char *)from)[k];
    }
    return (to != NULL) ? count : 0u;
}

static void say(char letter)
{
    if (said < sizeof board_said - 1u) {
        board_said[said] = letter;
        said++;
    }
}

static void say_number(unsigned long number)
{
    if (number > 9u) {
        say_number(number / 10u);
    }
    say((char)('0' + (char)(number % 10u)));
}

/* Of conversions those of the replay: %lu and %s. */
int printf(const char *format, ...)
{
    va_list values;
    va_start(values, format);
    for (; *format != '\0'; format++) {
        if (strncmp(format, "%lu", 3) == 0) {
            say_number(va_arg(values, unsigned long));
            format += 2;
        } else if (strncmp(format, "%s", 2) == 0) {
            for (const char *text = va_arg(values, const char *); *text != '\0'; text++) {
                say(*text);
            }
            format++;
        } else {
            say(*format);
        }
    }
    va_end(values);
    return 0;
}

int puts(const char *text)
{
    return printf("%s\n", text);
}

int putchar(int letter)
{
    say((char)letter);
    return letter;
}

int strncmp(const char *a, const char *b, size_t count)
{
    size_t k = 0;
    while (k < count && a[k] == b[k] && a[k] != '\0') {
        k++;
    }
    return (k < count) ? a[k] - b[k] : 0;
}

double copysign(double number, double sign)
{
    union {
        double number;
        uint64_t bits;
    } of = {number}, by = {sign};
    of.bits = (of.bits & (UINT64_MAX >> 1)) | (by.bits & ~(UINT64_MAX >> 1));
    return of.number;
}

int board_main(void)
{
    static char replay[] = "replay";
    static char in[] = "in";
    static char out[] = "out";
    char *arguments[] = {replay, in, out, NULL};
    board_state = sizeof(adcs_state);
    board_inputs = sizeof(adcs_inputs);
    return main(1 + (int)board_files, arguments);
}
