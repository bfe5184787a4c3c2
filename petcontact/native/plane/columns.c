/* Both kernels of the plane over elements of any order and shape, at targets or as columns of the boundary operators. */

#include "arcs.h"
#include "constant.h"
#include "straight.h"

/* One Values a node of an element at the targets of a chunk; `ends` belong to the chunk. */
DISPATCHED void petcontact_plane_values(const Element *e, const Constants *c, const Targets *t, Wanted w, Ends *ends,
                                        Values *v)
{
    const Wanted g = {1, 0, w.node, w.last}, h = {0, 1, w.node, w.last}, both = {1, 1, w.node, w.last};
    if (e->arc)
        petcontact_arc_values(e, c, t, w, v);
    else if (e->order == 0) {
        if (w.g && w.h)
            constant_values(e, c, t, both, ends, v);
        else if (w.g)
            constant_values(e, c, t, g, ends, v);
        else
            constant_values(e, c, t, h, ends, v);
    } else if (w.g && w.h)
        straight_values(e, c, t, both, v);
    else if (w.g)
        straight_values(e, c, t, g, v);
    else
        straight_values(e, c, t, h, v);
}

/* G and H, (2, 2, n nodes, m) each or null, of n elements of one order at m points. */
void petcontact_plane_integrals(const Elements *elements, int64_t n, const Points *points, int64_t m, double *g, double *h)
{
    const Constants c = constants_of(elements);
    const int nodes = n ? (int)elements->order[0] + 1 : 0;
    const int64_t plane = n * nodes * m;
    Targets t;
    Ends ends;
    Values v[NODES];
    for (int64_t first = 0; first < m; first += CHUNK) {
        load_targets(points, 0, first, m - first < CHUNK ? (int)(m - first) : CHUNK, &t);
        ends.end = 0;
        const size_t bytes = t.count * sizeof(double);
        for (int64_t i = 0; i < n; i++) {
            const Element e = element_of(elements, i);
            petcontact_plane_values(&e, &c, &t, (Wanted){g != 0, h != 0, 0, nodes}, &ends, v);
            for (int k = 0; k < nodes; k++) {
                const int64_t to = (i * nodes + k) * m + first;
                const double *from_g[] = {v[k].g00, v[k].g01, v[k].g01, v[k].g11};
                const double *from_h[] = {v[k].h00, v[k].h01, v[k].h10, v[k].h11};
                for (int j = 0; j < 4; j++) {
                    if (g)
                        memcpy(g + j * plane + to, from_g[j], bytes);
                    if (h)
                        memcpy(h + j * plane + to, from_h[j], bytes);
                }
            }
        }
    }
}

typedef struct { /* a mesh and what makes columns of G and H: bem.kernel.ColumnData */
    Elements elements;
    Points nodes;
    const int64_t *first_node, *known;             /* (e + 1,), (n, 2) */
    const double *frame;                           /* (n, 2, 2) */
    const int64_t *rhs_first;                      /* (n + 1,) */
    const double *rhs_traction, *rhs_displacement; /* (q, 2) */
} Mesh;

typedef struct { /* one node's columns go here: pairs of components, target after target */
    const Values *values;
    int count, own; /* targets, and which of them is the node itself */
} Column;

INLINE void put_g(const Column *a, double x, double y, double *out)
{
    const Values *v = a->values;
    for (int k = 0; k < a->count; k++) {
        out[2 * k] = v->g00[k] * x + v->g01[k] * y;
        out[2 * k + 1] = v->g01[k] * x + v->g11[k] * y;
    }
}

/* (½ + H) times a vector */
INLINE void put_h(const Column *a, double x, double y, double *out)
{
    const Values *v = a->values;
    for (int k = 0; k < a->count; k++) {
        out[2 * k] = v->h00[k] * x + v->h01[k] * y;
        out[2 * k + 1] = v->h10[k] * x + v->h11[k] * y;
    }
    if (a->own < a->count) {
        out[2 * a->own] += 0.5 * x;
        out[2 * a->own + 1] += 0.5 * y;
    }
}

