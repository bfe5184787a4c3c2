/* Kernels of rings summed over one element at targets: Gauss quadrature from afar, and points that crowd about a near target. */

#ifndef PETCONTACT_RING_SUMS_H
#define PETCONTACT_RING_SUMS_H

#include "ring.h"

enum { MOST = 64, RULES = 12, ALL = 2 * STRESSES }; /* points of a rule, rules by distance, components, at most */
static const double NEAREST = 1e-10;                /* of half an element: as near as points crowd */
/* Panels: the first reaches half way to the target's image behind the axis and turns by TURNED radians at most, those beyond it
   grow by GROWTH. With these 1 of 100 of 4000 random pairs was off by 8e-10 or more at 1e-9, the worst one by 4e-9; with 0.75,
   4 and the whole way 1e-8 and 3e-7. */
static const double TURNED = 0.5, GROWTH = 3.0;

typedef struct {                                                  /* bem.revolution.compiled fills it, numbers all double */
    double rules[NODES], points[NODES][RULES], sum[NODES][RULES]; /* by order: Gauss points, the most first; |z+1| + |z-1| */
    double own, near, slope, rest;                                /* points of panels, see `add_panel` */
    double gauss[MOST + 1][2][MOST]; /* points in (0, 1) and weights, by their number, then any */
} Quadrature;

typedef struct {       /* what is summed over which element: both kernels of stress, or those of u */
    int stress, kinds; /* components of both kernels */
    double unit[2];    /* of each kernel */
    const Quadrature *quadrature;
    const Element *element;
    const Constants *constants;
} Sum;

typedef struct { /* a target beside an element: ξ+1, ξ-1, distance on the left over half the length, radius */
    double left, right, lift, r;
    int own;
} Place;

/* From near without what the plane's kernels have, which are integrated in closed form: the rest is bounded but for a logarithm
   in T. Quadrature of the whole kernels of stress keeps the digits that closed forms would: see bem.revolution.compiled. */
INLINE void kernels_of(Sum a, const Rings *p, int near, Vector *value)
{
    if (a.stress)
        ring_stress(p, a.constants->nu, value, value + STRESSES);
    else
        ring_kernels(p, a.constants->nu, near ? &a.constants->log_length : 0, value, value + KINDS);
}

/* The rule of each target, 0 before: 0 near, else one more than its place among those of the order. Behind the axis a target may be
   nearer in the coordinate of an arc. */
INLINE void rules_of(const Quadrature *q, const Element *e, int least, const Targets *t, const Local *local, int *rule)
{
    const Arc *arc = e->arc;
    double sum[CHUNK], xi, h;
    for (int i = 0; i < t->count; i++)
        sum[i] = sum_of(local->left[i], local->right[i], local->h[i]);
    for (int i = 0; arc && i < t->count; i++) {
        preimage(arc, -t->x[i] - arc->middle[0], t->y[i] - arc->middle[1], e->tx, e->ty, &xi, &h);
        const double image = sum_of(xi + 1.0, xi - 1.0, h);
        sum[i] = image < sum[i] ? image : sum[i];
    }
    for (int k = 0; k < (int)q->rules[e->order] && (k == 0 || q->points[e->order][k] >= least); k++)
        for (int i = 0; i < t->count; i++)
            rule[i] += (sum[i] >= q->sum[e->order][k]) & (t->element[i] != e->index);
}

/* Gauss quadrature for some targets: `out` has rows of targets by node and kind. */
INLINE void by_points(Sum a, int points, const Targets *t, const int *chosen, int count, Wanted w, double (*out)[CHUNK])
{
    const Gauss *rule = a.element->rule->gauss + points;
    Sources s;
    sources_of(a.element, points, &s);
    for (int first = 0; first < count; first += LANES) {
        Vector r = {0.0}, z = {0.0}, sum[NODES][ALL], value[ALL];
        for (int i = 0; i < LANES; i++) {
            const int target = chosen[first + i < count ? first + i : first];
            r[i] = t->x[target];
            z[i] = t->y[target];
        }
        for (int n = w.node; n < w.last; n++)
            for (int k = 0; k < a.kinds; k++)
                sum[n][k] = 0.0 * r;
        for (int q = 0; q < points; q++) {
            const double nr = s.ty[q] / a.element->half, nz = -s.tx[q] / a.element->half;
            const Vector none = 0.0 * r, dr = s.x[q] - r, dz = s.y[q] - z;
            const Rings ring = {r, s.x[q] + none, dr, dz, nr + none, nz + none, nr * dr + nz * dz};
            kernels_of(a, &ring, 0, value);
            for (int n = w.node; n < w.last; n++)
                for (int k = 0; k < a.kinds; k++)
                    sum[n][k] += (s.x[q] * rule->product[n][q]) * value[k];
        }
        for (int n = w.node; n < w.last; n++)
            for (int k = 0; k < a.kinds; k++)
                for (int i = 0; i < LANES && first + i < count; i++)
                    out[n * a.kinds + k][chosen[first + i]] = a.unit[2 * k >= a.kinds] * sum[n][k][i];
    }
}

