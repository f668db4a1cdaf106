/* Classes of cells by chroma and luma (ColorTable._look_up in detect/color_table.py). */

#ifndef RHOT_CLASSES_H
#define RHOT_CLASSES_H

#include "picture.h"

/* Cells that are looked up at a time. */
#define BLOCK 32

typedef struct {
    /* Of each layer, one behind the other, colours by chroma, v * 256 + u: class, lowest luma,
       highest luma and nothing, a byte each. As the picture's levels are, whatever their range. */
    const uint32_t *layers;
    int32_t count;
} colors;

/* Rows of a picture's planes from one cell on. */
typedef struct {
    const uint8_t *over, *under, *u, *v; /* pixels of luma; chroma */
} rows;

static inline rows rows_at(const picture *p, int32_t column, int32_t row) {
    const uint8_t *over = p->y + (ptrdiff_t)2 * row * p->row_y + (ptrdiff_t)2 * column;
    ptrdiff_t chroma = (ptrdiff_t)row * p->row_chroma + column;
    rows at = {over, over + p->row_y, p->u + chroma, p->v + chroma};
    return at;
}

static inline uint32_t entry_at(const uint32_t *layer, const rows *r, int32_t x) {
    return layer[r->u[x] | (uint32_t)r->v[x] << 8];
}

/* Whether a cell's luma, the mean of four pixels rounded as OpenCV does, is an entry's. */
static inline int is_luma_of(uint32_t entry, const rows *r, int32_t x) {
    uint32_t luma = (uint32_t)(r->over[2 * x] + r->over[2 * x + 1] + r->under[2 * x] +
                               r->under[2 * x + 1] + 2) >> 2;
    return luma >= (entry >> 8 & 255) && luma <= (entry >> 16 & 255);
}

/* The class of each cell of a row, 0 for none, into classes; luma is looked at only where chroma
   has a class, which is rare. Layers never claim the same cell: they share chromas, not lumas.
   soon: a row that is looked at soon, or NULL. Returns whether any cell has a class. */
static int classify(uint8_t *classes, const rows *r, const rows *soon, int32_t w, const colors *c) {
    uint8_t by_chroma[BLOCK], any = 0;
    for (int32_t x0 = 0; x0 < w; x0 += BLOCK) {
        int32_t n = w - x0 < BLOCK ? w - x0 : BLOCK;
        for (int32_t x = x0; x < x0 + n; x++) classes[x] = 0;
        for (int32_t k = 0; k < c->count; k++) {
            const uint32_t *layer = c->layers + (ptrdiff_t)65536 * k;
            uint8_t some = 0;
            for (int32_t x = 0; x < n; x++) {
                by_chroma[x] = (uint8_t)entry_at(layer, r, x0 + x);
                some |= by_chroma[x];
            }
            if (!some) continue;
            /* What has a colour goes on in the next rows. */
            if (soon) {
                fetch(soon->over + 2 * x0, 2 * n);
                fetch(soon->under + 2 * x0, 2 * n);
            }
            for (int32_t x = 0; x < n; x++)
                if (by_chroma[x] && is_luma_of(entry_at(layer, r, x0 + x), r, x0 + x))
                    any = classes[x0 + x] = by_chroma[x];
        }
    }
    return any;
}

#endif
