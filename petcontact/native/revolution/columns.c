/* Both kernels of rings over elements of any order and shape, at targets or as columns of the boundary operators. */

#include "values.h"

static const int ROW[KINDS] = {0, 0, 1, 1, 2}, COLUMN[KINDS] = {0, 1, 0, 1, 2}; /* components of each kind */

INLINE int kinds_of(const Curve *a)
{
    return a->d == 3 ? KINDS : TT;
}

/* G and H, (d, d, n nodes, m) each and zero before, of n elements of one order at m points. */
void petcontact_ring_integrals(const Curve *a, int64_t n, const Points *points, int64_t m, double *g, double *h)
{
    const Constants c = constants_of(&a->plane);
    const int nodes = n ? (int)a->plane.order[0] + 1 : 0;
    Targets t;
    RingValues v[NODES];
    for (int64_t first = 0; first < m; first += CHUNK) {
        load_targets(points, 0, first, m - first < CHUNK ? (int)(m - first) : CHUNK, &t);
        for (int64_t i = 0; i < n; i++) {
            const Element e = element_of(&a->plane, i);
            petcontact_ring_values(a->quadrature, &e, (int)a->least[i], &c, &t, (Wanted){1, 1, 0, nodes}, v);
            for (int k = 0; k < nodes; k++)
                for (int j = 0; j < kinds_of(a); j++) {
                    const int64_t to = ((ROW[j] * a->d + COLUMN[j]) * n * nodes + i * nodes + k) * m + first;
                    memcpy(g + to, v[k].g[j], t.count * sizeof(double));
                    memcpy(h + to, v[k].h[j], t.count * sizeof(double));
                }
        }
    }
}

typedef struct { /* a curve and what makes columns of G and H: bem.kernel.ColumnData */
    Curve curve;
    Points nodes;
    const int64_t *first_node, *known;             /* (e + 1,), (n, d) */
    const double *frame;                           /* (n, d, d) */
    const int64_t *rhs_first;                      /* (n + 1,) */
    const double *rhs_traction, *rhs_displacement; /* (q, d) */
} CurveColumns;

/* `sign` times a kernel times a vector, added to targets' components. */
INLINE void add_product(const Curve *a, double (*kernel)[CHUNK], int count, double sign, const double *vector, double *out)
{
    for (int j = 0; j < kinds_of(a); j++) {
        const double x = sign * vector[COLUMN[j]];
        for (int i = 0; x != 0.0 && i < count; i++)
            out[a->d * i + ROW[j]] += kernel[j][i] * x;
    }
}

/* `sign` times (½ + H) times a vector; `own` of the targets is the node itself. */
INLINE void add_h(const Curve *a, RingValues *v, int count, int own, double sign, const double *vector, double *out)
{
    add_product(a, v->h, count, sign, vector, out);
    for (int i = 0; own < count && i < a->d; i++)
        out[a->d * own + i] += 0.5 * sign * vector[i];
}

INLINE int some(const double *vector, int64_t d)
{
    return vector[0] != 0.0 || vector[1] != 0.0 || (d == 3 && vector[2] != 0.0);
}

/* Kernels and nodes that consecutive columns of one element ask for. */
INLINE Wanted wanted_by(const CurveColumns *a, const int64_t *columns, int64_t count, int64_t first_node, int system,
                        int beside)
{
    const int64_t d = a->curve.d;
    Wanted w = {0, 0, (int)(columns[0] - first_node), (int)(columns[count - 1] - first_node) + 1};
    for (int64_t j = 0; j < count; j++) {
        const int64_t node = columns[j];
        for (int64_t i = d * node; system && i < d * (node + 1); i++) {
            w.g |= !a->known[i];
            w.h |= a->known[i] != 0;
        }
        for (int64_t q = a->rhs_first[node]; beside && q < a->rhs_first[node + 1]; q++) {
            w.g |= some(a->rhs_traction + d * q, d);
            w.h |= some(a->rhs_displacement + d * q, d);
        }
    }
    return w;
}

/* Columns of the boundary operators, a `Filler` (hmatrix.c); see petcontact_plane_columns. */
void petcontact_ring_columns(const void *mesh, int64_t m, const int64_t *rows, int64_t k, const int64_t *columns,
                             double *system, double *beside)
{
    const CurveColumns *a = mesh;
    const Curve *curve = &a->curve;
    const int64_t d = curve->d;
    const Constants c = constants_of(&curve->plane);
    Targets t;
    RingValues values[NODES];
    for (int64_t first = 0; first < m; first += CHUNK) {
        const int64_t *row = rows + first;
        load_targets(&a->nodes, rows, first, m - first < CHUNK ? (int)(m - first) : CHUNK, &t);
        const size_t bytes = d * t.count * sizeof(double);
        double *rhs = beside ? beside + d * first : 0;
        for (int64_t j = 0, last; j < k; j = last) {
            const int64_t number = a->nodes.element[columns[j]], first_node = a->first_node[number];
            for (last = j + 1; last < k && a->nodes.element[columns[last]] == number;)
                last++;
            const Wanted w = wanted_by(a, columns + j, last - j, first_node, system != 0, beside != 0);
            const Element e = element_of(&curve->plane, number);
            if (w.g || w.h)
                petcontact_ring_values(curve->quadrature, &e, (int)curve->least[number], &c, &t, w, values);
            for (int64_t i = j; i < last; i++) {
                const int64_t node = columns[i];
                RingValues *v = values + (node - first_node);
                int own = t.count;
                if (row[0] <= node && node <= row[t.count - 1])
                    for (own = 0; own < t.count && row[own] != node;)
                        own++;
                for (int64_t f = 0; system && f < d; f++) {
                    const double *frame = a->frame + (node * d + f) * d;
                    double *out = system + d * ((d * i + f) * m + first);
                    memset(out, 0, bytes);
                    if (a->known[d * node + f])
                        add_h(curve, v, t.count, own, 1.0, frame, out);
                    else
                        add_product(curve, v->g, t.count, -1.0, frame, out);
                }
                for (int64_t q = a->rhs_first[node]; beside && q < a->rhs_first[node + 1]; q++, rhs += d * m) {
                    memset(rhs, 0, bytes);
                    add_product(curve, v->g, t.count, 1.0, a->rhs_traction + d * q, rhs);
                    add_h(curve, v, t.count, own, -1.0, a->rhs_displacement + d * q, rhs);
                }
            }
        }
    }
}
