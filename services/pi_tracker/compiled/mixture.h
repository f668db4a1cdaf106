/* Linear unmixing, cell by cell: what measure/paint_fraction.py does, and why. */

#ifndef RHOT_MIXTURE_H
#define RHOT_MIXTURE_H

#include "tile.h"

/* Over a run of floats: a middle and two neighbours `step` apart, each with its weight. */
static void three(float *to, const float *from, size_t count, ptrdiff_t step, float middle,
                  float side) {
    INDEPENDENT
    for (ptrdiff_t i = 0; i < (ptrdiff_t)count; i++)
        to[i] = side * (from[i - step] + from[i + step]) + middle * from[i];
}

static void five(float *to, const float *from, size_t count, ptrdiff_t step) {
    INDEPENDENT
    for (ptrdiff_t i = 0; i < (ptrdiff_t)count; i++)
        to[i] = 0.2f * (((from[i - 2 * step] + from[i - step]) + from[i]) +
                        (from[i + step] + from[i + 2 * step]));
}

/* Windows over a whole plane: along rows, then along columns. Padding beside the rows fills with
   sums that nobody reads; that above and below stays 0. */
static void window3(const tile *t, const shape *s, int to, int from, float middle, float side) {
    size_t begin = (size_t)PAD * (size_t)s->row, count = (size_t)s->h * (size_t)s->row;
    three(t->plane[ROWS] + begin, t->plane[from] + begin, count, 1, middle, side);
    three(t->plane[to] + begin, t->plane[ROWS] + begin, count, s->row, middle, side);
}

static void window5(const tile *t, const shape *s, int to, int from) {
    size_t begin = (size_t)PAD * (size_t)s->row, count = (size_t)s->h * (size_t)s->row;
    five(t->plane[ROWS] + begin, t->plane[from] + begin, count, 1);
    five(t->plane[to] + begin, t->plane[ROWS] + begin, count, s->row);
}

/* Light times the weights of one kind, with its mean faintly everywhere in the tile. */
static void weigh(tile *t, const shape *s, const constants *k, int kind, const float *weights) {
    float *const *known = t->plane + KNOWN + 4 * kind;
    double sums[4] = {0.0, 0.0, 0.0, 0.0};
    for (int32_t y = 0; y < s->h; y++) {
        size_t at = row_at(s, y);
        const float *luma = t->plane[LIGHT] + at, *u = t->plane[LIGHT + 1] + at;
        const float *v = t->plane[LIGHT + 2] + at, *w = weights + at;
        float *ly = known[0] + at, *lu = known[1] + at, *lv = known[2] + at, *lw = known[3] + at;
        INDEPENDENT
        for (int32_t x = 0; x < s->w; x++) {
            ly[x] = luma[x] * w[x];
            lu[x] = u[x] * w[x];
            lv[x] = v[x] * w[x];
            lw[x] = w[x];
        }
        /* Each in its order, but not one after the other. */
        float sum_y = 0.0f, sum_u = 0.0f, sum_v = 0.0f, sum_w = 0.0f;
        for (int32_t x = 0; x < s->w; x++) {
            sum_y += ly[x];
            sum_u += lu[x];
            sum_v += lv[x];
            sum_w += lw[x];
        }
        sums[0] += sum_y;
        sums[1] += sum_u;
        sums[2] += sum_v;
        sums[3] += sum_w;
    }
    for (int c = 0; c < 4; c++) {
        float mean = c < 3 ? (float)(sums[c] / at_least(sums[3], 1e-6)) : 1.0f;
        float faint = k->fallback * mean;
        if (c < 3) t->means[kind][c] = mean;
        for (int32_t y = 0; y < s->h; y++) {
            float *to = known[c] + row_at(s, y);
            for (int32_t x = 0; x < s->w; x++) to[x] += faint;
        }
    }
}

/* Paint and background around every cell, given the weights of pure cells (class Mixture). */
static void mix(tile *t, const shape *s, const constants *k, int weights, int rough) {
    const float third = (float)(1.0 / 3.0);
    for (int kind = 0; kind < 2; kind++) weigh(t, s, k, kind, t->plane[weights + kind]);
    for (int c = 0; c < 4; c++) {
        window3(t, s, NEAR + c, KNOWN + c, k->blur[0], k->blur[1]);
        window5(t, s, NEAR + 4 + c, KNOWN + 4 + c);
    }
    if (!rough) {
        window3(t, s, FINER, KNOWN + 4, third, third);
        window3(t, s, FINER + 1, KNOWN + 7, third, third);
    }
    for (int32_t y = 0; y < s->h; y++) {
        size_t at = row_at(s, y);
        const float *y_b = t->plane[NEAR] + at, *u_b = t->plane[NEAR + 1] + at;
        const float *v_b = t->plane[NEAR + 2] + at, *w_b = t->plane[NEAR + 3] + at;
        const float *y_p = t->plane[NEAR + 4] + at, *u_p = t->plane[NEAR + 5] + at;
        const float *v_p = t->plane[NEAR + 6] + at, *w_p = t->plane[NEAR + 7] + at;
        const float *fine_y = t->plane[rough ? NEAR + 4 : FINER] + at;
        const float *fine_w = t->plane[rough ? NEAR + 7 : FINER + 1] + at;
        const float *luma = t->plane[LIGHT] + at, *u = t->plane[LIGHT + 1] + at;
        const float *v = t->plane[LIGHT + 2] + at;
        float *background = t->plane[Y_BACKGROUND] + at, *paint = t->plane[Y_PAINT] + at;
        float *by_u = t->plane[SHARE] + at, *by_v = t->plane[SHARE + 1] + at;
        float *by_luma = t->plane[BY_LUMA] + at, *paint_luma = t->plane[PAINT_LUMA] + at;
        INDEPENDENT
        for (int32_t x = 0; x < s->w; x++) {
            float bright_b = larger(y_b[x], w_b[x]), bright_p = larger(y_p[x], w_p[x]);
            float s_u = u_b[x] / bright_b, s_v = v_b[x] / bright_b;
            float d_u = u_p[x] / bright_p - s_u, d_v = v_p[x] / bright_p - s_v;
            float norm = larger(d_u * d_u + d_v * d_v, 1e-6f);
            d_u /= norm;
            d_v /= norm;
            float per_luma = s_u * d_u + s_v * d_v;
            background[x] = bright_b / w_b[x];
            paint[x] = larger(fine_y[x], fine_w[x]) / fine_w[x];
            by_u[x] = d_u;
            by_v[x] = d_v;
            by_luma[x] = per_luma;
            paint_luma[x] = (u[x] * d_u + v[x] * d_v) - luma[x] * per_luma;
        }
    }
}

