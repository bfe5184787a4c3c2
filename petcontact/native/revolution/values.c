/* Both kernels of rings over an element: by Gauss quadrature from afar; else the plane's kernels, which are integrated in closed
   form, and what rings have beyond these, which is bounded but for a logarithm in T, by points that crowd about the target. */

#include "values.h"

#include "../plane/constant.h"

void petcontact_plane_values(const Element *e, const Constants *c, const Targets *t, Wanted w, Ends *ends, Values *v);

static const double NEAREST = 1e-10; /* of half an element: as near as points crowd */
static const double GROWTH = 4.0;    /* of panels beyond the first, as far from the axis as they are long */

/* Targets of one rule. */
INLINE void by_points(const Element *e, const Constants *c, const Sources *s, const Targets *t, const int *chosen, int count,
                      Wanted w, RingValues *v)
{
    const Gauss *rule = e->rule->gauss + s->count;
    const double scale = 0.5 * c->scale * e->half;
    for (int first = 0; first < count; first += LANES) {
        const int some = count - first < LANES ? count - first : LANES;
        Vector r = {0.0}, z = {0.0}, sum[NODES][2 * KINDS];
        Rings ring;
        for (int i = 0; i < LANES; i++) {
            const int target = chosen[first + (i < some ? i : 0)];
            r[i] = t->x[target];
            z[i] = t->y[target];
        }
        memset(sum, 0, sizeof sum);
        for (int q = 0; q < s->count; q++) {
            Vector value[2 * KINDS];
            ring = (Rings){r, s->r[q] + 0.0 * r, s->r[q] - r, s->z[q] - z, s->nr[q] + 0.0 * r, s->nz[q] + 0.0 * r, r};
            ring.dn = ring.nr * ring.dr + ring.nz * ring.dz;
            ring_kernels(&ring, c->nu, w.h, value, value + KINDS);
            for (int n = w.node; n < w.last; n++)
                for (int k = 0; k < (w.h ? 2 : 1) * KINDS; k++)
                    sum[n][k] += (scale * s->r[q] * rule->product[n][q]) * value[k];
        }
        for (int n = w.node; n < w.last; n++)
            for (int k = 0; k < KINDS; k++)
                for (int i = 0; i < some; i++) {
                    v[n].g[k][chosen[first + i]] = c->unit * sum[n][k][i];
                    v[n].h[k][chosen[first + i]] = -sum[n][KINDS + k][i];
                }
    }
}

/* A panel's part of what rings have beyond planes, against Legendre polynomials of s. */
INLINE void add_panel(const Element *e, const Constants *c, const Place *place, double r, const Panel *p, int with_h,
                      Vector (*sum)[2 * KINDS])
{
    const double middle = 0.5 * (place->left + place->right);
    for (int first = 0; first < p->count; first += LANES) {
        const Vector offset = *(const Vector *)(p->offset + first), weight = *(const Vector *)(p->weight + first);
        const Vector s = middle + offset;
        Vector value[2 * KINDS], plane[2 * KINDS], below = 0.0 * s, legendre = 1.0 + below;
        Rings ring;
        ring_at(e, place, r, offset, &ring);
        ring_kernels(&ring, c->nu, with_h, value, value + KINDS);
        plane_kernels(&ring, c->nu, 2.0 * c->log_length, with_h, plane, plane + KINDS);
        const int kinds = (with_h ? 2 : 1) * KINDS;
        for (int k = 0; k < kinds; k++)
            value[k] = weight * (ring.radius * value[k] - plane[k]);
        for (int n = 0; n <= e->order; n++) {
            for (int k = 0; k < kinds; k++)
                sum[n][k] += legendre * value[k];
            const Vector next = ((2 * n + 1) * s * legendre - n * below) * (1.0 / (n + 1));
            below = legendre;
            legendre = next;
        }
    }
}

