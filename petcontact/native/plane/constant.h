/* Both kernels of plane strain over straight elements of order 0, in closed form at every distance.

   With d_1, d_2 the vectors from the end points to the target, a half the length, τ the tangent, h = d·τ⊥ the distance from
   the line on the left, ξ = (d_1 + d_2)·τ/2a, θ the angle from d_1 to d_2 and W = ln |d_1|²/|d_2|² (all from the
   antiderivatives of ln r, 1/r² and r r/r⁴ along the element):

       ∫ ln r ds     = a/2 [ln |d_1|² + ln |d_2|² + ξW + 2hθ/a - 4]
       ∫ r r/r² ds   = a I + a D(τ² (1 - hθ/a + ihW/2a))
       ∫ r·n/r² ds   = θ,    ∫ r·τ/r² ds = -W/2
       ∫ (2 r r/r² - I) r·n/r² ds = 2a h D(d_1 d_2)/(|d_1|² |d_2|²)

   where vectors are complex numbers and D(m) = [[Re m, Im m], [Im m, -Re m]]. */

#ifndef PETCONTACT_CONSTANT_H
#define PETCONTACT_CONSTANT_H

#include "elements.h"

typedef struct { /* squared distances of a chunk's targets from a point, and their logarithms */
    double square[CHUNK], log[CHUNK];
} Distances;

typedef struct { /* of both ends of an element, and which one is the start */
    Distances from[2];
    const double *end; /* of the element before, or null */
    int start;
} Ends;

/* A pair: from the ends to the target, then ξ, 2h/a, W and θ. */
typedef struct {
    double x1, y1, x2, y2, square_1, square_2, log_1, log_2;
    double offset, double_h, ratio, angle, along, across;
} Pair;

/* `on` is 0 where element and target lie on one line, else 1. */
INLINE void complete(const Element *e, double on, Pair *p)
{
    const double half = e->half, tx = e->tx, ty = e->ty, half_square = half * half, over = 1.0 / half;
    p->offset = ((p->x1 + p->x2) * tx + (p->y1 + p->y2) * ty) * (0.5 * over);
    const double from_1 = p->y1 * tx - p->x1 * ty, from_2 = p->y2 * tx - p->x2 * ty;
    const double nearest = p->square_1 < p->square_2 ? p->square_1 : p->square_2;
    /* Close to an end point the distance from the line has to come from the differences to that end. */
    const int by_second = (p->square_2 < p->square_1) & (p->square_2 < 0.01 * half_square);
    p->double_h = (by_second ? from_2 : from_1) * (2.0 * over) * on;
    const double more = 4.0 * half_square * fabs(p->offset);
    const double distant = twice_atanh(more / (2.0 * nearest + more)), close = fabs(p->log_1 - p->log_2);
    p->ratio = copysign(more < 0.41 * nearest ? distant : close, p->offset);
    p->along = p->x1 * p->x2;
    p->across = p->y1 * p->y2;
    p->angle = angle_of(p->double_h * half_square, p->along + p->across) * on;
}

INLINE void write_h(const Element *e, const Constants *c, const Pair *p, int k, Values *out)
{
    const double dipole = p->double_h * (-c->scale * e->half * e->half) / (p->square_1 * p->square_2);
    const double deviator = (p->along - p->across) * dipole;
    const double isotropic = p->angle * (-c->scale * (2.0 - 2.0 * c->nu));
    const double off = (p->x1 * p->y2 + p->x2 * p->y1) * dipole,
                 rotation = p->ratio * (0.5 * c->scale * (1.0 - 2.0 * c->nu));
    out->h00[k] = isotropic + deviator;
    out->h11[k] = isotropic - deviator;
    out->h01[k] = off + rotation;
    out->h10[k] = off - rotation;
}

