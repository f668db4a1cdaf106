/* Patches of one colour in a rectangle of a picture: what BlobDetector.detect finds there
   (detect/blob_search.py), in one call. A test compares both forms.

   Patches of several colours, one within another's hole, and more than there is room for are left
   to Python, where what is done with them is said. As in centroid.c, nothing is allocated, sizes
   are checked before the first access, and a call that returns less than 0 has found nothing. */

#include "classes.h"
#include "masks.h"

enum { BAD_RECT = -2, BAD_SIZE = -3, FOR_PYTHON = -4 };

typedef struct {
    box at;         /* in the part of the rectangle that has colours */
    int32_t class;  /* from 1 */
    int32_t cells;  /* of that class */
} patch;

typedef struct {
    int32_t margin;    /* cells kept around what has a colour, where there are any */
    int32_t rounds;    /* of erosion, and of dilation after it */
    int32_t min_cells; /* of a patch */
    int32_t most;      /* patches that there is room for */
} options;

/* Eight cells; their memory is aligned so. */
typedef uint64_t __attribute__((may_alias)) eight;

/* Rows ahead of which chroma is asked for, and luma where there is colour. */
#define AHEAD 8
#define SOON 3

/* Who calls has the same structures: their sizes are compared. */
const int32_t rhot_patches_sizes[3] = {sizeof(colors), sizeof(options), sizeof(patch)};

/* The class of every cell of a rectangle, rows of w bytes; returns where cells have one. */
static box classes_of(uint8_t *classes, const picture *p, const box *r, const colors *c) {
    int32_t w = r->x1 - r->x0, h = r->y1 - r->y0;
    box found = {w, h, 0, 0};
    for (int32_t y = 0; y < h; y++, classes += w) {
        int32_t column = r->x0 - p->left, row = r->y0 - p->top + y;
        rows at = rows_at(p, column, row), soon = rows_at(p, column, row + SOON);
        if (y + AHEAD < h) {
            rows later = rows_at(p, column, row + AHEAD);
            fetch(later.u, w);
            fetch(later.v, w);
        }
        if (!classify(classes, &at, y + SOON < h ? &soon : NULL, w, c)) continue;
        int32_t first = 0, last = w;
        while (!classes[first]) first++;
        while (!classes[last - 1]) last--;
        if (first < found.x0) found.x0 = first;
        if (last > found.x1) found.x1 = last;
        if (y < found.y0) found.y0 = y;
        found.y1 = y + 1;
    }
    return found;
}

/* The part of a rectangle's classes, w cells wide, moved to the front of their memory; mask gets
   255 where there is a class. */
static void crop(uint8_t *classes, int32_t w, const box *part, uint8_t *mask) {
    int32_t wide = part->x1 - part->x0;
    uint8_t *to = classes;
    for (int32_t y = part->y0; y < part->y1; y++, to += wide, mask += wide) {
        const uint8_t *from = classes + (ptrdiff_t)y * w + part->x0;
        for (int32_t x = 0; x < wide; x++) {
            to[x] = from[x];
            mask[x] = from[x] ? 255 : 0;
        }
    }
}

/* Cells that touch a cell of a mask (w, h), corners included, taken out of it; returns their box.
   stack: as many numbers as the mask has cells. */
static box take_out(uint8_t *mask, int32_t w, int32_t h, int32_t first, int32_t *stack) {
    box at = {first % w, first / w, first % w + 1, first / w + 1};
    int32_t waiting = 1;
    stack[0] = first;
    mask[first] = 0;
    while (waiting) {
        int32_t cell = stack[--waiting], x = cell % w, y = cell / w;
        if (x < at.x0) at.x0 = x;
        if (x >= at.x1) at.x1 = x + 1;
        if (y < at.y0) at.y0 = y;
        if (y >= at.y1) at.y1 = y + 1;
        int32_t from = x ? x - 1 : 0, to = x < w - 1 ? x + 1 : x;
        for (int32_t v = y ? y - 1 : 0; v <= y + 1 && v < h; v++)
            for (int32_t u = from; u <= to; u++)
                if (mask[v * w + u]) {
                    mask[v * w + u] = 0;
                    stack[waiting++] = v * w + u;
                }
    }
    return at;
}

