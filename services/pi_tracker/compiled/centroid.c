/* Sub-pixel centroids of blobs: what services/pi_tracker/measure does, in one call for all blobs.

   Formulas, their reasons and their sources are in measure/centroid.py, paint_fraction.py and
   grown_blob.py, from where the constants come as well. A test compares both forms.

   Nothing of the C library is used and nothing is allocated: the caller owns all memory. Sizes and
   rectangles are checked before the first access; a call that returns less than 0 has touched
   nothing. Without -ffast-math and without fused operations results are the same on every
   machine. */

#include "grown.h"
#include "mixture.h"

/* x, y, area, sigma and quality of a blob. */
#define VALUES 5

/* What this was compiled from (hatch_build.py). */
#ifndef RHOT_DIGEST
#define RHOT_DIGEST ""
#endif
const char *const rhot_digest = RHOT_DIGEST;
/* Who calls has the same structures: their sizes are compared. */
const int32_t rhot_sizes[3] = {sizeof(picture), sizeof(constants), sizeof(blob)};

enum { BAD_BLOB = -2, BAD_MASKS = -3, BAD_SCRATCH = -4 };

typedef struct {
    double area, x, y;                     /* of the pixels' weights: sum, times x, times y */
    double var, var_x, var_y, var_squares; /* of the cells' variances; the last by x^2 + y^2 */
    double edge; /* as many cells as have weights that are neither 0 nor 1 */
} moments;

/* Between cells a ramp is linear: 3 parts of a pixel's own cell, 1 of its neighbour's. */
static inline float between(const float *near, const float *far, size_t own, size_t beside) {
    return 0.75f * (0.75f * near[own] + 0.25f * near[beside]) +
           0.25f * (0.75f * far[own] + 0.25f * far[beside]);
}

/* Adds the four pixels of cell (x, y), where a weight is at most 1. */
static void add_cell(moments *m, const tile *t, const shape *s, int32_t x, int32_t y) {
    size_t row = row_at(s, y), own = (size_t)x, wide = 2 * (size_t)s->row;
    /* Where a tile ends it goes on as it is. */
    size_t rows[2] = {y > 0 ? row - (size_t)s->row : row,
                      y < s->h - 1 ? row + (size_t)s->row : row};
    size_t columns[2] = {x > 0 ? own - 1 : own, x < s->w - 1 ? own + 1 : own};
    double weight[4], cell = 0.0, partly = 0.0;
    for (int i = 0; i < 4; i++) {
        float ramp[2];
        for (int part = 0; part < 2; part++) {
            const float *plane = t->plane[RAMP + part];
            ramp[part] = between(plane + row, plane + rows[i / 2], own, columns[i % 2]);
        }
        float luma = t->plane[LUMA][(2 * (size_t)y + (size_t)(i / 2)) * wide + 2 * own +
                                    (size_t)(i % 2)];
        float clipped = larger(smaller(ramp[1] * luma + ramp[0], 1.0f), 0.0f);
        weight[i] = clipped;
        cell += clipped;
        /* Where clipping holds the weight at 0 or 1, noise does not move it. */
        if (clipped > 0.0f && clipped < 1.0f) partly += 0.25;
    }
    m->area += cell;
    m->x += cell * (2 * x) + (weight[1] + weight[3]);
    m->y += cell * (2 * y) + (weight[2] + weight[3]);
    m->edge += partly;
    double variance = partly * t->plane[VARIANCE][row + own];
    m->var += variance;
    m->var_x += variance * x;
    m->var_y += variance * y;
    m->var_squares += variance * ((double)x * x + (double)y * y);
}

static moments weights(const tile *t, const shape *s) {
    moments m = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
    for (int32_t y = 0; y < s->h; y++) {
        const float *reach = t->plane[REACH] + row_at(s, y);
        for (int32_t x = 0; x < s->w; x++)
            if (reach[x] > 0.0f) add_cell(&m, t, s, x, y);
    }
    return m;
}

