/* Kelvin's solution of rings, a vector of pairs at a time.

   With d = (R-r)² + (Z-z)², b = 2rR and q = 1 - cos θ the squared distance is d + b q, and all vectors are polynomials in q:
   nothing cancels however near the ring is. Moments ∫ qⁿ (d + b q)^(-k/2) dθ over a turn come from complete elliptic integrals
   by the arithmetic-geometric mean of √(d+2b) and √d; where b < (d+2b)/4, which includes the axis, from the trapezoid rule,
   whose error falls like ((√(d+2b) - √d)/(√(d+2b) + √d))^ANGLES. */

#ifndef PETCONTACT_RING_H
#define PETCONTACT_RING_H

#include "../plane/elements.h"

enum { ANGLES = 20 }; /* 0.172^20 = 5e-16 */

/* q at the middles of half a turn's ANGLES/2 parts. */
static const double TURN[ANGLES / 2] = {0.012311659404862273, 0.10899347581163212, 0.2928932188134525, 0.546009500260453, 0.8435655349597692, 1.1564344650402305, 1.4539904997395467, 1.7071067811865475, 1.8910065241883678, 1.9876883405951378};

typedef struct { /* moments [n][(k-1)/2] */
    Vector m[5][4];
} Moments;

typedef struct { /* rings as seen from points: all of one vector */
    Vector r, radius, dr, dz, nr, nz; /* radius of the point, R, (R-r, Z-z), normal of the ring */
    Vector dn;                        /* n·(R-r, Z-z) */
} Rings;

INLINE Vector root_of(Vector x)
{
    Vector y = {0.0};
    for (int i = 0; i < LANES; i++)
        y[i] = sqrt(x[i]);
    return y;
}

INLINE Vector logarithm_of(Vector x)
{
    Vector y = {0.0};
    for (int i = 0; i < LANES; i++)
        y[i] = logarithm(x[i]);
    return y;
}

/* Elliptic integrals; powers up to `last` of 1/|x-y|² times 1/|x-y|. */
INLINE void elliptic_moments(Vector d, Vector b, int last, Moments *out)
{
    Vector (*m)[4] = out->m;
    const Vector s = d + 2.0 * b;
    Vector mean = root_of(s), root = root_of(d), rest = d + b;
    for (double power = 1.0; power < 65536.0; power *= 2.0) { /* rest = s - Σ 2^(n-1) c_n², c_0² = 2b */
        const Vector c = 0.5 * (mean - root), next = 0.5 * (mean + root);
        rest -= power * c * c;
        int wide = power < 8.0; /* it takes four steps at least */
        for (int i = 0; !wide && i < LANES; i++)
            wide = c[i] > 1e-9 * next[i];
        if (!wide) {
            mean = next;
            break;
        }
        root = root_of(mean * root);
        mean = next;
    }
    m[0][0] = 2.0 * PI / mean;
    Vector below = m[0][0] * rest; /* k = -1 */
    const Vector over = 1.0 / b, over_sd = 1.0 / (s * d);
    for (int k = 0; k <= last; k++) {
        if (k == 1)
            m[0][1] = below * over_sd;
        else if (k > 1) /* d/dθ of sin θ |x-y|^(2-k) integrates to zero */
            m[0][k] = ((4.0 * (k - 1)) * (d + b) * m[0][k - 1] - (2.0 * k - 3.0) * m[0][k - 2]) * over_sd / (2.0 * k - 1.0);
        for (int n = 1; n <= k + 1; n++)
            m[n][k] = ((k ? m[n - 1][k - 1] : below) - d * m[n - 1][k]) * over;
    }
}

INLINE void angular_moments(Vector d, Vector b, int last, Moments *out)
{
    memset(out, 0, sizeof *out);
    for (int j = 0; j < ANGLES / 2; j++) {
        const Vector inverse = 1.0 / (d + TURN[j] * b);
        Vector power = root_of(inverse) * (4.0 * PI / ANGLES);
        for (int k = 0; k <= last; k++, power *= inverse) {
            Vector term = power;
            for (int n = 0; n <= k + 1; n++, term *= TURN[j])
                out->m[n][k] += term;
        }
    }
}

