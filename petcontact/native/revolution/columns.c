/* Both kernels of rings over elements of any order and shape, at targets or as columns of the boundary operators. */

#include "../plane/columns.h"
#include "values.h"

static const int ROW[KINDS] = {0, 0, 1, 1, 2}, COLUMN[KINDS] = {0, 1, 0, 1, 2}; /* components of each kind */

static const double NOTHING[CHUNK]; /* between torsion and the rest */

typedef struct { /* of kernels over single elements */
    const Curve *curve;
    Constants constants;
    RingValues values[NODES];
} RingWork;

INLINE void over_element(void *work, int64_t number, const Element *e, const Targets *t, Wanted w, int fresh, Entries *node)
{
    RingWork *a = work;
    (void)fresh;
    petcontact_ring_values(a->curve->quadrature, e, (int)a->curve->least[number], &a->constants, t, w, a->values);
    for (int n = w.node; n < w.last; n++) {
        for (int k = 0; k < COMPONENTS * COMPONENTS; k++)
            node[n].g[k / COMPONENTS][k % COMPONENTS] = node[n].h[k / COMPONENTS][k % COMPONENTS] = NOTHING;
        for (int k = 0; k < KINDS; k++) {
            node[n].g[ROW[k]][COLUMN[k]] = a->values[n].g[k];
            node[n].h[ROW[k]][COLUMN[k]] = a->values[n].h[k];
        }
    }
}

/* G and H, (d, d, n nodes, m) each, of n elements of one order at m points. */
void petcontact_ring_integrals(const Curve *a, int64_t n, const Points *points, int64_t m, double *g, double *h)
{
    RingWork work;
    work.curve = a;
    work.constants = constants_of(&a->plane);
    fill_integrals(over_element, &work, &a->plane, (int)a->d, n, points, m, g, h);
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
    RingWork work;
    work.curve = &a->curve;
    work.constants = constants_of(&a->curve.plane);
    fill_columns(over_element, &work, &a->curve.plane, (int)a->curve.d, &a->columns, m, rows, k, columns, system, beside);
}
