/* Kernels of rings summed over one element at targets: Gauss quadrature from afar, and points that crowd about a near target. */

#ifndef PETCONTACT_RING_SUMS_H
#define PETCONTACT_RING_SUMS_H

#include "elements.h"

enum { ALL = 20 }; /* kinds of kernels at a time, at most */
static const double NEAREST = 1e-10; /* of half an element: as near as points crowd */
/* Panels: the first reaches half way to the target's image behind the axis and turns by TURNED radians at most, those beyond it
   grow by GROWTH. With these 1 of 100 of 4000 random pairs was off by 8e-10 or more at 1e-9, the worst one by 4e-9; with 0.75,
   4 and the whole way 1e-8 and 3e-7. */
static const double TURNED = 0.5, GROWTH = 3.0;

/* Two kernels of `kinds`/2 components each, or the first of them alone. */
typedef void Kernels(const Rings *p, const Constants *c, int second, Vector *value);

typedef struct { /* what is summed, and in which units each kernel comes */
    Kernels *kernels;
    int kinds, second; /* of both kernels, and whether the second is wanted */
    double unit, other_unit;
} Sum;

/* The rule of each target: 0 near, else one more than its place among those of the order. */
INLINE void rules_of(const Quadrature *q, const Element *e, int least, const Targets *t, int *rule)
{
    const int rules = (int)q->rules[e->order];
    double sum[CHUNK];
    for (int i = 0; i < t->count; i++)
        sum[i] = half_sum(e, t->x[i], t->y[i]);
    for (int i = 0; e->arc && i < t->count; i++) { /* behind the axis a target may be nearer in the coordinate of an arc */
        const double image = half_sum(e, -t->x[i], t->y[i]);
        sum[i] = image < sum[i] ? image : sum[i];
    }
    for (int i = 0; i < t->count; i++)
        rule[i] = 0;
    for (int k = 0; k < rules && (k == 0 || q->points[e->order][k] >= least); k++)
        for (int i = 0; i < t->count; i++)
            rule[i] += sum[i] >= q->sum[e->order][k];
    for (int i = 0; i < t->count; i++)
        rule[i] = t->element[i] == e->index ? 0 : rule[i];
}

/* Gauss quadrature for some targets: `out` has rows of targets by node and kind. */
INLINE void by_points(Sum a, const Element *e, const Constants *c, const Sources *s, const Targets *t, const int *chosen,
                      int count, Wanted w, double (*out)[CHUNK])
{
    const Gauss *rule = e->rule->gauss + s->count;
    const int kinds = a.second ? a.kinds : a.kinds / 2;
    for (int first = 0; first < count; first += LANES) {
        const int some = count - first < LANES ? count - first : LANES;
        Vector r = {0.0}, z = {0.0}, sum[NODES][ALL], value[ALL];
        for (int i = 0; i < LANES; i++) {
            const int target = chosen[first + (i < some ? i : 0)];
            r[i] = t->x[target];
            z[i] = t->y[target];
        }
        for (int n = w.node; n < w.last; n++)
            for (int k = 0; k < kinds; k++)
                sum[n][k] = 0.0 * r;
        for (int q = 0; q < s->count; q++) {
            const double nr = s->ty[q] / e->half, nz = -s->tx[q] / e->half;
            const Vector none = 0.0 * r, dr = s->x[q] - r, dz = s->y[q] - z;
            const Rings ring = {r, s->x[q] + none, dr, dz, nr + none, nz + none, nr * dr + nz * dz};
            a.kernels(&ring, c, a.second, value);
            for (int n = w.node; n < w.last; n++)
                for (int k = 0; k < kinds; k++)
                    sum[n][k] += (s->x[q] * rule->product[n][q]) * value[k];
        }
        for (int n = w.node; n < w.last; n++)
            for (int k = 0; k < kinds; k++)
                for (int i = 0; i < some; i++)
                    out[n * a.kinds + k][chosen[first + i]] = (k < a.kinds / 2 ? a.unit : a.other_unit) * sum[n][k][i];
    }
}

