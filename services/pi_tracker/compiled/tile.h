/* The surroundings of one blob: its levels, its light and its masks, in the caller's memory.

   A plane of a tile has h rows of `row` floats, in which w cells lie. PAD cells around them are 0,
   so that windows need not know where a tile ends. */

#ifndef RHOT_TILE_H
#define RHOT_TILE_H

#include "picture.h"

/* Cells around a blob that are looked at, and how far windows of five cells reach. */
#define MARGIN 2
#define PAD 2

/* Tuned in measure/centroid.py, centroid_sigma.py and paint_fraction.py, which say on what. */
typedef struct {
    double misfit_px, misfit_per_px, sharp_band_px, darkest, full_contrast;
    double cut_sigma, cut_quality, disc_fill;
    float rgb[9], yuv_from_power[9], power_slopes[9]; /* row by row */
    float blur[2];                                    /* of the middle, of a neighbour */
    float fallback, mask_only, background_below, paint_above, paint_band, slope, min_core_cells;
} constants;

typedef struct {
    int32_t left, top, right, bottom; /* cells of the picture */
    int32_t cells;                    /* of its colour */
    /* How it grows (grown.h): its colour from 1, or 0 if it does not; how many cells it may have;
       how many around it are looked at. */
    int32_t class, most, reach;
} blob;

typedef struct {
    int32_t w, h, row;
    int32_t left, top; /* its first cell in the picture */
    size_t size;       /* floats of a plane */
} shape;

/* Planes of a tile. Those up to CLEARED must be 0 where nothing is written. */
enum {
    MASK,                /* the blob, 0 or 1 */
    REACH,               /* a cell larger: what may have any weight */
    BAND,                /* two cells larger: what may be pure background */
    BY_MASK,             /* what the mask takes for pure: background, paint */
    KNOWN = BY_MASK + 2, /* Y, U, V and 1 times weights: of background, of paint */
    ROWS = KNOWN + 8,    /* half of a window's work */
    CLEARED,
    LUMA = CLEARED,       /* Y - 16 of pixels, in rows of 2 row floats */
    CELL_LUMA = LUMA + 4, /* Y - 16 of cells */
    LIGHT,                /* Y, U, V of linear light */
    ROOT = LIGHT + 3,     /* of R, G, B: square roots */
    PURE = ROOT + 3,      /* weights as pure background, as pure paint */
    NEAR = PURE + 2,      /* windows over KNOWN */
    FINER = NEAR + 8,     /* smaller windows over the paint's Y and 1 */
    SHARE = FINER + 2,    /* derivatives of the paint's luma by U, by V */
    BY_LUMA = SHARE + 2,  /* the same by Y, negative */
    PAINT_LUMA,           /* luma that the paint contributes */
    Y_BACKGROUND,
    Y_PAINT, /* luma of what is pure, near each cell */
    VARIANCE,
    RAMP, /* a pixel's weight without luma, and by luma */
    PLANES = RAMP + 2
};

typedef struct {
    float *plane[PLANES];
    double means[2][3]; /* Y, U, V of pure background, of pure paint */
} tile;

static inline float larger(float a, float b) { return a > b ? a : b; }
static inline float smaller(float a, float b) { return a < b ? a : b; }
static inline double at_least(double a, double least) { return a > least ? a : least; }

/* Where row y of cells begins in a plane. */
static inline size_t row_at(const shape *s, int32_t y) {
    return (size_t)(y + PAD) * (size_t)s->row + PAD;
}

static void read_luma(float *to, const uint8_t *from, int32_t count, const uint8_t *levels) {
    if (levels)
        for (int32_t x = 0; x < count; x++) to[x] = (float)levels[from[x]] - 16.0f;
    else
        for (int32_t x = 0; x < count; x++) to[x] = (float)from[x] - 16.0f;
}

static void read_chroma(float *to, const uint8_t *from, int32_t count, const uint8_t *levels) {
    if (levels)
        for (int32_t x = 0; x < count; x++) to[x] = (float)levels[from[x]] - 128.0f;
    else
        for (int32_t x = 0; x < count; x++) to[x] = (float)from[x] - 128.0f;
}

