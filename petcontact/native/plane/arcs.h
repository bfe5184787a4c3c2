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

/* Taylor's series in x²: sin x/x, sinh x/x, cos x and cosh x for |x| < 2.5. */
INLINE double series_of(double square, int first)
{
    double sum = 1.0;
    for (int k = 28 + first; k > first; k -= 2)
        sum = 1.0 + square * sum / (double)(k * (k - 1));
    return sum;
}

INLINE double sinhc(double x)
{
    return series_of(x * x, 1);
}

/* ξ and h of a target as seen from a point of the arc and its tangent there: ln(1+u)/(iα), u = iκ (y - origin)/tangent. */
INLINE void preimage(const Arc *a, double dx, double dy, double tx, double ty, double *xi, double *h)
{
    const double re = -a->curvature * (dy * tx - dx * ty), im = a->curvature * (dx * tx + dy * ty);
    const double grown = 2.0 * re + (re * re + im * im), more = grown < -1.0 ? -1.0 : grown;
    const int small = (more < 0.4) & (more > -0.28);
    const double log = small ? twice_atanh(more / (2.0 + more)) : logarithm(1.0 + more);
    *xi = angle_of(im, 1.0 + re) / a->angle;
    *h = -0.5 * log / a->angle;
}

/* Coordinates of some targets, each accurate close to the ends of the arc. */
INLINE void preimages_of(const Element *e, const Targets *t, int from, int to, Local *p)
{
    const Arc *a = e->arc;
    const double c = a->turn[0], s = a->turn[1], tx = e->tx, ty = e->ty;
    for (int i = from; i < to; i++) {
        const double x = t->x[i], y = t->y[i];
        const int own = t->element[i] == e->index;
        double xi, h, left, h_left, right, h_right;
        preimage(a, x - a->middle[0], y - a->middle[1], tx, ty, &xi, &h);
        preimage(a, x - e->start[0], y - e->start[1], tx * c + ty * s, ty * c - tx * s, &left, &h_left);
        preimage(a, x - e->end[0], y - e->end[1], tx * c - ty * s, ty * c + tx * s, &right, &h_right);
        left = xi < 0.0 ? left : xi + 1.0;
        right = xi > 0.0 ? right : xi - 1.0;
        h = xi < -0.5 ? h_left : xi > 0.5 ? h_right : h;
        p->left[i] = own ? t->xi[i] + 1.0 : left;
        p->right[i] = own ? t->xi[i] - 1.0 : right;
        p->h[i] = own ? 0.0 : h;
        p->on_line[i] = own;
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