/* Counts the class of a patch; returns whether its box has others. */
static int is_mixed(patch *p, const uint8_t *classes, int32_t w) {
    const box *b = &p->at;
    int32_t none = 0, most = 0, own = 0;
    for (int32_t y = b->y0; y < b->y1; y++)
        for (int32_t x = b->x0; x < b->x1; x++) {
            int32_t class = classes[(ptrdiff_t)y * w + x];
            none += !class;
            if (class > most) most = class;
        }
    int32_t middle = classes[(ptrdiff_t)((b->y0 + b->y1) / 2) * w + (b->x0 + b->x1) / 2];
    p->class = middle ? middle : most;
    for (int32_t y = b->y0; y < b->y1; y++)
        for (int32_t x = b->x0; x < b->x1; x++)
            own += classes[(ptrdiff_t)y * w + x] == p->class;
    p->cells = own;
    return p->class && none + own < (b->x1 - b->x0) * (b->y1 - b->y0);
}

/* Whether one of two boxes lies within the other. */
static int is_nested(const box *a, const box *b) {
    return (a->x0 < b->x0 && a->y0 < b->y0 && a->x1 > b->x1 && a->y1 > b->y1) ||
           (b->x0 < a->x0 && b->y0 < a->y0 && b->x1 > a->x1 && b->y1 > a->y1);
}

/* The first cell of a mask from i on, size if none is. Most cells are none: eight at a time. */
static int32_t next_cell(const uint8_t *mask, int32_t i, int32_t size) {
    while (i < size && !mask[i])
        i += i % 8 == 0 && i + 8 <= size && !*(const eight *)(mask + i) ? 8 : 1;
    return i;
}

/* The patches of a mask (w, h) that is used up, into out; returns how many, or FOR_PYTHON. */
static int32_t patches_of(uint8_t *mask, const uint8_t *classes, int32_t w, int32_t h,
                          const options *o, int32_t *stack, patch *out) {
    int32_t count = 0, seen = 0, size = w * h;
    for (int32_t i = next_cell(mask, 0, size); i < size; i = next_cell(mask, i + 1, size)) {
        if (++seen > o->most) return FOR_PYTHON;
        patch found;
        found.at = take_out(mask, w, h, i, stack);
        if ((found.at.x1 - found.at.x0) * (found.at.y1 - found.at.y0) < o->min_cells) continue;
        if (is_mixed(&found, classes, w)) return FOR_PYTHON;
        for (int32_t n = 0; n < count; n++)
            if (is_nested(&out[n].at, &found.at)) return FOR_PYTHON;
        if (found.class && found.cells >= o->min_cells) out[count++] = found;
    }
    return count;
}

/* Patches of a rectangle of a picture into out; returns how many, or FOR_PYTHON.

   part: where in the rectangle there are colours, with o->margin around; all 0 where none are.
   memory: seven bytes for each cell of the rectangle (of a multiple of 8), aligned as numbers are.
   It begins with the opened mask of that part, row by row, 255 where a patch is. */
int32_t rhot_patches(const picture *p, const box *r, const colors *c, const options *o,
                     uint8_t *memory, int64_t bytes, box *part, patch *out) {
    if (!is_picture(p)) return BAD_PICTURE;
    if (r->x0 < p->left || r->y0 < p->top || r->x1 > p->right || r->y1 > p->bottom)
        return BAD_RECT;
    if (r->x0 >= r->x1 || r->y0 >= r->y1) return BAD_RECT;
    int32_t w = r->x1 - r->x0, h = r->y1 - r->y0;
    ptrdiff_t cells = (ptrdiff_t)w * h, padded = (cells + 7) / 8 * 8;
    if (bytes < 7 * (int64_t)padded || c->count < 1 || o->margin < 0) return BAD_SIZE;
    uint8_t *mask = memory, *classes = mask + padded, *spare = classes + padded;
    int32_t *stack = (int32_t *)(spare + padded);
    box found = classes_of(classes, p, r, c), none = {0, 0, 0, 0};
    *part = none;
    if (!found.y1) return 0;
    part->x0 = found.x0 > o->margin ? found.x0 - o->margin : 0;
    part->y0 = found.y0 > o->margin ? found.y0 - o->margin : 0;
    part->x1 = w - found.x1 > o->margin ? found.x1 + o->margin : w;
    part->y1 = h - found.y1 > o->margin ? found.y1 + o->margin : h;
    int32_t wide = part->x1 - part->x0, high = part->y1 - part->y0;
    crop(classes, w, part, mask);
    open_mask(mask, spare, (ptrdiff_t)wide * high, wide, o->rounds);
    for (ptrdiff_t i = 0; i < (ptrdiff_t)wide * high; i++) spare[i] = mask[i];
    return patches_of(spare, classes, wide, high, o, stack, out);
}
