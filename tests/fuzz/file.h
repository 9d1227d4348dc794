// Files in memory for the fuzzers of what sss_*_load reads, and how good ones are changed.

#ifndef SSS_TESTS_FUZZ_FILE_H
#define SSS_TESTS_FUZZ_FILE_H

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

typedef struct file
{
    uint8_t *bytes;
    size_t count, read;
} file;

// How a header hashes what it writes: the state in the beginning, and behind one more word.
typedef struct file_hash
{
    uint64_t start;
    uint64_t (*mix)(uint64_t hash, uint32_t word);
} file_hash;

static inline void insist(int condition)
{
    if (!condition)
    {
        abort();
    }
}

static inline int append(void *user, const void *bytes, size_t count)
{
    file *f = (file *)user;
    uint8_t *const grown = (uint8_t *)realloc(f->bytes, f->count + count + 1);
    if (!grown)
    {
        abort();
    }
    if (count > 0)
    {
        memcpy(grown + f->count, bytes, count);
    }
    f->bytes = grown;
    f->count += count;
    return 0;
}

static inline int take(void *user, void *bytes, size_t count)
{
    file *f = (file *)user;
    if (count > f->count - f->read)
    {
        return 1;
    }
    memcpy(bytes, f->bytes + f->read, count);
    f->read += count;
    return 0;
}

static inline uint32_t word_at(const file *f, size_t word)
{
    const uint8_t *const b = f->bytes + 4 * word;
    return (uint32_t)b[0] | (uint32_t)b[1] << 8 | (uint32_t)b[2] << 16 | (uint32_t)b[3] << 24;
}

static inline void set_word(file *f, size_t word, uint32_t value)
{
    for (size_t k = 0; k < 4; ++k)
    {
        f->bytes[4 * word + k] = (uint8_t)(value >> 8 * k);
    }
}

// Where the checks of a good file are: two words that hold the hash of all before.
static inline size_t find_checks(const file *f, file_hash h, size_t *checks, size_t room)
{
    uint64_t hash = h.start;
    size_t found = 0;
    for (size_t i = 0; i + 1 < f->count / 4; ++i)
    {
        const uint64_t word = word_at(f, i), two = word | (uint64_t)word_at(f, i + 1) << 32;
        if (found < room && two == hash)
        {
            checks[found++] = i;
        }
        hash = h.mix(hash, word_at(f, i));
    }
    return found;
}

static inline void mend_checks(file *f, file_hash h, const size_t *checks, size_t count)
{
    uint64_t hash = h.start;
    for (size_t i = 0, next = 0; i < f->count / 4; ++i)
    {
        if (next < count && i == checks[next])
        {
            set_word(f, i, (uint32_t)(hash & UINT32_MAX));
            set_word(f, i + 1, (uint32_t)(hash >> 32));
            ++next;
        }
        hash = h.mix(hash, word_at(f, i));
    }
}

// Changes a good file as the bytes say: each seven are a place, what to do there, and a value. The first byte of the
// input, `how`, tells whether the checks are made right again, and whether the end is cut off; neither for 254.
static inline void change(file *f, file_hash h, const size_t *checks, size_t check_count, uint8_t how,
                          const uint8_t *data, size_t size)
{
    for (size_t i = 0; i + 7 <= size; i += 7)
    {
        const size_t words = f->count / 4, place = ((size_t)data[i] | (size_t)data[i + 1] << 8) % words;
        uint32_t value;
        memcpy(&value, data + i + 3, sizeof value);
        set_word(f, place, data[i + 2] % 3 == 0 ? value : data[i + 2] % 3 == 1 ? word_at(f, place) + value
                                                                               : word_at(f, place) ^ value);
    }
    if (how < 224)
    {
        mend_checks(f, h, checks, check_count);
    }
    f->count -= how % 16 == 15 ? (size_t)how : 0; // cut
}

#endif
