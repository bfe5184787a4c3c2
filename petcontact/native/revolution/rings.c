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
INLINE void sum_all(RingWork *work, int stress, int second, int64_t number, const Element *e, const Targets *t, Wanted w)
{
    const Curve *curve = work->curve;
    const Constants *c = &work->constants;
    const double scale = 0.5 * c->scale * e->half, unit = stress ? 1.0 : c->unit;
    const Sum a = {stress, stress ? STRESSES : KINDS, second, unit * scale, -unit * scale / c->unit, curve->quadrature, e,
                   c};
    double (*out)[CHUNK] = work->values;
    int rule[CHUNK], chosen[CHUNK + 1] = {0};
    rules_of(a.quadrature, e, (int)curve->least[number], t, rule);
    for (int k = 0, count, left = t->count; left; left -= count, k++) {
        count = 0;
        for (int i = 0; i < t->count; i++)
            if (rule[i] == k)
                chosen[count++] = i;
        if (count && k)
            by_points(a, (int)a.quadrature->points[e->order][k - 1], t, chosen, count, w, out);
        else if (count) {
            Local local;
            if (e->arc)
                preimages_of(e, t, 0, t->count, &local);
            else
                local_of(e, t, &local);
            if (a.stress)
                memset(out, 0, w.last * ALL * sizeof *out);
            else
                plane_values(a, t, chosen, count, w, out);
            for (int i = 0; i < count; i++)
                add_crowded(a, &local, t, chosen[i], w, out);
        }
    }
    if (!a.stress && e->arc && e->order == 0 && w.h)
        add_slopes(e, a.constants, t, out[KINDS + RZ], out[KINDS + ZR]);
}

/* Rows of stress, or of both components and torsion. */
DISPATCHED void petcontact_over_ring(void *work, int64_t number, const Element *e, const Targets *t, Wanted w, int fresh,
                                     Entries *node)
{
    static const double nothing[CHUNK]; /* between torsion and the rest */
    RingWork *a = work;
    const Curve *curve = a->curve;
    const int d = (int)curve->d, place[] = {0, 1, d, d + 1, 2 * d + 2};
    (void)fresh;
    if (curve->stress)
        sum_all(a, 1, 1, number, e, t, w);
    else if (w.h)
        sum_all(a, 0, 1, number, e, t, w);
    else
        sum_all(a, 0, 0, number, e, t, w);
    const int kinds = curve->stress ? STRESSES : KINDS;
    for (int n = w.node; n < w.last; n++) {
        for (int k = 0; k < ENTRIES; k++)
            node[n].g[k] = node[n].h[k] = nothing;
        for (int k = 0; k < kinds; k++) {
            node[n].g[curve->stress ? k : place[k]] = a->values[2 * kinds * n + k];
            node[n].h[curve->stress ? k : place[k]] = a->values[2 * kinds * n + kinds + k];
        }
    }
}

/* G and H, (d, d, n nodes, m) each, of n elements of one order at m points, or D and S, (10, n nodes, m). */
void petcontact_ring_integrals(const Curve *a, int64_t n, const Points *points, int64_t m, double *g, double *h)
{
    RingWork work = {a, constants_of(&a->plane)};
    fill_integrals(petcontact_over_ring, &work, &a->plane, a->stress ? STRESSES : (int)(a->d * a->d), n, points, m, g, h);
}

typedef struct { /* a curve and what makes columns of G and H */
    Curve curve;
    Columns columns;
} CurveColumns;

/* See `fill_columns`. */
void petcontact_ring_columns(const void *mesh, int64_t m, const int64_t *rows, int64_t k, const int64_t *columns,
                             double *system, double *beside)
{
    const CurveColumns *a = mesh;
    RingWork work = {&a->curve, constants_of(&a->curve.plane)};
    fill_columns(petcontact_over_ring, &work, &a->curve.plane, (int)a->curve.d, &a->columns, m, rows, k, columns, system,
                 beside);
}

/* 8π(1-ν) times 2µ ∫ U dθ (RR, RZ, ZR, ZZ, TT) and ∫ D dθ, (15, m), of a ring through (R, Z) at m points. */
DISPATCHED void petcontact_ring_forces(int64_t m, const double *x, double radius, double z, double nu, double *out)
{
    for (int64_t first = 0; first < m; first += LANES) {
        Vector r = {0.0}, dz = {0.0}, value[KINDS + 2 * STRESSES];
        for (int64_t i = 0; i < LANES; i++) {
            const int64_t k = first + i < m ? first + i : m - 1;
            r[i] = x[2 * k];
            dz[i] = z - x[2 * k + 1];
        }
        const Vector none = 0.0 * r;
        const Rings ring = {r, radius + none, radius - r, dz, none, none, none};
        ring_kernels(&ring, nu, 0, 0, value, 0);
        ring_stress(&ring, nu, value + KINDS, value + KINDS + STRESSES);
        for (int k = 0; k < KINDS + STRESSES; k++)
            for (int64_t i = 0; i < LANES && first + i < m; i++)
                out[k * m + first + i] = value[k][i];
    }
}