INLINE void write_g(const Element *e, const Constants *c, const Pair *p, int k, Values *out)
{
    const double scale = c->scale * e->half * c->unit;
    const double turn_re = scale * (e->tx * e->tx - e->ty * e->ty), turn_im = scale * (2.0 * e->tx * e->ty);
    const double bend = p->angle * p->double_h, shear = p->double_h * p->ratio;
    const double sum = p->ratio * p->offset + p->log_1 + p->log_2 + bend;
    const double diagonal = sum * (-0.5 * c->factor * scale) + scale * (1.0 + 2.0 * c->factor * (1.0 + c->log_length));
    const double deviator = turn_re - bend * (0.5 * turn_re) - shear * (0.25 * turn_im);
    out->g01[k] = shear * (0.25 * turn_re) - bend * (0.5 * turn_im) + turn_im;
    out->g00[k] = diagonal + deviator;
    out->g11[k] = diagonal - deviator;
}

INLINE void distances_from(const double *point, const Targets *t, Distances *d)
{
    const double x = point[0], y = point[1];
#pragma GCC ivdep
    for (int k = 0; k < t->count; k++) {
        const double dx = t->x[k] - x, dy = t->y[k] - y;
        d->square[k] = dx * dx + dy * dy;
        d->log[k] = logarithm(d->square[k]);
    }
}

INLINE Pair pair_of(const Element *e, const Targets *t, int k)
{
    return (Pair){t->x[k] - e->start[0],
                  t->y[k] - e->start[1],
                  t->x[k] - e->end[0],
                  t->y[k] - e->end[1],
                  0.0,
                  0.0,
                  0.0,
                  0.0,
                  0.0,
                  0.0,
                  0.0,
                  0.0,
                  0.0,
                  0.0};
}

/* A node of the element itself: distances along it, the principal value. */
INLINE Pair own_pair(const Element *e, const Targets *t, int k)
{
    Pair p = pair_of(e, t, k);
    const double xi = t->xi[k], one = e->half * (1.0 + xi), two = e->half * (1.0 - xi);
    p.square_1 = one * one;
    p.square_2 = two * two;
    p.log_1 = logarithm(p.square_1);
    p.log_2 = logarithm(p.square_2);
    complete(e, 0.0, &p);
    const double more = 4.0 * e->half * e->half * fabs(xi), nearest = p.square_1 < p.square_2 ? p.square_1 : p.square_2;
    p.offset = xi;
    p.ratio = copysign(more < 0.41 * nearest ? twice_atanh(more / (2.0 * nearest + more)) : fabs(p.log_1 - p.log_2), xi);
    return p;
}

/* Neighbours share an end point, and with it the distances and logarithms to all targets: `ends` are those of the element
   before. */
INLINE void constant_values(const Element *e, const Constants *c, const Targets *t, Wanted w, Ends *ends, Values *out)
{
    const int chained = ends->end && e->start[0] == ends->end[0] && e->start[1] == ends->end[1];
    ends->start = chained ? 1 - ends->start : 0;
    Distances *one = ends->from + ends->start, *two = ends->from + 1 - ends->start;
    if (!chained)
        distances_from(e->start, t, one);
    distances_from(e->end, t, two);
    ends->end = e->end;
    int64_t own = 0;
#pragma GCC ivdep
    for (int k = 0; k < t->count; k++) {
        Pair p = pair_of(e, t, k);
        p.square_1 = one->square[k];
        p.square_2 = two->square[k];
        p.log_1 = one->log[k];
        p.log_2 = two->log[k];
        complete(e, t->line[k] == e->line ? 0.0 : 1.0, &p);
        own |= t->element[k] == e->index;
        if (w.h)
            write_h(e, c, &p, k, out);
        if (w.g)
            write_g(e, c, &p, k, out);
    }
    for (int k = 0; own && k < t->count; k++) {
        if (t->element[k] != e->index)
            continue;
        const Pair p = own_pair(e, t, k);
        if (w.h)
            write_h(e, c, &p, k, out);
        if (w.g)
            write_g(e, c, &p, k, out);
    }
}

#endif
