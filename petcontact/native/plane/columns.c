/* Both kernels of the plane over elements of any order and shape, at targets or as columns of the boundary operators. */

#include "columns.h"

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

typedef struct { /* of kernels over single elements */
    Constants constants;
    Ends ends;
    Values values[NODES];
} PlaneWork;

INLINE void over_element(void *work, int64_t number, const Element *e, const Targets *t, Wanted w, int fresh, Entries *node)
{
    PlaneWork *a = work;
    (void)number;
    if (fresh)
        a->ends.end = 0;
    petcontact_plane_values(e, &a->constants, t, w, &a->ends, a->values);
    if (e->arc && e->order == 0 && w.h)
        add_slopes(e, &a->constants, t, a->values->h01, a->values->h10);
    for (int n = w.node; n < w.last; n++) {
        const Values *v = a->values + n;
        node[n] = (Entries){{v->g00, v->g01, v->g01, v->g11}, {v->h00, v->h01, v->h10, v->h11}};
    }
}

/* G and H, (2, 2, n nodes, m) each or null, of n elements of one order at m points. */
void petcontact_plane_integrals(const Elements *elements, int64_t n, const Points *points, int64_t m, double *g, double *h)
{
    PlaneWork work;
    work.constants = constants_of(elements);
    fill_integrals(over_element, &work, elements, 4, n, points, m, g, h);
}

typedef struct { /* a mesh and what makes columns of G and H */
    Elements elements;
    Columns columns;
} Mesh;

/* See `fill_columns`. */
DISPATCHED void petcontact_plane_columns(const void *mesh, int64_t m, const int64_t *rows, int64_t k, const int64_t *columns,
                                         double *system, double *beside)
{
    const Mesh *a = mesh;
    PlaneWork work;
    work.constants = constants_of(&a->elements);
    fill_columns(over_element, &work, &a->elements, 2, &a->columns, m, rows, k, columns, system, beside);
}