/* Linear light of a row of cells from Y, U, V as encoded (class LinearLight). */
static void decode(const tile *t, const shape *s, const constants *k, size_t at, const float *luma,
                   const float *u, const float *v) {
    const float *m = k->rgb, *n = k->yuv_from_power;
    float *r = t->plane[ROOT] + at, *g = t->plane[ROOT + 1] + at, *b = t->plane[ROOT + 2] + at;
    float *ly = t->plane[LIGHT] + at, *lu = t->plane[LIGHT + 1] + at;
    float *lv = t->plane[LIGHT + 2] + at;
    INDEPENDENT
    for (int32_t x = 0; x < s->w; x++) {
        float red = m[0] * luma[x] + m[1] * u[x] + m[2] * v[x];
        float green = m[3] * luma[x] + m[4] * u[x] + m[5] * v[x];
        float blue = m[6] * luma[x] + m[7] * u[x] + m[8] * v[x];
        /* Noise may be negative. */
        float root_r = __builtin_sqrtf(__builtin_fabsf(red));
        float root_g = __builtin_sqrtf(__builtin_fabsf(green));
        float root_b = __builtin_sqrtf(__builtin_fabsf(blue));
        red *= root_r;
        green *= root_g;
        blue *= root_b;
        r[x] = root_r;
        g[x] = root_g;
        b[x] = root_b;
        ly[x] = n[0] * red + n[1] * green + n[2] * blue;
        lu[x] = n[3] * red + n[4] * green + n[5] * blue;
        lv[x] = n[6] * red + n[7] * green + n[8] * blue;
    }
}

static void read_picture(const tile *t, const shape *s, const picture *p, const constants *k) {
    size_t wide = 2 * (size_t)s->row;
    int32_t left = s->left - p->left, top = s->top - p->top;
    for (int32_t y = 0; y < s->h; y++) {
        float *over = t->plane[LUMA] + 2 * (size_t)y * wide, *under = over + wide;
        const uint8_t *pixels = p->y + (ptrdiff_t)2 * (top + y) * p->row_y + (ptrdiff_t)2 * left;
        read_luma(over, pixels, 2 * s->w, p->luma_levels);
        read_luma(under, pixels + p->row_y, 2 * s->w, p->luma_levels);
        size_t at = row_at(s, y);
        float *luma = t->plane[CELL_LUMA] + at;
        INDEPENDENT
        for (int32_t x = 0; x < s->w; x++)
            luma[x] = 0.25f * ((over[2 * x] + over[2 * x + 1]) + (under[2 * x] + under[2 * x + 1]));
        ptrdiff_t first = (ptrdiff_t)(top + y) * p->row_chroma + left;
        /* Chroma as encoded is of no use later. */
        float *u = t->plane[NEAR] + at, *v = t->plane[NEAR + 1] + at;
        read_chroma(u, p->u + first, s->w, p->chroma_levels);
        read_chroma(v, p->v + first, s->w, p->chroma_levels);
        decode(t, s, k, at, luma, u, v);
    }
}

/* The largest of 3 x 3 cells, beyond the tile 0. */
static void dilate(float *to, const float *from, const shape *s) {
    for (int32_t y = 0; y < s->h; y++) {
        const float *m = from + row_at(s, y), *u = m - s->row, *d = m + s->row;
        float *out = to + row_at(s, y);
        INDEPENDENT
        for (int32_t x = 0; x < s->w; x++)
            out[x] = larger(larger(larger(larger(u[x - 1], u[x]), larger(u[x + 1], m[x - 1])),
                                   larger(larger(m[x], m[x + 1]), larger(d[x - 1], d[x]))),
                            d[x + 1]);
    }
}

/* The least of 3 x 3 cells of a mask; how many are left. */
static int64_t erode(float *to, const float *from, const shape *s) {
    int64_t left = 0;
    for (int32_t y = 0; y < s->h; y++) {
        const float *m = from + row_at(s, y), *u = m - s->row, *d = m + s->row;
        float *out = to + row_at(s, y);
        for (int32_t x = 0; x < s->w; x++) {
            float all = u[x - 1] * u[x] * u[x + 1] * m[x - 1] * m[x] * m[x + 1] * d[x - 1] * d[x] *
                        d[x + 1];
            out[x] = all;
            left += all > 0.0f;
        }
    }
    return left;
}

/* The blob's mask, that of its rectangle in rows of `row` bytes, and what follows from it. */
static void read_masks(const tile *t, const shape *s, const constants *k, const blob *b,
                       const uint8_t *mask, int32_t row) {
    size_t w = (size_t)(b->right - b->left);
    for (int32_t y = b->top; y < b->bottom; y++) {
        float *to = t->plane[MASK] + row_at(s, y - s->top) + (b->left - s->left);
        const uint8_t *from = mask + (ptrdiff_t)(y - b->top) * row;
        for (size_t x = 0; x < w; x++) to[x] = from[x] ? 1.0f : 0.0f;
    }
    dilate(t->plane[REACH], t->plane[MASK], s);
    dilate(t->plane[BAND], t->plane[REACH], s);
    int64_t core = erode(t->plane[BY_MASK + 1], t->plane[MASK], s);
    const float *paint = core < k->min_core_cells ? t->plane[MASK] : t->plane[BY_MASK + 1];
    for (size_t i = 0; i < s->size; i++) {
        t->plane[BY_MASK][i] = t->plane[BAND][i] - t->plane[REACH][i];
        t->plane[BY_MASK + 1][i] = paint[i];
    }
}

#endif