/* The weights of the second round from the paint fraction of the first. */
static void purify(const tile *t, const shape *s, const constants *k) {
    float falling = -1.0f / k->background_below, rising = 1.0f / k->paint_band;
    float offset = -k->paint_above / k->paint_band;
    for (int32_t y = 0; y < s->h; y++) {
        size_t at = row_at(s, y);
        const float *light = t->plane[LIGHT] + at, *paint_luma = t->plane[PAINT_LUMA] + at;
        const float *y_b = t->plane[Y_BACKGROUND] + at, *y_p = t->plane[Y_PAINT] + at;
        const float *band = t->plane[BAND] + at, *mask = t->plane[MASK] + at;
        const float *by_ring = t->plane[BY_MASK] + at, *by_core = t->plane[BY_MASK + 1] + at;
        float *background = t->plane[PURE] + at, *painted = t->plane[PURE + 1] + at;
        INDEPENDENT
        for (int32_t x = 0; x < s->w; x++) {
            float paint = larger(paint_luma[x], 0.0f) / y_p[x];
            float behind = larger(light[x] - paint_luma[x], 0.0f) / y_b[x];
            float fraction = paint / larger(behind + paint, 0.05f);
            background[x] = larger(smaller(fraction * falling + 1.0f, band[x]),
                                   by_ring[x] * k->mask_only);
            painted[x] = larger(smaller(fraction * rising + offset, mask[x]),
                                by_core[x] * k->mask_only);
        }
    }
}

/* The paint fraction as it follows a pixel's luma, and its variance for a cell's noise. */
static void unmix(const tile *t, const shape *s, const constants *k, const double noise[2]) {
    float of_luma = (float)(noise[0] * noise[0]), of_chroma = (float)(noise[1] * noise[1]);
    float lift = 0.5f - 0.5f * k->slope;
    const float *m = k->power_slopes, *r = k->rgb;
    for (int32_t y = 0; y < s->h; y++) {
        size_t at = row_at(s, y);
        const float *light = t->plane[LIGHT] + at, *luma = t->plane[CELL_LUMA] + at;
        const float *root_r = t->plane[ROOT] + at, *root_g = t->plane[ROOT + 1] + at;
        const float *root_b = t->plane[ROOT + 2] + at, *paint_luma = t->plane[PAINT_LUMA] + at;
        const float *y_b = t->plane[Y_BACKGROUND] + at, *y_p = t->plane[Y_PAINT] + at;
        const float *d_u = t->plane[SHARE] + at, *d_v = t->plane[SHARE + 1] + at;
        const float *per_luma = t->plane[BY_LUMA] + at;
        float *variance = t->plane[VARIANCE] + at;
        float *base = t->plane[RAMP] + at, *steep = t->plane[RAMP + 1] + at;
        INDEPENDENT
        for (int32_t x = 0; x < s->w; x++) {
            float norm = y_p[x] * y_p[x] + y_b[x] * y_b[x];
            float behind = y_b[x] / norm, both = y_p[x] / norm + behind;
            float fraction = both * paint_luma[x] + behind * (y_b[x] - light[x]);
            float by_u = d_u[x] * both, by_v = d_v[x] * both;
            float by_y = -(both * per_luma[x] + behind);
            float red = (m[0] * by_y + m[1] * by_u + m[2] * by_v) * root_r[x];
            float green = (m[3] * by_y + m[4] * by_u + m[5] * by_v) * root_g[x];
            float blue = (m[6] * by_y + m[7] * by_u + m[8] * by_v) * root_b[x];
            float on_y = r[0] * red + r[3] * green + r[6] * blue;
            float on_u = r[1] * red + r[4] * green + r[7] * blue;
            float on_v = r[2] * red + r[5] * green + r[8] * blue;
            variance[x] = (on_u * on_u + on_v * on_v) * of_chroma + on_y * on_y * of_luma;
            steep[x] = on_y * k->slope;
            base[x] = (fraction * k->slope + lift) - on_y * k->slope * luma[x];
        }
    }
}

#endif
