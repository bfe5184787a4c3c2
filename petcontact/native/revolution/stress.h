/* Stress at points by rings. All vectors are linear in q but for sin² θ = q (2 - q): products are taken one factor after another
   on the moments themselves. */

#ifndef PETCONTACT_RING_STRESS_H
#define PETCONTACT_RING_STRESS_H

#include "ring.h"

enum { STRESSES = 10 }; /* rr, zz, rz and θθ by r and by z, rθ and zθ by θ */

typedef struct { /* ∫ qⁿ f for n = 0, 1 ... */
    Vector n[5];
} Series;

/* The same of f (a + b q), and of f sin² θ. */
INLINE Series times(Series f, Vector a, Vector b)
{
    for (int n = 0; n < 4; n++)
        f.n[n] = a * f.n[n] + b * f.n[n + 1];
    return f;
}

INLINE Series times_sines(Series f)
{
    for (int n = 0; n < 3; n++)
        f.n[n] = 2.0 * f.n[n + 1] - f.n[n + 2];
    return f;
}

/* 8π(1-ν) times ∫ D dθ and -∫ S/2µ dθ. In names of products r, a, c and s are the components of x - y along r at the point and
   along the radius of the ring, cos θ and sin² θ; m are moments, w those with n·(x-y), and 3, 5, 7 powers of 1/|x-y|. */
INLINE void ring_stress(const Rings *p, double nu, Vector *by_t, Vector *by_u)
{
    Moments all = {0};
    moments_of(p, 3, &all);
    Series m3, m5, m7;
    for (int n = 0; n < 5; n++) {
        m3.n[n] = all.m[n][1];
        m5.n[n] = all.m[n][2];
        m7.n[n] = all.m[n][3];
    }
    const Vector none = 0.0 * p->r, one = 1.0 + none, r = p->r, R = p->radius, dr = p->dr, dz = p->dz, nr = p->nr, nz = p->nz;
    const double k = 1.0 - 2.0 * nu, bulk = 1.0 - 4.0 * nu;
    const Series m3r = times(m3, dr, -R), m3c = times(m3, one, -one), m5r = times(m5, dr, -R), m5a = times(m5, dr, r),
                 m5c = times(m5, one, -one), m5s = times_sines(m5), w5 = times(m5, p->dn, nr * r),
                 w7 = times(m7, p->dn, nr * r), w7r = times(w7, dr, -R), w7s = times_sines(w7), m5rr = times(m5r, dr, -R),
                 m5cr = times(m5c, dr, -R), w7rr = times(w7r, dr, -R);
    const Vector m3a = times(m3, dr, r).n[0], m3s = times_sines(m3).n[0], m3cr = times(m3c, dr, -R).n[0],
                 m3cc = times(m3c, one, -one).n[0], m5ra = times(m5r, dr, r).n[0], m5sa = times(m5s, dr, r).n[0],
                 m5sr = times(m5s, dr, -R).n[0], m5sc = times(m5s, one, -one).n[0], m5ca = times(m5c, dr, r).n[0],
                 w5a = times(w5, dr, r).n[0], w5r = times(w5, dr, -R).n[0], w5c = times(w5, one, -one).n[0],
                 w5s = times_sines(w5).n[0], w5cr = times(times(w5, one, -one), dr, -R).n[0];
    by_t[0] = k * (2.0 * m3cr - m3a) + 3.0 * times(m5rr, dr, r).n[0];
    by_t[1] = dz * (3.0 * m5rr.n[0] - k * m3.n[0]);
    by_t[2] = 3.0 * dz * dz * m5a.n[0] - k * m3a;
    by_t[3] = dz * (3.0 * dz * dz * m5.n[0] + k * m3.n[0]);
    by_t[4] = dz * (3.0 * m5ra + k * m3c.n[0]);
    by_t[5] = 3.0 * dz * dz * m5r.n[0] + k * m3r.n[0];
    by_t[6] = k * (2.0 * R * m3s - m3a) + 3.0 * R * R * m5sa;
    by_t[7] = dz * (3.0 * R * R * m5s.n[0] - k * m3.n[0]);
    by_t[8] = k * (m3cr - R * m3s) + 3.0 * r * R * m5sr;
    by_t[9] = dz * (k * m3c.n[0] + 3.0 * r * R * m5s.n[0]);
    by_u[0] = 3.0 * k * w5a - 15.0 * times(w7rr, dr, r).n[0] + 6.0 * nu * (w5cr + nr * times(m5cr, dr, r).n[0]) +
              nr * (3.0 * k * m5rr.n[0] + 2.0 * k * m3cc - bulk * m3.n[0]);
    by_u[1] = dz * (3.0 * k * w5.n[0] - 15.0 * w7rr.n[0] + 6.0 * nu * nr * m5cr.n[0]) +
              nz * (3.0 * k * m5rr.n[0] - bulk * m3.n[0]);
    by_u[2] = 3.0 * k * w5a - 15.0 * dz * dz * times(w7, dr, r).n[0] + 6.0 * nu * nz * dz * m5a.n[0] +
              nr * (3.0 * k * dz * dz * m5.n[0] - bulk * m3.n[0]);
    by_u[3] = dz * (3.0 * w5.n[0] - 15.0 * dz * dz * w7.n[0]) + nz * (3.0 * dz * dz * m5.n[0] + m3.n[0]);
    by_u[4] = dz * (3.0 * nu * (w5c + nr * m5ca) - 15.0 * times(w7r, dr, r).n[0] + 3.0 * k * nr * m5r.n[0]) +
              nz * (3.0 * nu * m5ra + k * m3c.n[0]);
    by_u[5] = 3.0 * nu * (w5r + nr * dz * dz * m5c.n[0]) - 15.0 * dz * dz * w7r.n[0] +
              3.0 * (1.0 - nu) * nz * dz * m5r.n[0] + k * nr * m3c.n[0];
    by_u[6] = 3.0 * k * w5a - 15.0 * R * R * times(w7s, dr, r).n[0] + 6.0 * nu * R * (w5s + nr * m5sa) +
              nr * (3.0 * k * R * R * m5s.n[0] + 2.0 * k * m3s - bulk * m3.n[0]);
    by_u[7] = dz * (3.0 * k * w5.n[0] - 15.0 * R * R * w7s.n[0] + 6.0 * nu * nr * R * m5s.n[0]) +
              nz * (3.0 * k * R * R * m5s.n[0] - bulk * m3.n[0]);
    by_u[8] = 3.0 * nu * (w5cr - R * w5s + nr * r * (R * m5sc + m5sr)) - 15.0 * r * R * times(w7s, dr, -R).n[0] +
              k * nr * (m3cc - m3s);
    by_u[9] = 3.0 * nu * (dz * w5c + r * (nz * R + nr * dz) * m5s.n[0]) - 15.0 * dz * r * R * w7s.n[0] + k * nz * m3c.n[0];
}

#endif
