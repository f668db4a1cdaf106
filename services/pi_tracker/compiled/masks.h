/* Masks of cells, and what all that look at them share. */

#ifndef RHOT_MASKS_H
#define RHOT_MASKS_H

#include "picture.h"

/* Cells of a rectangle, ends excluded. */
typedef struct {
    int32_t x0, y0, x1, y1;
} box;

/* Rounds of erosion by 2 x 2 cells, then of dilation that puts back what is left where it was, in
   place, as `opening` of image/morphology.py: rows of w cells run into each other. spare: memory
   like the mask's, so that no cell waits for another's. */
static void open_mask(uint8_t *mask, uint8_t *spare, ptrdiff_t size, ptrdiff_t w, int32_t rounds) {
    ptrdiff_t left = size;
    for (int32_t n = 0; n < rounds && left > 0; n++) {
        left -= w + 1;
        INDEPENDENT
        for (ptrdiff_t i = 0; i < left; i++)
            mask[i] = mask[i] & mask[i + 1] & mask[i + w] & mask[i + w + 1];
    }
    for (ptrdiff_t i = left > 0 ? left : 0; i < size; i++) mask[i] = 0;
    for (int32_t n = 0; n < rounds && left > 0; n++) {
        left += w + 1;
        spare[0] = mask[0];
        for (ptrdiff_t i = 1; i < w; i++) spare[i] = mask[i] | mask[i - 1];
        spare[w] = mask[w] | mask[w - 1] | mask[0];
        INDEPENDENT
        for (ptrdiff_t i = w + 1; i < left; i++)
            spare[i] = mask[i] | mask[i - 1] | mask[i - w] | mask[i - w - 1];
        for (ptrdiff_t i = 0; i < left; i++) mask[i] = spare[i];
    }
}

#endif
