/* Kelvin's solution of rings, a vector of pairs at a time.

   With d = (R-r)² + (Z-z)², b = 2rR and q = 1 - cos θ the squared distance is d + b q, and all vectors are polynomials in q:
   nothing cancels however near the ring is. Moments ∫ qⁿ (d + b q)^(-k/2) dθ over a turn come from complete elliptic integrals
   by the arithmetic-geometric mean of √(d+2b) and √d; where b < (d+2b)/4, which includes the axis, from the trapezoid rule,
   whose error falls like ((√(d+2b) - √d)/(√(d+2b) + √d))^ANGLES. */

#ifndef PETCONTACT_RING_H
#define PETCONTACT_RING_H

#include "../plane/arcs.h"
#include "../plane/straight.h"

enum { ANGLES = 20 }; /* 0.172^20 = 5e-16 */

/* q at the middles of half a turn's ANGLES/2 parts. */
static const double TURN[ANGLES / 2] = {0.012311659404862273, 0.10899347581163212, 0.2928932188134525, 0.546009500260453,
                                        0.8435655349597692,   1.1564344650402305,  1.4539904997395467, 1.7071067811865475,
                                        1.8910065241883678,   1.9876883405951378};

typedef struct {                      /* rings as seen from points: all of one vector */
    Vector r, radius, dr, dz, nr, nz; /* radius of the point, R, (R-r, Z-z), normal of the ring */
    Vector dn;                        /* n·(R-r, Z-z) */
} Rings;

INLINE Vector each(double (*function)(double), Vector x)
{
    for (int i = 0; i < LANES; i++)
        x[i] = function(x[i]);
    return x;
}

typedef struct { /* ∫ qⁿ f dθ for n = 0, 1 ... */
    Vector n[5];
} Series;

/* Of (d + b q)^(½-k), k = 0 ... `count` - 1, n <= k, by elliptic integrals, where d is not 0. */
INLINE void elliptic_moments(Vector d, Vector b, int count, Series *m)
{
    const Vector s = d + 2.0 * b, over = 1.0 / b, over_sd = 1.0 / (s * d);
    Vector mean = each(sqrt, s), root = each(sqrt, d), rest = d + b; /* s - Σ 2^(n-1) c_n², c_0² = 2b */
    int wide = 1;
    for (double power = 1.0; wide; power *= 2.0) {
        const Vector c = 0.5 * (mean - root), product = mean * root;
        rest -= power * c * c;
        mean -= c;
        wide = power < 8.0; /* it takes four steps at least */
        for (int i = 0; !wide && i < LANES; i++)
            wide = c[i] > 1e-9 * mean[i];
        if (wide)
            root = each(sqrt, product);
    }
    m[1].n[0] = 2.0 * PI / mean;
    m[0].n[0] = m[1].n[0] * rest;
    for (int k = 1; k < count; k++) {
        if (k > 1) /* d/dθ of sin θ (d + b q)^(3/2-k) integrates to zero */
            m[k].n[0] =
                (4.0 * (k - 2) * (d + b) * m[k - 1].n[0] - (2.0 * k - 5.0) * m[k - 2].n[0]) * over_sd / (2.0 * k - 3.0);
        for (int n = 1; n <= k; n++)
            m[k].n[n] = (m[k - 1].n[n - 1] - d * m[k].n[n - 1]) * over;
    }
}

/* The same near the axis as well. */
INLINE void moments_of(const Rings *p, int count, Series *m)
{
    const Vector d = p->dr * p->dr + p->dz * p->dz, b = 2.0 * p->r * p->radius;
    int slim = 0; /* a bit for each */
    for (int i = 0; i < LANES; i++)
        slim |= (2.0 * b[i] < d[i]) << i;
    if (slim != (1 << LANES) - 1)
        elliptic_moments(d, b, count, m);
    if (!slim)
        return;
    Series found[5] = {{{{0.0}}}};
    for (int j = 0; j < ANGLES / 2; j++) {
        const Vector inverse = 1.0 / (d + TURN[j] * b);
        Vector power = each(sqrt, inverse) * (4.0 * PI / ANGLES);
        for (int k = 1; k < count; k++, power *= inverse) {
            Vector term = power;
            for (int n = 0; n <= k; n++, term *= TURN[j])
                found[k].n[n] += term;
        }
    }
    for (int k = 1; k < count; k++)
        for (int n = 0; n <= k; n++)
            for (int i = 0; i < LANES; i++)
                m[k].n[n][i] = slim >> i & 1 ? found[k].n[n][i] : m[k].n[n][i];
}

