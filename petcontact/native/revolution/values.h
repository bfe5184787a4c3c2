/* Both kernels of rings over one element at the targets of a chunk. */

#ifndef PETCONTACT_REVOLUTION_VALUES_H
#define PETCONTACT_REVOLUTION_VALUES_H

#include "elements.h"

typedef struct { /* of one node of an element at each target: RR, RZ, ZR, ZZ, TT */
    double g[KINDS][CHUNK], h[KINDS][CHUNK];
} RingValues;

/* `least` Gauss points resolve the element itself. */
void petcontact_ring_values(const Quadrature *a, const Element *e, int least, const Constants *c, const Targets *t, Wanted w,
                            RingValues *v);

#endif
