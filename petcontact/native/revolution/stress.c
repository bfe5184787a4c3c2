/* Stress by elements at points off the boundary, and displacement and stress by single rings. */

#include "stress.h"

#include "sums.h"

/* Quadrature of the whole kernels keeps the digits that closed forms would: see bem.revolution.compiled. */
INLINE void of_stress(const Rings *p, const Constants *c, int second, Vector *value)
{
    (void)second;
    ring_stress(p, c->nu, value, value + STRESSES);
}

INLINE void near_stress(const Rings *p, const Constants *c, int second, Vector *value)
{
    of_stress(p, c, second, value);
    for (int k = 0; k < 2 * STRESSES; k++)
        value[k] *= p->radius;
}

/* D and S, (10, n nodes, m) each, of n elements of one order at m points. */
DISPATCHED void petcontact_ring_stress(const Curve *a, int64_t n, const Points *points, int64_t m, double *by_t, double *by_u)
{
    const Constants c = constants_of(&a->plane);
    const int nodes = n ? (int)a->plane.order[0] + 1 : 0;
    Targets t;
    for (int64_t first = 0; first < m; first += CHUNK) {
        load_targets(points, 0, first, m - first < CHUNK ? (int)(m - first) : CHUNK, &t);
        for (int64_t i = 0; i < n; i++) {
            const Element e = element_of(&a->plane, i);
            const double scale = 0.5 * c.scale * e.half;
            const Sum far = {of_stress, 2 * STRESSES, 1, scale, -scale / c.unit};
            const Sum near = {near_stress, 2 * STRESSES, 1, scale, -scale / c.unit};
            double out[NODES * 2 * STRESSES][CHUNK];
            int rule[CHUNK];
            rules_of(a->quadrature, &e, (int)a->least[i], &t, rule);
            memset(out, 0, sizeof out);
            sum_all(far, near, a->quadrature, &e, &c, &t, rule, (Wanted){1, 1, 0, nodes}, out);
            for (int k = 0; k < nodes; k++)
                for (int j = 0; j < 2 * STRESSES; j++) {
                    double *to = j < STRESSES ? by_t : by_u;
                    memcpy(to + ((j % STRESSES) * n * nodes + i * nodes + k) * m + first, out[k * 2 * STRESSES + j],
                           t.count * sizeof(double));
                }
        }
    }
}

/* 8π(1-ν) times 2µ ∫ U dθ (RR, RZ, ZR, ZZ, TT) and ∫ D dθ, (15, m), of a ring through (R, Z) at m points. */
DISPATCHED void petcontact_ring_forces(int64_t m, const double *x, double radius, double z, double nu, double *out)
{
    for (int64_t first = 0; first < m; first += LANES) {
        Vector r = {0.0}, dz = {0.0}, value[KINDS], unused[KINDS], by_t[STRESSES], by_u[STRESSES];
        for (int i = 0; i < LANES; i++) {
            const int64_t k = first + i < m ? first + i : m - 1;
            r[i] = x[2 * k];
            dz[i] = z - x[2 * k + 1];
        }
        const Vector none = 0.0 * r;
        const Rings ring = {r, radius + none, radius - r, dz, none, none, none};
        ring_kernels(&ring, nu, 0, value, unused);
        ring_stress(&ring, nu, by_t, by_u);
        for (int64_t i = 0; i < LANES && first + i < m; i++) {
            for (int k = 0; k < KINDS; k++)
                out[k * m + first + i] = value[k][i];
            for (int k = 0; k < STRESSES; k++)
                out[(KINDS + k) * m + first + i] = by_t[k][i];
        }
    }
}