enum { RR, RZ, ZR, ZZ, TT, KINDS }; /* component at the point, component at the ring */

/* ∫ f (a + b q) qⁿ dθ from ∫ f qⁿ dθ, and ∫ f sin² θ qⁿ dθ: sin² θ = q (2 - q). */
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

/* 8π(1-ν) times 2µ ∫ U dθ and -∫ T dθ; where `less` is not null, without what plane strain and a plane that slides out of
   itself have over R, whose logarithm's unit has the logarithm *less. The plane has all its moments at q = 0. */
INLINE void ring_kernels(const Rings *p, double nu, const double *less, Vector *g, Vector *h)
{
    Series m[4];
    moments_of(p, 4, m);
    const Vector whole = m[1].n[0] - m[1].n[1], over_radius = 1.0 / (p->radius + 1e-300); /* 0 times it is 0 on the axis */
    if (less) {
        const Vector over = 1.0 / (p->dr * p->dr + p->dz * p->dz), share = over * over_radius;
        m[1].n[0] -= (each(logarithm, over) + 2.0 * *less) * over_radius;
        m[2].n[0] -= 2.0 * share;
        m[3].n[0] -= 4.0 / 3.0 * over * share;
    }
    const double k = 1.0 - 2.0 * nu, factor = 3.0 - 4.0 * nu;
    const Vector r = p->r, R = p->radius, dr = p->dr, dz = p->dz, nr = p->nr, nz = p->nz, dn = p->dn;
    const Vector half_b = r * R, lift = nr * r, turned = m[1].n[0] - m[1].n[1], flat = m[2].n[0] - m[2].n[1];
    g[RR] = factor * turned + dr * dr * flat - half_b * m[2].n[2];
    g[RZ] = dz * (dr * m[2].n[0] - R * m[2].n[1]);
    g[ZR] = dz * (dr * m[2].n[0] + r * m[2].n[1]);
    g[ZZ] = factor * m[1].n[0] + dz * dz * m[2].n[0];
    g[TT] = (4.0 - 4.0 * nu) * turned;
    const Series fifth = times(m[3], dn, lift); /* d·n/|x-y|⁵ */
    const Vector both = fifth.n[0], next = fifth.n[1], last = fifth.n[2];
    const Vector along = dr * m[2].n[0], radial = along - R * m[2].n[1], ring = along + r * m[2].n[1];
    h[RR] = k * (dn * flat + lift * (3.0 * m[2].n[1] - 2.0 * m[2].n[2])) + 3.0 * (dr * dr * (both - next) - half_b * last);
    h[RZ] = 3.0 * dz * (dr * both - R * next) - k * (nz * radial - dz * nr * flat);
    h[ZR] = 3.0 * dz * (dr * both + r * next) - k * (dz * nr * m[2].n[0] - nz * ring);
    h[ZZ] = k * (dn * m[2].n[0] + lift * m[2].n[1]) + 3.0 * dz * dz * both;
    h[TT] = (2.0 - 2.0 * nu) * (dn * flat + lift * (m[2].n[1] - m[2].n[2]) + nr * whole * over_radius);
}

enum { STRESSES = 10 }; /* at points: rr, zz, rz and θθ by r and by z, rθ and zθ by θ */

/* ∫ low (turned (δ_il d_j + δ_jl d_i) + bulk δ_ij d_l) + high d_i d_j d_l, d = x - y, l the load; r, c, s: times the component of
   d along r at the point, cos θ and sin² θ. */