/* Distance of the paint's mean chroma per luma from the background's, in light. */
static double contrast(const tile *t, const constants *k) {
    double by = at_least(t->means[0][0], k->darkest), y = at_least(t->means[1][0], k->darkest);
    double u = t->means[1][1] / y - t->means[0][1] / by;
    double v = t->means[1][2] / y - t->means[0][2] / by;
    return __builtin_sqrt(u * u + v * v);
}

/* Standard deviation of a centroid (x, y) in its tile, px (measure/centroid_sigma.py). */
static double sigma_of(const moments *m, const constants *k, double area, double x, double y) {
    const double pi = 3.14159265358979323846;
    x = (x - 0.5) / 2.0;
    y = (y - 0.5) / 2.0;
    double about = m->var_squares - 2.0 * (x * m->var_x + y * m->var_y) + (x * x + y * y) * m->var;
    double noise = k->slope * __builtin_sqrt(32.0 * at_least(about, 0.0)) / area;
    double band = 4.0 * m->edge / (2.0 * pi * __builtin_sqrt(area / pi));
    double misfit = k->misfit_px + k->misfit_per_px * at_least(band - k->sharp_band_px, 0.0);
    return __builtin_sqrt(noise * noise + misfit * misfit);
}

static void conclude(double out[VALUES], const tile *t, const shape *s, const constants *k,
                     const picture *p, const blob *b) {
    moments m = weights(t, s);
    /* Of less than a pixel of paint the caller makes nothing. */
    double area = at_least(m.area, 1e-9), x = m.x / area, y = m.y / area;
    double sigma = sigma_of(&m, k, area, x, y);
    double box = (double)(b->right - b->left) * (double)(b->bottom - b->top);
    double fill = b->cells / (k->disc_fill * box), strength = contrast(t, k) / k->full_contrast;
    double quality = (fill < 1.0 ? fill : 1.0) * (strength < 1.0 ? strength : 1.0);
    if (b->left <= 0 || b->top <= 0 || b->right >= p->width || b->bottom >= p->height) {
        quality *= k->cut_quality;
        sigma += k->cut_sigma * __builtin_sqrt(area);
    }
    out[0] = 2.0 * s->left + x;
    out[1] = 2.0 * s->top + y;
    out[2] = m.area;
    out[3] = sigma;
    out[4] = quality;
}

/* Where a tile begins so that it lies in the picture. */
static int32_t placed(int32_t begin, int32_t last) {
    return begin < 0 ? 0 : begin > last ? last : begin;
}

/* The tile of a blob: its rectangle and MARGIN cells more. */
static shape tile_of(const blob *b, const picture *p) {
    shape s;
    s.w = b->right - b->left + 2 * MARGIN;
    s.h = b->bottom - b->top + 2 * MARGIN;
    if (s.w > p->width) s.w = p->width;
    if (s.h > p->height) s.h = p->height;
    s.left = placed(b->left - MARGIN, p->width - s.w);
    s.top = placed(b->top - MARGIN, p->height - s.h);
    /* A multiple of what a processor takes at a time. */
    s.row = (s.w + 2 * PAD + 3) / 4 * 4;
    s.size = (size_t)(s.h + 2 * PAD) * (size_t)s.row;
    return s;
}

/* Whether a blob lies in the picture and its tile in the window, however it grows. */
static int is_blob(const blob *b, const picture *p) {
    if (b->left < 0 || b->top < 0 || b->right > p->width || b->bottom > p->height) return 0;
    if (b->left >= b->right || b->top >= b->bottom) return 0;
    if (b->class < 0 || b->reach < 0 || b->reach > MOST_CELLS) return 0;
    blob grown = *b;
    if (b->class) {
        box window = window_of(b, p);
        if (window.x0 > b->left || window.y0 > b->top) return 0;
        if (window.x1 < b->right || window.y1 < b->bottom) return 0;
        grown.left = window.x0;
        grown.top = window.y0;
        grown.right = window.x1;
        grown.bottom = window.y1;
    }
    shape s = tile_of(&grown, p);
    return s.left >= p->left && s.top >= p->top && s.left + s.w <= p->right &&
           s.top + s.h <= p->bottom;
}

