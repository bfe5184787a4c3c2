/* Elements of generating curves, where targets lie beside them, and rules of quadrature by distance. */

#ifndef PETCONTACT_REVOLUTION_ELEMENTS_H
#define PETCONTACT_REVOLUTION_ELEMENTS_H

#include "../plane/arcs.h"
#include "ring.h"

enum { MOST = 64, RULES = 12 }; /* points of a rule of one dimension, and rules by distance, at most */

typedef struct { /* bem.revolution.compiled fills it, numbers all double */
    double rules[NODES], points[NODES][RULES], sum[NODES][RULES]; /* by order: Gauss points, and (|z+1| + |z-1|)/2 from which on
                                                                     they are enough; the most points first */
    double own, near, slope, rest;                                /* see `panel_of` */
    double gauss[MOST + 1][2][MOST];                              /* points in (0, 1) and weights, by their number */
} Quadrature;

typedef struct { /* elements of a plane and what rings add */
    Elements plane;
    const int64_t *least; /* (e,): Gauss points that resolve the element itself */
    const Quadrature *quadrature;
    int64_t d; /* 3 with torsion, else 2 */
} Curve;

typedef struct { /* a target beside an element: ξ+1, ξ-1, distance on the left [length], and those of the ends over the half */
    double left, right, lift, from_start, from_end;
    int own;
} Place;

/* Arc length over the half and distance on the left of a target at (dx, dy) from a point of the element with the tangent
   (tx, ty) there. */
INLINE void beside(const Element *e, double dx, double dy, double tx, double ty, double *along, double *lift)
{
    const double t = dx * tx + dy * ty, n = dy * tx - dx * ty, bend = e->arc ? e->arc->curvature : 0.0;
    const double more = bend * (dx * dx + dy * dy) - 2.0 * n; /* (ρ² - 1)/κ, ρ the distance from the centre in radii */
    const double rho = sqrt(fmax(1.0 + bend * more, 0.0));
    *lift = -more / (1.0 + rho);
    *along = (e->arc ? angle_of(bend * t, 1.0 - bend * n) / bend : t) / e->half;
}

INLINE Place place_of(const Element *e, double x, double y, int own, double xi)
{
    const double ax = x - e->start[0], ay = y - e->start[1], bx = x - e->end[0], by = y - e->end[1];
    const double c = e->arc ? e->arc->turn[0] : 1.0, s = e->arc ? e->arc->turn[1] : 0.0, tx = e->tx, ty = e->ty;
    double left, right, a, b;
    beside(e, ax, ay, tx * c + ty * s, ty * c - tx * s, &left, &a);
    beside(e, bx, by, tx * c - ty * s, ty * c + tx * s, &right, &b);
    const double from_start = sqrt(ax * ax + ay * ay) / e->half, from_end = sqrt(bx * bx + by * by) / e->half;
    /* each coordinate from the nearer end, unless it is a whole arc away */
    const int first = from_start < from_end;
    return (Place){
        .left = own ? xi + 1.0 : first ? left : right + 2.0,
        .right = own ? xi - 1.0 : first ? left - 2.0 : right,
        .lift = own ? 0.0 : first ? a : b,
        .from_start = from_start,
        .from_end = from_end,
        .own = own,
    };
}

/* (|z+1| + |z-1|)/2 of a target in the element's own coordinate z, in which the kernels are analytic around the element. */
INLINE double half_sum(const Element *e, double x, double y)
{
    if (!e->arc) {
        const double ax = x - e->start[0], ay = y - e->start[1], bx = x - e->end[0], by = y - e->end[1];
        return 0.5 * (sqrt(ax * ax + ay * ay) + sqrt(bx * bx + by * by)) / e->half;
    }
    double xi, lift;
    beside(e, x - e->arc->middle[0], y - e->arc->middle[1], e->tx, e->ty, &xi, &lift);
    const double h = logarithm(fmax(1.0 - e->arc->curvature * lift, 1e-300)) / e->arc->angle, square = h * h;
    return 0.5 * (sqrt((xi + 1.0) * (xi + 1.0) + square) + sqrt((xi - 1.0) * (xi - 1.0) + square));
}

typedef struct { /* points of a panel of quadrature: s - ξ and weights, filled up to whole vectors with nothing */
    int count;
    double offset[MOST + LANES], weight[MOST + LANES];
} Panel;

/* What is left of rings less planes behaves like ln|s-ξ| on the element itself: fifth powers of the points of Gauss; near it the
   sinh of them, `scale` being the distance over half the length. */
INLINE Panel panel_of(const Quadrature *q, int order, double base, double side, double from, double to, double scale, int own)
{
    Panel p;
    const double size = to - from, reach = area_sinh(to / scale), wanted = ceil(q->near + order + q->slope * reach);
    const int first = from == 0.0, n = (int)(!first ? q->rest : own ? q->own : wanted < MOST ? wanted : MOST);
    const double *x = q->gauss[n][0], *w = q->gauss[n][1];
    p.count = n;
    if (!first)
        for (int i = 0; i < n; i++) {
            p.offset[i] = base + side * (from + size * x[i]);
            p.weight[i] = size * w[i];
        }
    else if (own)
        for (int i = 0; i < n; i++) {
            const double fourth = x[i] * x[i] * (x[i] * x[i]);
            p.offset[i] = base + side * size * x[i] * fourth;
            p.weight[i] = 5.0 * size * w[i] * fourth;
        }
    else
        for (int i = 0; i < n; i++) {
            const double grown = power_of_e(reach * x[i]), shrunk = 1.0 / grown;
            p.offset[i] = base + side * (0.5 * scale * (grown - shrunk));
            p.weight[i] = 0.5 * scale * reach * w[i] * (grown + shrunk);
        }
    for (int i = n; i < n + LANES; i++) {
        p.offset[i] = p.offset[n - 1];
        p.weight[i] = 0.0;
    }
    return p;
}

/* The ring at s - ξ = `offset` as seen from the target, without differences of coordinates. */
INLINE void ring_at(const Element *e, const Place *p, double r, Vector offset, Rings *ring)
{
    const Vector size = e->half * offset, none = {0.0};
    Vector t = size, n = p->lift + none, tx = e->tx + none, ty = e->ty + none;
    if (e->arc) {
        const double bend = e->arc->angle;
        Vector sinc, cos, turn_sinc, turn_cos;
        sine_of((0.5 * bend) * offset, &sinc, &cos);
        const Vector half_sine = (0.5 * bend) * offset * sinc, sine = 2.0 * half_sine * cos;
        t = size * sinc * cos - p->lift * sine;
        n = size * half_sine * sinc + p->lift * (1.0 - 2.0 * half_sine * half_sine);
        const Vector turn = bend * (0.5 * (p->left + p->right) + offset);
        sine_of(turn, &turn_sinc, &turn_cos);
        tx = e->tx * turn_cos - e->ty * turn * turn_sinc;
        ty = e->ty * turn_cos + e->tx * turn * turn_sinc;
    }
    ring->nr = ty;
    ring->nz = -tx;
    ring->dn = n;
    ring->dr = t * tx + n * ty;
    ring->dz = t * ty - n * tx;
    ring->r = r + none;
    ring->radius = r + ring->dr;
}

#endif