INLINE void of_distance(const Rings *p, Series low, Series high, double turned, double bulk, Vector *out)
{
    const Vector one = 1.0 + 0.0 * p->r, r = p->r, R = p->radius, dr = p->dr, dz = p->dz;
    const Series high_r = times(high, dr, -R), high_rr = times(high_r, dr, -R), high_s = times_sines(high);
    const Series low_c = times(low, one, -one);
    const Vector c = turned * low_c.n[0], cr = turned * times(low_c, dr, -R).n[0], s = turned * R * times_sines(low).n[0];
    const Vector plain = bulk * low.n[0], along = bulk * times(low, dr, r).n[0];
    out[0] = 2.0 * cr + along + times(high_rr, dr, r).n[0];
    out[1] = dz * (plain + high_rr.n[0]);
    out[2] = along + dz * dz * times(high, dr, r).n[0];
    out[3] = dz * (2.0 * turned * low.n[0] + plain + dz * dz * high.n[0]);
    out[4] = dz * (c + times(high_r, dr, r).n[0]);
    out[5] = turned * times(low, dr, -R).n[0] + dz * dz * high_r.n[0];
    out[6] = 2.0 * s + along + R * R * times(high_s, dr, r).n[0];
    out[7] = dz * (plain + R * R * high_s.n[0]);
    out[8] = cr - s + r * R * times(high_s, dr, -R).n[0];
    out[9] = dz * (c + r * R * high_s.n[0]);
}

/* 8π(1-ν) times ∫ D dθ and -∫ S/2µ dθ. In names of products r, a, c and s are the components of d along r at the point and along
   the radius of the ring, cos θ and sin² θ. */
INLINE void ring_stress(const Rings *p, double nu, Vector *by_t, Vector *by_u)
{
    Series m[5] = {{{{0.0}}}};
    moments_of(p, 5, m);
    for (int n = 0; n < 5; n++) {
        m[3].n[n] *= 3.0;
        m[4].n[n] *= -15.0;
    }
    const Vector one = 1.0 + 0.0 * p->r, r = p->r, R = p->radius, dr = p->dr, dz = p->dz, nr = p->nr, nz = p->nz;
    const double k = 1.0 - 2.0 * nu;
    const Series third = m[2], fifth = m[3], fifth_r = times(fifth, dr, -R), fifth_c = times(fifth, one, -one),
                 fifth_s = times_sines(fifth), fifth_cr = times(fifth_c, dr, -R), third_c = times(third, one, -one);
    of_distance(p, third, fifth, k, -k, by_t);
    of_distance(p, times(fifth, p->dn, nr * r), times(m[4], p->dn, nr * r), nu, k, by_u);
    const Vector f = fifth.n[0], fr = fifth_r.n[0], fs = fifth_s.n[0], fcr = fifth_cr.n[0], tc = third_c.n[0],
                 frr = times(fifth_r, dr, -R).n[0], tcc = times(third_c, one, -one).n[0], ts = times_sines(third).n[0],
                 bulk = (1.0 - 4.0 * nu) * third.n[0];
    by_u[0] += nr * (2.0 * nu * times(fifth_cr, dr, r).n[0] + k * frr + 2.0 * k * tcc - bulk);
    by_u[1] += 2.0 * nu * nr * dz * fcr + nz * (k * frr - bulk);
    by_u[2] += 2.0 * nu * nz * dz * times(fifth, dr, r).n[0] + nr * (k * dz * dz * f - bulk);
    by_u[3] += nz * (dz * dz * f + third.n[0]);
    by_u[4] += dz * nr * (nu * times(fifth_c, dr, r).n[0] + k * fr) + nz * (nu * times(fifth_r, dr, r).n[0] + k * tc);
    by_u[5] += nu * nr * dz * dz * fifth_c.n[0] + (1.0 - nu) * nz * dz * fr + k * nr * tc;
    by_u[6] += nr * (2.0 * nu * R * times(fifth_s, dr, r).n[0] + k * R * R * fs + 2.0 * k * ts - bulk);
    by_u[7] += 2.0 * nu * nr * R * dz * fs + nz * (k * R * R * fs - bulk);
    by_u[8] += nr * (nu * r * (R * times(fifth_s, one, -one).n[0] + times(fifth_s, dr, -R).n[0]) + k * (tcc - ts));
    by_u[9] += nu * r * (nz * R + nr * dz) * fs + k * nz * tc;
}

#endif