INLINE void subtract_h(const Column *a, double x, double y, double *out)
{
    const Values *v = a->values;
    for (int k = 0; k < a->count; k++) {
        out[2 * k] -= v->h00[k] * x + v->h01[k] * y;
        out[2 * k + 1] -= v->h10[k] * x + v->h11[k] * y;
    }
    if (a->own < a->count) {
        out[2 * a->own] -= 0.5 * x;
        out[2 * a->own + 1] -= 0.5 * y;
    }
}

INLINE int some(const double *vector)
{
    return vector[0] != 0.0 || vector[1] != 0.0;
}

/* Kernels and nodes that consecutive columns of one element ask for. */
INLINE Wanted wanted_by(const Mesh *a, const int64_t *columns, int64_t count, int64_t first_node, int system, int beside)
{
    Wanted w = {0, 0, (int)(columns[0] - first_node), (int)(columns[count - 1] - first_node) + 1};
    for (int64_t j = 0; j < count; j++) {
        const int64_t node = columns[j], *known = a->known + 2 * node;
        w.g |= system && !(known[0] && known[1]);
        w.h |= system && (known[0] || known[1]);
        for (int64_t q = a->rhs_first[node]; beside && q < a->rhs_first[node + 1]; q++) {
            w.g |= some(a->rhs_traction + 2 * q);
            w.h |= some(a->rhs_displacement + 2 * q);
        }
    }
    return w;
}

/* Columns of the boundary operators of a mesh, a `Filler` (hmatrix.c): where they are not null, system (k, 2, m, 2) and beside
   (number of the columns' right-hand sides, m, 2); each right-hand side is G times a traction less (½ + H) times a
   displacement. */
DISPATCHED void petcontact_plane_columns(const void *mesh, int64_t m, const int64_t *rows, int64_t k, const int64_t *columns,
                                         double *system, double *beside)
{
    const Mesh *a = mesh;
    const Constants c = constants_of(&a->elements);
    Targets t;
    Ends ends;
    Values values[NODES];
    for (int64_t first = 0; first < m; first += CHUNK) {
        const int64_t *row = rows + first;
        load_targets(&a->nodes, rows, first, m - first < CHUNK ? (int)(m - first) : CHUNK, &t);
        ends.end = 0;
        double *rhs = beside ? beside + 2 * first : 0;
        for (int64_t j = 0, last; j < k; j = last) {
            const int64_t number = a->nodes.element[columns[j]], first_node = a->first_node[number];
            for (last = j + 1; last < k && a->nodes.element[columns[last]] == number;)
                last++;
            const Wanted w = wanted_by(a, columns + j, last - j, first_node, system != 0, beside != 0);
            const Element e = element_of(&a->elements, number);
            if (w.g || w.h)
                petcontact_plane_values(&e, &c, &t, w, &ends, values);
            for (int64_t i = j; i < last; i++) {
                const int64_t node = columns[i], *known = a->known + 2 * node;
                Column column = {values + (node - first_node), t.count, t.count};
                if (row[0] <= node && node <= row[t.count - 1])
                    for (column.own = 0; column.own < t.count && row[column.own] != node;)
                        column.own++;
                for (int d = 0; system && d < 2; d++) {
                    const double *f = a->frame + 4 * node + 2 * d;
                    double *out = system + 2 * ((2 * i + d) * m + first);
                    if (known[d])
                        put_h(&column, f[0], f[1], out);
                    else
                        put_g(&column, -f[0], -f[1], out);
                }
                for (int64_t q = a->rhs_first[node]; beside && q < a->rhs_first[node + 1]; q++, rhs += 2 * m) {
                    const double *traction = a->rhs_traction + 2 * q, *u = a->rhs_displacement + 2 * q;
                    if (some(traction))
                        put_g(&column, traction[0], traction[1], rhs);
                    else
                        memset(rhs, 0, 2 * t.count * sizeof(double));
                    if (some(u))
                        subtract_h(&column, u[0], u[1], rhs);
                }
            }
        }
    }
}