/* Sums against Legendre polynomials of s by one panel's points. */
INLINE void add_panel(Sum a, const Element *e, const Constants *c, const Place *place, double r, const Panel *p,
                      Vector (*sum)[ALL])
{
    const double middle = 0.5 * (place->left + place->right);
    const int kinds = a.second ? a.kinds : a.kinds / 2;
    for (int first = 0; first < p->count; first += LANES) {
        const Vector offset = *(const Vector *)(p->offset + first), weight = *(const Vector *)(p->weight + first);
        const Vector s = middle + offset;
        Vector value[ALL], below = 0.0 * s, legendre = 1.0 + below;
        Rings ring;
        ring_at(e, place, r, offset, &ring);
        a.kernels(&ring, c, a.second, value);
        for (int k = 0; k < kinds; k++)
            value[k] *= weight;
        for (int n = 0; n <= e->order; n++) {
            for (int k = 0; k < kinds; k++)
                sum[n][k] += legendre * value[k];
            const Vector next = ((2 * n + 1) * s * legendre - n * below) * (1.0 / (n + 1));
            below = legendre;
            legendre = next;
        }
    }
}

/* Sums for one near target, added to `out`: panels from the point of the element next to it to both sides. */
INLINE void add_crowded(Sum a, const Quadrature *q, const Element *e, const Constants *c, const Targets *t, int target,
                        Wanted w, double (*out)[CHUNK])
{
    const int own = t->element[target] == e->index;
    const double r = t->x[target];
    const Place place = place_of(e, r, t->y[target], own, t->xi[target]);
    const int kinds = a.second ? a.kinds : a.kinds / 2;
    const double turn = e->arc ? TURNED / fabs(e->arc->angle) : 2.0;
    Vector sum[NODES][ALL];
    for (int n = 0; n <= e->order; n++)
        for (int k = 0; k < kinds; k++)
            sum[n][k] = (Vector){0.0};
    for (double side = -1.0; side < 2.0; side += 2.0) {
        const double low = -place.left, high = -place.right, base = low > 0.0 ? low : high < 0.0 ? high : 0.0;
        const double length = side > 0.0 ? high - base : base - low;
        const double near = base == 0.0 ? fabs(place.lift) / e->half : base == low ? place.from_start : place.from_end;
        const double scale = near > NEAREST ? near : NEAREST, image = r / e->half;
        double from = 0.0, to = fmin(image > scale ? image : scale, turn);
        for (; from < length; from = to, to *= GROWTH) {
            to = to < length ? to : length;
            const Panel panel = panel_of(q, e->order, base, side, from, to, scale, own);
            add_panel(a, e, c, &place, r, &panel, sum);
        }
    }
    for (int l = 0; l <= e->order; l++)
        for (int k = 0; k < kinds; k++) {
            const Vector each = sum[l][k];
            const double all = (k < a.kinds / 2 ? a.unit : a.other_unit) * ((each[0] + each[1]) + (each[2] + each[3]));
            for (int n = w.node; n < w.last; n++)
                out[n * a.kinds + k][target] += e->rule->to_basis[n][l] * all;
        }
}

/* All targets, by the rules that `rules_of` chose; `out` of near ones is added to. */
INLINE void sum_all(Sum far, Sum near, const Quadrature *q, const Element *e, const Constants *c, const Targets *t,
                    const int *rule, Wanted w, double (*out)[CHUNK])
{
    int chosen[CHUNK], left = t->count;
    for (int k = 0; left; k++) {
        int count = 0;
        for (int i = 0; i < t->count; i++)
            if (rule[i] == k)
                chosen[count++] = i;
        left -= count;
        if (count && k) {
            Sources s;
            sources_of(e, (int)q->points[e->order][k - 1], &s);
            by_points(far, e, c, &s, t, chosen, count, w, out);
        }
        for (int i = 0; k == 0 && i < count; i++)
            add_crowded(near, q, e, c, t, chosen[i], w, out);
    }
}

#endif
