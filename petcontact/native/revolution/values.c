/* Both kernels of rings over an element: by Gauss quadrature from afar; else the plane's kernels, which are integrated in closed
   form, and what rings have beyond these, which is bounded but for a logarithm in T. */

#include "values.h"

#include "../plane/constant.h"
#include "sums.h"

void petcontact_plane_values(const Element *e, const Constants *c, const Targets *t, Wanted w, Ends *ends, Values *v);

INLINE void whole(const Rings *p, const Constants *c, int with_h, Vector *value)
{
    ring_kernels(p, c->nu, with_h, value, value + KINDS);
}

INLINE void beyond_plane(const Rings *p, const Constants *c, int with_h, Vector *value)
{
    Vector plane[2 * KINDS];
    ring_kernels(p, c->nu, with_h, value, value + KINDS);
    plane_kernels(p, c->nu, 2.0 * c->log_length, with_h, plane, plane + KINDS);
    for (int k = 0; k < (with_h ? 2 : 1) * KINDS; k++)
        value[k] = p->radius * value[k] - plane[k];
}

/* Plane strain in closed form, and from its traces the plane that slides out of itself, at targets of rule 0. */
INLINE void by_plane(const Element *e, const Constants *c, const Targets *t, const int *rule, Wanted w, RingValues *v)
{
    Targets near = {.count = 0};
    Values plane[NODES];
    Ends ends = {.end = 0};
    int chosen[CHUNK];
    for (int i = 0; i < t->count; i++)
        if (rule[i] == 0) {
            const int k = near.count++;
            chosen[k] = i;
            near.x[k] = t->x[i];
            near.y[k] = t->y[i];
            near.xi[k] = t->xi[i];
            near.line[k] = t->line[i];
            near.element[k] = t->element[i];
            near.before[k] = near.after[k] = -3; /* no constant arcs beside it: see `add_slopes` */
        }
    if (!near.count)
        return;
    petcontact_plane_values(e, c, &near, w, &ends, plane);
    const double share = c->unit * e->half, over = 2.0 * (1.0 - c->nu) / c->factor;
    for (int n = w.node; n < w.last; n++)
        for (int i = 0; i < near.count; i++) {
            const Values *from = plane + n;
            const int to = chosen[i];
            if (w.g) {
                v[n].g[RR][to] = from->g00[i];
                v[n].g[RZ][to] = v[n].g[ZR][to] = from->g01[i];
                v[n].g[ZZ][to] = from->g11[i];
                v[n].g[TT][to] = over * (from->g00[i] + from->g11[i] - c->scale * share * e->rule->weight[n]);
            }
            if (w.h) {
                v[n].h[RR][to] = from->h00[i];
                v[n].h[RZ][to] = from->h01[i];
                v[n].h[ZR][to] = from->h10[i];
                v[n].h[ZZ][to] = from->h11[i];
                v[n].h[TT][to] = 0.5 * (from->h00[i] + from->h11[i]);
            }
        }
}

DISPATCHED void petcontact_ring_values(const Quadrature *q, const Element *e, int least, const Constants *c, const Targets *t,
                                       Wanted w, RingValues *v)
{
    int rule[CHUNK];
    const double scale = 0.5 * c->scale * e->half;
    const Sum far = {whole, 2 * KINDS, w.h, c->unit * scale, -scale};
    Sum near = far;
    near.kernels = beyond_plane;
    rules_of(q, e, least, t, rule);
    by_plane(e, c, t, rule, w, v);
    sum_all(far, near, q, e, c, t, rule, w, (double(*)[CHUNK])v);
    if (e->arc && e->order == 0 && w.h)
        add_slopes(e, c, t, v->h[RZ], v->h[ZR]);
}
