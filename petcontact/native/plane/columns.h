/* The boundary operators of curves, as integrals at points or as columns, from the kernels over one element at a time. */

#ifndef PETCONTACT_COLUMNS_H
#define PETCONTACT_COLUMNS_H

#include "elements.h"

enum { ENTRIES = 10 }; /* of a kernel at a node, at most */

typedef struct { /* of one node of an element: rows of targets by component and by that of the load */
    const double *g[ENTRIES], *h[ENTRIES];
} Entries;

/* Kernels of an element at the targets of a chunk, one Entries a node; `fresh` where the element is the first one there. `work`
   says which kernels, and is where they are kept. */
typedef void OverElement(void *work, int64_t number, const Element *e, const Targets *t, Wanted w, int fresh, Entries *node);

typedef struct { /* what makes columns of G and H: bem.kernel.ColumnData */
    Points nodes;
    const int64_t *first_node, *known;             /* (e + 1,), (n, d) */
    const double *frame;                           /* (n, d, d) */
    const int64_t *rhs_first;                      /* (n + 1,) */
    const double *rhs_traction, *rhs_displacement; /* (q, d) */
} Columns;

/* Two kernels, (entries, n nodes, m) each or null, of n elements of one order at m points. */
INLINE void fill_integrals(OverElement *over, void *work, const Elements *all, int count, int64_t n, const Points *points,
                           int64_t m, double *g, double *h)
{
    const int nodes = n ? (int)all->order[0] + 1 : 0;
    Targets t;
    Entries v[NODES];
    for (int64_t first = 0; first < m; first += CHUNK) {
        load_targets(points, 0, first, m - first < CHUNK ? (int)(m - first) : CHUNK, &t);
        for (int64_t i = 0; i < n; i++) {
            const Element e = element_of(all, i);
            over(work, i, &e, &t, (Wanted){g != 0, h != 0, 0, nodes}, i == 0, v);
            for (int k = 0; k < nodes; k++)
                for (int j = 0; j < count; j++) {
                    const int64_t to = ((j * n + i) * nodes + k) * m + first;
                    if (g)
                        memcpy(g + to, v[k].g[j], t.count * sizeof(double));
                    if (h)
                        memcpy(h + to, v[k].h[j], t.count * sizeof(double));
                }
        }
    }
}

/* `sign` times a kernel times a vector, added to targets' components. */
INLINE void add_product(const double *const *kernel, int d, int count, double sign, const double *vector,
                        double *restrict out)
{
    for (int j = 0; j < d; j++) {
        const double x = sign * vector[j];
        for (int k = 0; x != 0.0 && k < count; k++)
            for (int i = 0; i < d; i++)
                out[d * k + i] += kernel[d * i + j][k] * x;
    }
}

/* `sign` times (½ + H) times a vector; `own` of the targets is the node itself. */
INLINE void add_h(const Entries *v, int d, int count, int own, double sign, const double *vector, double *out)
{
    add_product(v->h, d, count, sign, vector, out);
    for (int i = 0; own < count && i < d; i++)
        out[d * own + i] += 0.5 * sign * vector[i];
}

INLINE int some(const double *vector, int d)
{
    int found = 0;
    for (int i = 0; i < d; i++)
        found |= vector[i] != 0.0;
    return found;
}

/* Kernels and nodes that consecutive columns of one element ask for. */
INLINE Wanted wanted_by(const Columns *a, int d, const int64_t *columns, int64_t count, int64_t first_node, int system,
                        int beside)
{
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

/* Columns of the boundary operators, as a `Filler` (hmatrix.c): where they are not null, system (k, d, m, d) and beside (number
   of the columns' right-hand sides, m, d); each right-hand side is G times a traction less (½ + H) times a displacement. */
INLINE void fill_columns(OverElement *over, void *work, const Elements *all, int d, const Columns *a, int64_t m,
                         const int64_t *rows, int64_t k, const int64_t *columns, double *system, double *beside)
{
    Targets t;
    Entries entries[NODES];
    for (int64_t first = 0; first < m; first += CHUNK) {
        const int64_t *row = rows + first;
        load_targets(&a->nodes, rows, first, m - first < CHUNK ? (int)(m - first) : CHUNK, &t);
        const size_t bytes = d * t.count * sizeof(double);
        double *rhs = beside ? beside + d * first : 0;
        int fresh = 1;
        for (int64_t j = 0, last; j < k; j = last) {
            const int64_t number = a->nodes.element[columns[j]], first_node = a->first_node[number];
            for (last = j + 1; last < k && a->nodes.element[columns[last]] == number;)
                last++;
            const Wanted w = wanted_by(a, d, columns + j, last - j, first_node, system != 0, beside != 0);
            const Element e = element_of(all, number);
            if (w.g || w.h) {
                over(work, number, &e, &t, w, fresh, entries);
                fresh = 0;
            }
            for (int64_t i = j; i < last; i++) {
                const int64_t node = columns[i];
                const Entries *v = entries + (node - first_node);
                int own = t.count;
                if (row[0] <= node && node <= row[t.count - 1])
                    for (own = 0; own < t.count && row[own] != node;)
                        own++;
                for (int f = 0; system && f < d; f++) {
                    const double *frame = a->frame + (node * d + f) * d;
                    double *out = system + d * ((d * i + f) * m + first);
                    memset(out, 0, bytes);
                    if (a->known[d * node + f])
                        add_h(v, d, t.count, own, 1.0, frame, out);
                    else
                        add_product(v->g, d, t.count, -1.0, frame, out);
                }
                for (int64_t q = a->rhs_first[node]; beside && q < a->rhs_first[node + 1]; q++, rhs += d * m) {
                    memset(rhs, 0, bytes);
                    add_product(v->g, d, t.count, 1.0, a->rhs_traction + d * q, rhs);
                    add_h(v, d, t.count, own, -1.0, a->rhs_displacement + d * q, rhs);
                }
            }
        }
    }
}

#endif
