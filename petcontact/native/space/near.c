/* Both kernels over a panel that is near, in closed form: petcontact.bem.kelvin3d.integrals in C, with the same formulas. */

#include "panel.h"

/* From monomials about (x, y) to those about the origin of local coordinates, one sum for each. */
INLINE void shift(const Panel *p, double x, double y, double (*sums)[HIGHEST + 1])
{
    for (int b = 0; b <= p->order; b++) {
        int last = p->corners == 4 ? p->order : p->order - b;
        for (int step = 0; step < last; step++)
            for (int a = last; a > step; a--)
                sums[a][b] += x * sums[a - 1][b];
    }
    for (int a = 0; a <= p->order; a++) {
        int last = p->corners == 4 ? p->order : p->order - a;
        for (int step = 0; step < last; step++)
            for (int b = last; b > step; b--)
                sums[a][b] += y * sums[a][b - 1];
    }
}

/* One pair in closed form; `place` is the target in local coordinates, and the height of the plane above it. */
DISPATCHED void petcontact_near(const Panel *p, const double *place, double nu, Wanted wanted, double *values, int width)
{
    const int wants_g = wanted.g, wants_h = wanted.h, node = wanted.node, last_node = wanted.last;
    const double x = place[0], y = place[1], w = place[2];
    enum { LOCAL = 14 }; /* U: 6, T: 6 of its symmetric part and 2 of the other */
    const double one_2nu = 1.0 - 2.0 * nu, scale = 1.0 / (8.0 * PI * (1.0 - nu));
    Moments m;
    moments_of(p->polygon, p->corners, x, y, w, p->order, p->degree, wants_h, &m);
    double local[LOCAL][HIGHEST + 1][HIGHEST + 1];
    for (int a = 0; a <= p->order; a++)
        for (int b = 0; b <= (p->corners == 4 ? p->order : p->order - a); b++) {
            if (wants_g) {
                double part = (3.0 - 4.0 * nu) * m.m_1[a][b];
                local[0][a][b] = part + m.m_3[a + 2][b];
                local[1][a][b] = m.m_3[a + 1][b + 1];
                local[2][a][b] = m.p[a + 1][b];
                local[3][a][b] = part + m.m_3[a][b + 2];
                local[4][a][b] = m.p[a][b + 1];
                local[5][a][b] = part + w * m.p[a][b];
            }
            if (wants_h) {
                double part = one_2nu * m.p[a][b];
                local[6][a][b] = part + m.q[a + 2][b];
                local[7][a][b] = m.q[a + 1][b + 1];
                local[8][a][b] = w * m.q[a + 1][b];
                local[9][a][b] = part + m.q[a][b + 2];
                local[10][a][b] = w * m.q[a][b + 1];
                local[11][a][b] = part + (a + b ? w * w * m.q[a][b] : m.w_q);
                local[12][a][b] = one_2nu * m.m_3[a + 1][b];
                local[13][a][b] = one_2nu * m.m_3[a][b + 1];
            }
        }
    const double *f = p->frame;
    const int low = wants_g ? 0 : G, high = wants_h ? LOCAL : G;
    for (int c = low; c < high; c++)
        shift(p, x, y, local[c]);
    for (int n = node; n < last_node; n++) {
        double nodal[LOCAL], *out = values + n * ALL * width;
        const double *coefficients = p->coefficients + n * p->nodes;
        for (int c = low; c < high; c++) {
            double sum = 0.0;
            for (int a = 0, k = 0; a <= p->order; a++)
                for (int b = 0; b <= (p->corners == 4 ? p->order : p->order - a); b++)
                    sum += coefficients[k++] * local[c][a][b];
            nodal[c] = sum;
        }
        for (int part = wants_g ? 0 : 1; part < (wants_h ? 2 : 1); part++) {
            const double *t = nodal + G * part;
            double half[3][3], turn[3];
            for (int i = 0; i < 3; i++)
                for (int b = 0; b < 3; b++)
                    half[i][b] = f[i] * t[PLACE[0][b]] + f[3 + i] * t[PLACE[1][b]] + f[6 + i] * t[PLACE[2][b]];
            if (part)
                for (int i = 0; i < 3; i++)
                    turn[i] = f[i] * nodal[12] + f[3 + i] * nodal[13];
            for (int i = 0; i < 3; i++)
                for (int j = part ? 0 : i; j < 3; j++) {
                    double value = half[i][0] * f[j] + half[i][1] * f[3 + j] + half[i][2] * f[6 + j];
                    if (part)
                        out[(G + 3 * i + j) * width] = scale * ((turn[i] * f[6 + j] - turn[j] * f[6 + i]) - value);
                    else
                        out[PLACE[i][j] * width] = scale * p->size * value;
                }
        }
    }
}
