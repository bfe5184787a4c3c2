/* Rings over elements of any order and shape: both kernels at targets or as columns of the boundary operators, and stress at
   points; displacement and stress by single rings. */

#include "../plane/columns.h"
#include "../plane/constant.h"
#include "sums.h"

void petcontact_plane_values(const Element *e, const Constants *c, const Targets *t, Wanted w, Ends *ends, Values *v);

typedef struct { /* elements of a plane and what rings add */
    Elements plane;
    const int64_t *least; /* (e,): Gauss points that resolve the element itself */
    const Quadrature *quadrature;
    int64_t d, stress; /* 3 with torsion, else 2; whether stress is wanted */
    Columns columns;   /* of `petcontact_ring_columns` alone */
} Curve;

typedef struct { /* of kernels over single elements, rows by node, kernel and kind */
    const Curve *curve;
    Constants constants;
    double values[NODES * ALL][CHUNK];
} RingWork;

/* Plane strain for some targets, and from its traces the plane that slides out of itself. */
INLINE void plane_values(Sum a, const Targets *t, const int *chosen, int count, Wanted w, double (*out)[CHUNK])
{
    const Constants *c = a.constants;
    const double over = 2.0 * (1.0 - c->nu) / c->factor, scale = c->scale * c->unit * a.element->half;
    Values plane[NODES];
    Ends ends = {.end = 0};
    petcontact_plane_values(a.element, c, t, w, &ends, plane);
    for (int n = w.node; n < w.last; n++) {
        const Values *v = plane + n;
        const double *from[] = {v->g00, v->g01, v->g01, v->g11, v->h00, v->h01, v->h10, v->h11};
        double (*row)[CHUNK] = out + 2 * KINDS * n;
        for (int j = 0, i = chosen[0]; j < count; i = chosen[++j]) {
            for (int k = 0; k < 2 * TT; k++)
                row[k + (k >= TT)][i] = from[k][i];
            row[TT][i] = over * (v->g00[i] + v->g11[i] - scale * a.element->rule->weight[n]);
            row[KINDS + TT][i] = 0.5 * (v->h00[i] + v->h11[i]);
        }
    }
}

/* All targets, those of each rule together. */
INLINE void sum_all(RingWork *work, int stress, int64_t number, const Element *e, const Targets *t, Wanted w)
{
    const Constants *c = &work->constants;
    const double scale = 0.5 * c->scale * e->half, unit = stress ? 1.0 : c->unit;
    const Sum a = {stress, stress ? ALL : 2 * KINDS, {unit * scale, -unit * scale / c->unit}, work->curve->quadrature, e, c};
    int rule[CHUNK] = {0}, chosen[CHUNK + 1] = {0};
    Local local;
    if (e->arc)
        preimages_of(e, t, 0, t->count, &local);
    else
        local_of(e, t, &local);
    rules_of(a.quadrature, e, (int)work->curve->least[number], t, &local, rule);
    for (int k = 0, count, left = t->count; left; left -= count, k++) {
        count = 0;
        for (int i = 0; i < t->count; i++)
            if (rule[i] == k)
                chosen[count++] = i;
        if (count && k)
            by_points(a, (int)a.quadrature->points[e->order][k - 1], t, chosen, count, w, work->values);
        else if (count) {
            if (stress)
                memset(work->values, 0, w.last * ALL * sizeof *work->values);
            else
                plane_values(a, t, chosen, count, w, work->values);
            for (int i = 0; i < count; i++)
                add_crowded(a, &local, t, chosen[i], w, work->values);
        }
    }
    if (!stress && e->arc && e->order == 0)
        add_slopes(e, c, t, work->values[KINDS + RZ], work->values[KINDS + ZR]);
}

static const int TWISTED[] = {RR, RZ, -1, ZR, ZZ, -1, -1, -1, TT}; /* of 3 components: torsion is apart from the rest */
static const double NOTHING[CHUNK];

/* Rows of stress, or of both components and torsion. */
DISPATCHED void petcontact_over_ring(void *work, int64_t number, const Element *e, const Targets *t, Wanted w, int fresh,
                                     Entries *node)
{
    RingWork *a = work;
    const int stress = (int)a->curve->stress, d = (int)a->curve->d, kinds = stress ? STRESSES : KINDS;
    (void)fresh;
    if (stress)
        sum_all(a, 1, number, e, t, w);
    else
        sum_all(a, 0, number, e, t, w);
    for (int n = w.node; n < w.last; n++)
        for (int k = 0; k < (stress ? STRESSES : d * d); k++) {
            const int kind = stress || d == 2 ? k : TWISTED[k];
            node[n].g[k] = kind < 0 ? NOTHING : a->values[2 * kinds * n + kind];
            node[n].h[k] = kind < 0 ? NOTHING : a->values[2 * kinds * n + kinds + kind];
        }
}

/* G and H, (d, d, n nodes, m) each, of n elements of one order at m points, or D and S, (10, n nodes, m). */
void petcontact_ring_integrals(const Curve *a, int64_t n, const Points *points, int64_t m, double *g, double *h)
{
    RingWork work = {a, constants_of(&a->plane)};
    fill_integrals(petcontact_over_ring, &work, &a->plane, a->stress ? STRESSES : (int)(a->d * a->d), n, points, m, g, h);
}

/* See `fill_columns`. */
void petcontact_ring_columns(const void *mesh, int64_t m, const int64_t *rows, int64_t k, const int64_t *columns,
                             double *system, double *beside)
{
    const Curve *a = mesh;
    RingWork work = {a, constants_of(&a->plane)};
    fill_columns(petcontact_over_ring, &work, &a->plane, (int)a->d, &a->columns, m, rows, k, columns, system, beside);
}

/* 8π(1-ν) times 2µ ∫ U dθ (RR, RZ, ZR, ZZ, TT) and ∫ D dθ, (15, m), of a ring through (R, Z) at m points (2, m), m whole vectors. */
DISPATCHED void petcontact_ring_forces(int64_t m, const double *x, double radius, double z, double nu, double *out)
{
    for (int64_t i = 0; i < m; i += LANES) {
        const Vector r = at(x + i), none = 0.0 * r;
        const Rings ring = {r, radius + none, radius - r, z - at(x + m + i), none, none, none};
        Vector value[KINDS + STRESSES], of_u[STRESSES];
        ring_kernels(&ring, nu, 0, value, of_u);
        ring_stress(&ring, nu, value + KINDS, of_u);
        for (int k = 0; k < KINDS + STRESSES; k++)
            *(Unaligned *)(out + k * m + i) = value[k];
    }
}