/* The ring at s - ξ = `offset` as seen from the target, without differences of coordinates. */
INLINE Rings ring_at(const Element *e, const Place *p, Vector offset)
{
    const double bend = e->arc ? e->arc->angle : 0.0;
    const Vector none = 0.0 * offset;
    Vector t = offset, n = p->lift + none, tx = e->tx + none, ty = e->ty + none;
    if (e->arc) {
        Vector sinc, cos, turn_sinc, turn_cos;
        sine_of((0.5 * bend) * offset, &sinc, &cos);
        const Vector half_sine = (0.5 * bend) * offset * sinc, turn = bend * (0.5 * (p->left + p->right) + offset);
        t = offset * sinc * cos - p->lift * (2.0 * half_sine * cos);
        n = offset * half_sine * sinc + p->lift * (1.0 - 2.0 * half_sine * half_sine);
        sine_of(turn, &turn_sinc, &turn_cos);
        tx = e->tx * turn_cos - e->ty * turn * turn_sinc;
        ty = e->ty * turn_cos + e->tx * turn * turn_sinc;
    }
    const Vector dr = e->half * (t * tx + n * ty), dz = e->half * (t * ty - n * tx);
    /* a radius that is never 0: planes are taken off over it */
    return (Rings){p->r + none, p->r + dr + 1e-100, dr, dz, ty, -tx, e->half * n};
}

/* Sums against Legendre polynomials of s over a panel at s - ξ = base + side (from ... to), filled up to whole vectors with nothing.
   What is left of rings less planes behaves like ln|s-ξ| on the element itself: fifth powers of the points of Gauss; near it the
   sinh of them, `scale` being the distance over half the length. */
INLINE void add_panel(Sum a, const Place *place, double base, double side, double from, double to, double scale,
                      Vector (*sum)[ALL])
{
    const Quadrature *q = a.quadrature;
    const int order = a.element->order, first = from == 0.0;
    const double size = to - from, reach = area_sinh(to / scale), wanted = ceil(q->near + order + q->slope * reach);
    const int count = (int)(!first ? q->rest : place->own ? q->own : wanted < MOST ? wanted : MOST);
    for (int begin = 0; begin < count; begin += LANES) {
        const Vector x = at(q->gauss[count][0] + begin), fourth = x * x * (x * x);
        Vector weight = size * at(q->gauss[count][1] + begin), offset = from + size * x, value[ALL];
        if (first && place->own) {
            offset *= fourth;
            weight *= 5.0 * fourth;
        } else if (first) {
            const Vector grown = each(power_of_e, reach * x), shrunk = 1.0 / grown;
            offset = 0.5 * scale * (grown - shrunk);
            weight *= 0.5 * scale * reach / size * (grown + shrunk);
        }
        offset = base + side * offset;
        const Rings ring = ring_at(a.element, place, offset);
        kernels_of(a, &ring, 1, value);
        const Vector s = 0.5 * (place->left + place->right) + offset;
        Vector below = 0.0 * s, legendre = ring.radius * weight;
        for (int n = 0; n <= order; n++) {
            for (int k = 0; k < a.kinds; k++)
                sum[n][k] += legendre * value[k];
            const Vector next = ((2 * n + 1) * s * legendre - n * below) * (1.0 / (n + 1));
            below = legendre;
            legendre = next;
        }
    }
}

/* Sums for one near target, added to `out`: panels from the point of the element next to it to both sides. */
INLINE void add_crowded(Sum a, const Local *local, const Targets *t, int i, Wanted w, double (*out)[CHUNK])
{
    const Element *e = a.element;
    const double h = local->h[i], rise = e->arc ? 0.5 * e->arc->angle * h : 0.0; /* an arc is (1 - e^(-αh))/α away */
    const double lift = e->arc ? h * power_of_e(-rise) * sinhc(rise) : h;
    const Place place = {local->left[i], local->right[i], lift, t->x[i], t->element[i] == e->index};
    const double low = -place.left, high = -place.right, base = low > 0.0 ? low : high < 0.0 ? high : 0.0;
    const double scale = fmax(sqrt(base * base + lift * lift), NEAREST), turn = e->arc ? TURNED / fabs(e->arc->angle) : 2.0;
    Vector sum[NODES][ALL] = {{{0.0}}};
    for (double side = -1.0; side < 2.0; side += 2.0) {
        const double length = side > 0.0 ? high - base : base - low;
        double from = 0.0, to = fmin(fmax(place.r / e->half, scale), turn);
        for (; from < length; from = to, to *= GROWTH) {
            to = fmin(to, length);
            add_panel(a, &place, base, side, from, to, scale, sum);
        }
    }
    for (int l = 0; l <= e->order; l++)
        for (int k = 0; k < a.kinds; k++) {
            const Vector lanes = sum[l][k];
            const double all = a.unit[2 * k >= a.kinds] * ((lanes[0] + lanes[1]) + (lanes[2] + lanes[3]));
            for (int n = w.node; n < w.last; n++)
                out[n * a.kinds + k][i] += e->rule->to_basis[n][l] * all;
        }
}

#endif
