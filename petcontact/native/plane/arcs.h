/* Both kernels over a circular arc (arcs.c), and what rings share with them. */

#ifndef PETCONTACT_ARCS_H
#define PETCONTACT_ARCS_H

#include "elements.h"

/* sin x/x and cos x for |x| <= π/2 by Taylor's series in x². */
INLINE void sine_of(Vector x, Vector *sinc, Vector *cos)
{
    const Vector square = x * x;
    *sinc = *cos = 1.0 + 0.0 * x;
    for (int k = 24; k > 0; k -= 2) {
        *cos = 1.0 - square * *cos * (1.0 / (k * (k - 1)));
        *sinc = 1.0 - square * *sinc * (1.0 / (k * (k + 1)));
    }
}

typedef struct { /* Gauss points on an element, and dx/ds there */
    int count;   /* 0 before they are known */
    double x[POINTS], y[POINTS], tx[POINTS], ty[POINTS];
} Sources;

INLINE void sources_of(const Element *e, int count, Sources *s)
{
    const double bend = e->arc ? e->arc->angle : 0.0, x = e->arc ? e->arc->middle[0] : 0.5 * (e->start[0] + e->end[0]),
                 y = e->arc ? e->arc->middle[1] : 0.5 * (e->start[1] + e->end[1]);
    s->count = count;
    for (int q = 0; q < count; q++) {
        /* (exp(iαs) - 1)/(iκ), without cancellation for flat arcs */
        const double xi = e->rule->gauss[count].s[q], b = 0.5 * bend * xi;
        Vector sinc, cos;
        sine_of(b + (Vector){0.0}, &sinc, &cos);
        const double sine = b * sinc[0], chord = e->half * xi * sinc[0], re = chord * cos[0], im = chord * sine;
        const double turn_re = e->half * (cos[0] * cos[0] - sine * sine), turn_im = e->half * 2.0 * sine * cos[0];
        s->x[q] = x + (e->tx * re - e->ty * im);
        s->y[q] = y + (e->tx * im + e->ty * re);
        s->tx[q] = e->tx * turn_re - e->ty * turn_im;
        s->ty[q] = e->tx * turn_im + e->ty * turn_re;
    }
}

/* What constant arcs miss of the slope of the displacement: bem.kelvin2d.integrals._add_slopes. */
INLINE void add_slopes(const Element *e, const Constants *c, const Targets *t, double *h01, double *h10)
{
    const double share = 0.34657359027997264 * (1.0 - 2.0 * c->nu) * c->scale;
    for (int i = 0; i < t->count; i++) {
        const double change = share * ((t->before[i] == e->index) - (t->after[i] == e->index));
        h01[i] += change;
        h10[i] -= change;
    }
}

void petcontact_arc_values(const Element *e, const Constants *c, const Targets *t, Wanted w, Values *v);

#endif