/* Asks for the pixels of a tile. */
static void fetch_tile(const shape *s, const picture *p) {
    for (int32_t y = s->top - p->top; y < s->top - p->top + s->h; y++) {
        ptrdiff_t left = s->left - p->left, chroma = (ptrdiff_t)y * p->row_chroma + left;
        const uint8_t *pixels = p->y + (ptrdiff_t)2 * y * p->row_y + 2 * left;
        fetch(pixels, (ptrdiff_t)2 * s->w);
        fetch(pixels + p->row_y, (ptrdiff_t)2 * s->w);
        fetch(p->u + chroma, s->w);
        fetch(p->v + chroma, s->w);
    }
}

/* Floats that take as much memory as it takes to grow a blob in a window of w x h cells. */
static int64_t growth_floats(int64_t w, int64_t h) { return GROWTH_MASKS * mask_bytes(w, h) / 4; }

/* Floats of scratch for a blob of w x h cells, those that it may grow into among them; less than 0
   if there is no such blob. */
int64_t rhot_centroid_scratch(int32_t w, int32_t h) {
    if (w < 1 || h < 1 || w > 3 * MOST_CELLS || h > 3 * MOST_CELLS) return BAD_BLOB;
    int64_t row = ((int64_t)w + 2 * MARGIN + 2 * PAD + 3) / 4 * 4;
    return PLANES * row * ((int64_t)h + 2 * MARGIN + 2 * PAD) + growth_floats(w, h);
}

/* What is wrong with the arguments of rhot_centroids; 0 if nothing is. */
static int32_t check(const picture *p, const colors *near, int32_t count, const blob *blobs,
                     int64_t masks_size, int64_t scratch_size) {
    if (!is_picture(p)) return BAD_PICTURE;
    for (int32_t n = 0; n < count; n++) {
        const blob *b = &blobs[n];
        if (!is_blob(b, p) || (b->class && !(near && near->count > 0))) return BAD_BLOB;
        int32_t w = b->right - b->left, h = b->bottom - b->top, around = b->class ? b->reach : 0;
        masks_size -= (int64_t)w * h;
        if (masks_size < 0) return BAD_MASKS;
        if (rhot_centroid_scratch(w + 2 * around, h + 2 * around) > scratch_size)
            return BAD_SCRATCH;
    }
    return 0;
}

/* Measures blobs into out, VALUES doubles each. near: the colours into which they grow, or NULL.
   masks are those of their rectangles, one behind the other, not 0 where the blob is; noise is a
   cell's standard deviation in luma and in chroma. scratch: aligned as its floats are. */
int32_t rhot_centroids(const picture *p, const constants *k, const double noise[2],
                       const colors *near, int32_t count, const blob *blobs, const uint8_t *masks,
                       int64_t masks_size, float *scratch, int64_t scratch_size, double *out) {
    int32_t wrong = check(p, near, count, blobs, masks_size, scratch_size);
    for (int32_t n = 0; n < count && !wrong; n++) {
        blob b = blobs[n];
        int32_t w = b.right - b.left, h = b.bottom - b.top;
        blob_mask mask = {masks, w};
        masks += (size_t)w * (size_t)h;
        float *memory = scratch;
        if (b.class) {
            box window = window_of(&b, p);
            grow(&b, &mask, p, near, (uint8_t *)scratch);
            memory += growth_floats(window.x1 - window.x0, window.y1 - window.y0);
        }
        shape s = tile_of(&b, p);
        if (n + 1 < count) {
            shape next = tile_of(&blobs[n + 1], p);
            fetch_tile(&next, p);
        }
        tile t;
        for (size_t i = 0; i < PLANES; i++) t.plane[i] = memory + i * s.size;
        for (size_t i = 0; i < CLEARED * s.size; i++) memory[i] = 0.0f;
        read_picture(&t, &s, p, k);
        read_masks(&t, &s, k, &b, mask.cells, mask.row);
        mix(&t, &s, k, BY_MASK, 1);
        purify(&t, &s, k);
        mix(&t, &s, k, PURE, 0);
        unmix(&t, &s, k, noise);
        conclude(out + (size_t)n * VALUES, &t, &s, k, p, &b);
    }
    return wrong;
}
