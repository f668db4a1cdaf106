/* A picture, or a window of one, in the caller's memory. */

#ifndef RHOT_PICTURE_H
#define RHOT_PICTURE_H

#include <stddef.h>
#include <stdint.h>

/* Cells a side of a picture, at most: so no product of sizes overflows. */
#define MOST_CELLS 16384

/* Bytes of a cache's line, as a rule. */
#define LINE 64

/* Several numbers at a time: no value of such a loop depends on another's. */
#if defined(__clang__)
#define INDEPENDENT _Pragma("clang loop vectorize(assume_safety)")
#else
#define INDEPENDENT _Pragma("GCC ivdep")
#endif

/* What a function returns that was given no picture. */
enum { BAD_PICTURE = -1 };

typedef struct {
    /* Planes of a window of the picture. A row of u and of v has half as many bytes as one of y. */
    const uint8_t *y, *u, *v;
    /* 256 values each, which levels stand for; null where they stand for themselves. */
    const uint8_t *luma_levels, *chroma_levels;
    int64_t bytes_y, bytes_chroma; /* of y; of u and of v each */
    int32_t row_y, row_chroma;     /* bytes from one row to the next */
    /* The window in the picture and the picture's size, in cells; right and bottom excluded. */
    int32_t left, top, right, bottom, width, height;
} picture;

/* Asks for bytes of a row that are needed soon: a camera's picture comes from memory, not from a
   cache, and processors do not foresee short rows. */
static inline void fetch(const uint8_t *row, ptrdiff_t bytes) {
    for (ptrdiff_t x = 0; x < bytes; x += LINE) __builtin_prefetch(row + x);
    __builtin_prefetch(row + bytes - 1);
}

static inline int is_picture(const picture *p) {
    int64_t w = (int64_t)p->right - p->left, h = (int64_t)p->bottom - p->top;
    if (!p->y || !p->u || !p->v || p->width > MOST_CELLS || p->height > MOST_CELLS) return 0;
    if (p->left < 0 || p->top < 0 || w < 1 || h < 1) return 0;
    if (p->right > p->width || p->bottom > p->height) return 0;
    return p->row_y >= 2 * w && p->row_chroma >= w &&
           p->bytes_y >= (2 * h - 1) * p->row_y + 2 * w &&
           p->bytes_chroma >= (h - 1) * p->row_chroma + w;
}

#endif