INLINE void moments_of(const Rings *p, int last, Moments *out)
{
    const Vector d = p->dr * p->dr + p->dz * p->dz, b = 2.0 * p->r * p->radius;
    int slim[LANES], some = 0, all = 1;
    for (int i = 0; i < LANES; i++) {
        slim[i] = 2.0 * b[i] < d[i];
        some |= slim[i];
        all &= slim[i];
    }
    if (!all)
        elliptic_moments(d, b, last, out);
    if (!some)
        return;
    Moments found;
    angular_moments(d, b, last, &found);
    for (int k = 0; k <= last; k++)
        for (int n = 0; n <= k + 1; n++)
            for (int i = 0; i < LANES; i++)
                out->m[n][k][i] = slim[i] ? found.m[n][k][i] : out->m[n][k][i];
}

enum { RR, RZ, ZR, ZZ, TT, KINDS }; /* component at the point, component at the ring */

/* 8π(1-ν) times 2µ ∫ U dθ and -∫ T dθ. */
INLINE void ring_kernels(const Rings *p, double nu, int with_h, Vector *g, Vector *h)
{
    Moments found;
    moments_of(p, 1 + with_h, &found);
    const Vector(*m)[4] = (const Vector(*)[4])found.m;
    const double k = 1.0 - 2.0 * nu, factor = 3.0 - 4.0 * nu;
    const Vector r = p->r, R = p->radius, dr = p->dr, dz = p->dz, nr = p->nr, nz = p->nz, dn = p->dn;
    const Vector half_b = r * R, turned = m[0][0] - m[1][0], flat = m[0][1] - m[1][1];
    g[RR] = factor * turned + dr * dr * flat - half_b * m[2][1];
    g[RZ] = dz * (dr * m[0][1] - R * m[1][1]);
    g[ZR] = dz * (dr * m[0][1] + r * m[1][1]);
    g[ZZ] = factor * m[0][0] + dz * dz * m[0][1];
    g[TT] = (4.0 - 4.0 * nu) * turned;
    if (!with_h)
        return;
    const Vector lift = nr * r, both = dn * m[0][2] + lift * m[1][2], next = dn * m[1][2] + lift * m[2][2];
    const Vector last = dn * m[2][2] + lift * m[3][2]; /* ∫ qⁿ d·n/|x-y|⁵ */
    const Vector along = dr * m[0][1], radial = along - R * m[1][1], ring = along + r * m[1][1];
    h[RR] = k * (dn * flat + lift * (3.0 * m[1][1] - 2.0 * m[2][1])) + 3.0 * (dr * dr * (both - next) - half_b * last);
    h[RZ] = 3.0 * dz * (dr * both - R * next) - k * (nz * radial - dz * nr * flat);
    h[ZR] = 3.0 * dz * (dr * both + r * next) - k * (dz * nr * m[0][1] - nz * ring);
    h[ZZ] = k * (dn * m[0][1] + lift * m[1][1]) + 3.0 * dz * dz * both;
    h[TT] = (2.0 - 2.0 * nu) * (dn * flat + lift * (m[1][1] - m[2][1]) + nr * turned / (R + 1e-300)); /* 0 on the axis */
}

/* The same of plane strain and, for the third component, of a plane that slides out of itself; ln(ℓ²) is `log_unit`. */
INLINE void plane_kernels(const Rings *p, double nu, double log_unit, int with_h, Vector *g, Vector *h)
{
    const Vector over = 1.0 / (p->dr * p->dr + p->dz * p->dz), log = -0.5 * (logarithm_of(over) + log_unit);
    const Vector rr = p->dr * p->dr * over, rz = p->dr * p->dz * over, zz = p->dz * p->dz * over;
    const double k = 1.0 - 2.0 * nu, factor = 3.0 - 4.0 * nu;
    g[RR] = 2.0 * (rr - factor * log);
    g[RZ] = g[ZR] = 2.0 * rz;
    g[ZZ] = 2.0 * (zz - factor * log);
    g[TT] = -(8.0 - 8.0 * nu) * log;
    if (!with_h)
        return;
    const Vector dn = p->dn * over, turn = k * over * (p->nz * p->dr - p->nr * p->dz);
    h[RR] = 2.0 * dn * (k + 2.0 * rr);
    h[RZ] = 4.0 * dn * rz - 2.0 * turn;
    h[ZR] = 4.0 * dn * rz + 2.0 * turn;
    h[ZZ] = 2.0 * dn * (k + 2.0 * zz);
    h[TT] = (4.0 - 4.0 * nu) * dn;
}

#endif
