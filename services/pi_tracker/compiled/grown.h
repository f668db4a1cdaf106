/* A blob grown into what is nearly its colour: what measure/grown_blob.py does, where it is said
   why. A test compares both forms. */

#ifndef RHOT_GROWN_H
#define RHOT_GROWN_H

#include "classes.h"
#include "masks.h"
#include "tile.h"

/* Masks of a window that it takes to grow a blob. */
#define GROWTH_MASKS 3

typedef struct {
    const uint8_t *cells; /* of the blob's rectangle, not 0 where it is */
    int32_t row;          /* bytes from one row to the next */
} blob_mask;

/* Cells of a blob's rectangle, and so many more on each side, that a picture has. */
static box window_of(const blob *b, const picture *p) {
    box window = {b->left - b->reach, b->top - b->reach, b->right + b->reach, b->bottom + b->reach};
    if (window.x0 < p->left) window.x0 = p->left;
    if (window.y0 < p->top) window.y0 = p->top;
    if (window.x1 > p->right) window.x1 = p->right;
    if (window.y1 > p->bottom) window.y1 = p->bottom;
    return window;
}

/* Bytes of a mask of w x h cells, in whole numbers of eight: an empty one lies behind each row, and
   a row and a cell before the first and behind the last, so that all cells have neighbours. */
static int64_t mask_bytes(int64_t w, int64_t h) { return ((w + 1) * (h + 2) + 2 + 7) / 8 * 8; }

/* The blob's own cells in a window's mask; returns how many. */
static int32_t place_own(uint8_t *own, int32_t row, const box *window, const blob *b,
                         const uint8_t *mask) {
    int32_t count = 0, w = b->right - b->left;
    own += (ptrdiff_t)(b->top - window->y0) * row + (b->left - window->x0);
    for (int32_t y = b->top; y < b->bottom; y++, own += row, mask += w)
        for (int32_t x = 0; x < w; x++) count += own[x] = mask[x] != 0;
    return count;
}

/* Where cells of a window are of the blob's class, or its own. */
static void find_alike(uint8_t *alike, const uint8_t *own, const picture *p, const box *window,
                       const colors *near, int32_t class) {
    int32_t w = window->x1 - window->x0;
    for (int32_t y = window->y0; y < window->y1; y++, alike += w + 1, own += w + 1) {
        rows at = rows_at(p, window->x0 - p->left, y - p->top);
        classify(alike, &at, NULL, w, near);
        for (int32_t x = 0; x < w; x++) alike[x] = own[x] | (alike[x] == class);
        alike[w] = 0;
    }
}

/* Adds to cells their neighbours, corners included, that are of a mask, as long as there are any;
   spare: memory like that of cells. */
static void spread(uint8_t *cells, const uint8_t *mask, uint8_t *spare, ptrdiff_t size,
                   ptrdiff_t row) {
    for (uint8_t more = 1; more;) {
        more = 0;
        INDEPENDENT
        for (ptrdiff_t i = 0; i < size; i++) {
            const uint8_t *c = cells + i;
            spare[i] = mask[i] & (c[-row - 1] | c[-row] | c[-row + 1] | c[-1] | c[1] | c[row - 1] |
                                  c[row] | c[row + 1]);
        }
        for (ptrdiff_t i = 0; i < size; i++) {
            more |= spare[i] & (uint8_t)~cells[i];
            cells[i] |= spare[i];
        }
    }
}

/* The box of a window's cells, of which there are some, and how many there are. */
static box box_of(const uint8_t *cells, int32_t row, int32_t h, int32_t *count) {
    box at = {row, h, 0, 0};
    *count = 0;
    for (int32_t y = 0; y < h; y++, cells += row) {
        int32_t first = 0, last = row, own = 0;
        for (int32_t x = 0; x < row; x++) own += cells[x];
        if (!own) continue;
        while (!cells[first]) first++;
        while (!cells[last - 1]) last--;
        if (first < at.x0) at.x0 = first;
        if (last > at.x1) at.x1 = last;
        if (y < at.y0) at.y0 = y;
        at.y1 = y + 1;
        *count += own;
    }
    return at;
}

/* Whether what cells of a window make up goes on beyond it, in the picture. */
static int goes_on(const box *at, const box *window, const picture *p) {
    return (at->x0 == 0 && window->x0 > p->left) || (at->y0 == 0 && window->y0 > p->top) ||
           (at->x1 == window->x1 - window->x0 && window->x1 < p->right) ||
           (at->y1 == window->y1 - window->y0 && window->y1 < p->bottom);
}

/* Grows a blob with its mask, which then lies in memory: GROWTH_MASKS of its window. Leaves both as
   they are where it would not become larger, or too large. */
static void grow(blob *b, blob_mask *m, const picture *p, const colors *near, uint8_t *memory) {
    box window = window_of(b, p);
    int32_t row = window.x1 - window.x0 + 1, h = window.y1 - window.y0, cells;
    ptrdiff_t size = (ptrdiff_t)row * h, bytes = (ptrdiff_t)mask_bytes(row - 1, h);
    for (ptrdiff_t i = 0; i < bytes; i++) memory[i] = 0;
    uint8_t *taken = memory + row + 1, *alike = taken + bytes, *spare = alike + bytes;
    int32_t own = place_own(taken, row, &window, b, m->cells);
    if (!own) return;
    find_alike(alike, taken, p, &window, near, b->class);
    open_mask(alike, spare, size, row, 1);
    spread(taken, alike, spare, size, row);
    box at = box_of(taken, row, h, &cells);
    if (cells <= own || cells > b->most || goes_on(&at, &window, p)) return;
    m->cells = taken + (ptrdiff_t)at.y0 * row + at.x0;
    m->row = row;
    b->left = window.x0 + at.x0;
    b->top = window.y0 + at.y0;
    b->right = window.x0 + at.x1;
    b->bottom = window.y0 + at.y1;
    b->cells = cells;
}

#endif