/* What rings have beyond planes, for one target, added to its values. */
INLINE void add_rest(const Quadrature *a, const Element *e, const Constants *c, const Targets *t, int target, Wanted w,
                     RingValues *v)
{
    const int own = t->element[target] == e->index;
    const double r = t->x[target], factor = 0.5 * c->scale * e->half;
    const Place place = place_of(e, r, t->y[target], own, t->xi[target]);
    Vector sum[NODES][2 * KINDS];
    memset(sum, 0, sizeof sum);
    for (double side = -1.0; side < 2.0; side += 2.0) {
        const double low = -place.left, high = -place.right, base = low > 0.0 ? low : high < 0.0 ? high : 0.0;
        const double length = side > 0.0 ? high - base : base - low;
        const double near = base == 0.0 ? fabs(place.lift) / e->half : base == low ? place.from_start : place.from_end;
        const double scale = near > NEAREST ? near : NEAREST, image = 2.0 * r / e->half; /* the target behind the axis */
        double from = 0.0, to = image > scale ? image : scale;
        for (; from < length; from = to, to *= GROWTH) {
            to = to < length ? to : length;
            const Panel panel = panel_of(a, base, side, from, to, scale, own);
            add_panel(e, c, &place, r, &panel, w.h, sum);
        }
    }
    for (int n = w.node; n < w.last; n++)
        for (int k = 0; k < KINDS; k++) {
            double g = 0.0, h = 0.0;
            for (int l = 0; l <= e->order; l++)
                for (int i = 0; i < LANES; i++) {
                    g += e->rule->to_basis[n][l] * sum[l][k][i];
                    h += e->rule->to_basis[n][l] * sum[l][KINDS + k][i];
                }
            v[n].g[k][target] += factor * c->unit * g;
            v[n].h[k][target] -= factor * h;
        }
}

/* Plane strain in closed form, and from its traces the plane that slides out of itself. */
INLINE void by_plane(const Element *e, const Constants *c, const Targets *t, const int *chosen, int count, Wanted w,
                     RingValues *v)
{
    Targets near = {.count = count};
    Values plane[NODES];
    Ends ends = {.end = 0};
    for (int i = 0; i < count; i++) {
        near.x[i] = t->x[chosen[i]];
        near.y[i] = t->y[chosen[i]];
        near.xi[i] = t->xi[chosen[i]];
        near.line[i] = t->line[chosen[i]];
        near.element[i] = t->element[chosen[i]];
        near.before[i] = near.after[i] = -3; /* no constant arcs beside it: see `add_slopes` */
    }
    petcontact_plane_values(e, c, &near, w, &ends, plane);
    const double share = c->unit * e->half, over = 2.0 * (1.0 - c->nu) / c->factor;
    for (int n = w.node; n < w.last; n++)
        for (int i = 0; i < count; i++) {
            const Values *from = plane + n;
            const int to = chosen[i];
            v[n].g[RR][to] = from->g00[i];
            v[n].g[RZ][to] = v[n].g[ZR][to] = from->g01[i];
            v[n].g[ZZ][to] = from->g11[i];
            v[n].g[TT][to] = over * (from->g00[i] + from->g11[i] - c->scale * share * e->rule->weight[n]);
            v[n].h[RR][to] = from->h00[i];
            v[n].h[RZ][to] = from->h01[i];
            v[n].h[ZR][to] = from->h10[i];
            v[n].h[ZZ][to] = from->h11[i];
            v[n].h[TT][to] = 0.5 * (from->h00[i] + from->h11[i]);
        }
}

/* What constant arcs miss of the slope of the displacement, as in the plane: bem.kelvin2d.integrals._add_slopes. */
INLINE void add_slopes(const Element *e, const Constants *c, const Targets *t, RingValues *v)
{
    const double share = 0.34657359027997264 * (1.0 - 2.0 * c->nu) * c->scale;
    for (int i = 0; i < t->count; i++) {
        const double change = share * ((t->before[i] == e->index) - (t->after[i] == e->index));
        v->h[RZ][i] += change;
        v->h[ZR][i] -= change;
    }
}

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

DISPATCHED void petcontact_ring_values(const Quadrature *a, const Element *e, int least, const Constants *c, const Targets *t,
                                       Wanted w, RingValues *v)
{
    int rule[CHUNK], chosen[CHUNK], left = t->count;
    rules_of(a, e, least, t, rule);
    for (int k = 0; left; k++) {
        int count = 0;
        for (int i = 0; i < t->count; i++)
            if (rule[i] == k)
                chosen[count++] = i;
        left -= count;
        if (count && k) {
            Sources s;
            sources_of(e, (int)a->points[e->order][k - 1], &s);
            by_points(e, c, &s, t, chosen, count, w, v);
        } else if (count) {
            by_plane(e, c, t, chosen, count, w, v);
            for (int i = 0; i < count; i++)
                add_rest(a, e, c, t, chosen[i], w, v);
        }
    }
    if (e->arc && e->order == 0 && w.h)
        add_slopes(e, c, t, v);
}
