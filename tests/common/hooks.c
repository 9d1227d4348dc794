// The hooks of hooks.h.

#define _POSIX_C_SOURCE 200809L // pthreads

#include "hooks.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

typedef struct piece
{
    void (*task)(void *context, size_t begin, size_t end);
    void *context;
    size_t begin, end;
} piece;

static void *run_piece(void *pointer)
{
    const piece *p = (const piece *)pointer;
    for (size_t i = p->end; i > p->begin;)
    {
        const size_t from = i - p->begin > 3 ? i - 3 : p->begin;
        p->task(p->context, from, i);
        i = from;
    }
    return NULL;
}

void threads_for(void *user, size_t count, void (*task)(void *, size_t, size_t), void *context)
{
    pthread_t thread[3];
    piece pieces[3];
    int started[3];
    if (user != NULL)
        ++*(int *)user;
    for (size_t i = 0; i < 3; ++i)
    {
        pieces[i].task = task;
        pieces[i].context = context;
        pieces[i].begin = count * i * i / 9;
        pieces[i].end = count * (i + 1) * (i + 1) / 9;
        started[i] = pthread_create(&thread[i], NULL, run_piece, &pieces[i]) == 0;
        if (!started[i])
            (void)run_piece(&pieces[i]);
    }
    for (size_t i = 0; i < 3; ++i)
        if (started[i])
            (void)pthread_join(thread[i], NULL);
}

#define BLOCK_HEAD 64 // keeps what malloc's alignment promises, and holds the size

static void *ledger_allocate(void *user, size_t bytes)
{
    ledger *l = (ledger *)user;
    unsigned char *block;
    if (l->calls++ == l->fail_at || (block = (unsigned char *)malloc(bytes + BLOCK_HEAD)) == NULL)
        return NULL;
    memset(block + BLOCK_HEAD, 0xA5, bytes);
    memcpy(block, &bytes, sizeof bytes);
    l->live++;
    l->bytes += bytes;
    l->peak = l->bytes > l->peak ? l->bytes : l->peak;
    return block + BLOCK_HEAD;
}

static void ledger_release(void *user, void *pointer)
{
    ledger *l = (ledger *)user;
    unsigned char *block = (unsigned char *)pointer - BLOCK_HEAD;
    size_t bytes;
    memcpy(&bytes, block, sizeof bytes);
    l->live--;
    l->bytes -= bytes;
    free(block);
}

static int ledger_progress(void *user, double fraction)
{
    ledger *l = (ledger *)user;
    l->fractions_fine &= fraction >= 0.0 && fraction <= 1.0;
    l->fractions_fell += fraction < l->last_fraction ? 1 : 0;
    l->last_fraction = fraction;
    return l->progress_calls++ == l->cancel_at;
}

sss_hooks ledger_hooks(ledger *l, int with_progress)
{
    sss_hooks hooks;
    memset(l, 0, sizeof *l);
    memset(&hooks, 0, sizeof hooks);
    l->fail_at = -1;
    l->cancel_at = -1;
    l->fractions_fine = 1;
    hooks.user = l;
    hooks.allocate = ledger_allocate;
    hooks.release = ledger_release;
    hooks.progress = with_progress ? ledger_progress : NULL;
    return hooks;
}

void shuffled_for(void *user, size_t count, void (*task)(void *, size_t, size_t), void *context)
{
    uint32_t *order = (uint32_t *)malloc((count + 1) * sizeof *order);
    uint64_t state = 88172645463325252u;
    (void)user;
    for (size_t i = 0; i < count; ++i)
    {
        state ^= state << 13, state ^= state >> 7, state ^= state << 17;
        const size_t k = (size_t)(state % (i + 1));
        order[i] = order[k];
        order[k] = (uint32_t)i;
    }
    for (size_t i = 0; i < count; ++i)
        task(context, order[i], (size_t)order[i] + 1);
    free(order);
}
