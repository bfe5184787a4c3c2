/* The nearest point of a curved panel by Newton's method, from the nearest of a few points of it and along the sides once it has
   met them. */

#ifndef PETCONTACT_FOOT_H
#define PETCONTACT_FOOT_H

#include "panel.h"

enum { STEPS = 20 /* to a foot, at most */ };
static const double ROUNDED = 0x1p-46; /* round_off.ROUNDED */

/* Position and derivatives along both coordinates. */
INLINE void place_of(const double *shape, double s, double t, double *y, double *along, double *up)
{
    for (int k = 0; k < 3; k++) {
        const double *c = shape + k;
        const double c0 = c[0] + t * (c[3] + t * c[6]), c1 = c[9] + t * (c[12] + t * c[15]),
                     c2 = c[18] + t * (c[21] + t * c[24]);
        y[k] = c0 + s * (c1 + s * c2);
        along[k] = c1 + 2.0 * s * c2;
        up[k] = (c[3] + 2.0 * t * c[6]) + s * ((c[12] + 2.0 * t * c[15]) + s * (c[21] + 2.0 * t * c[24]));
    }
}

INLINE double dot3(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* The nearest point of a panel, and the distance. Sides hold a foot that they push back, or that Newton's step would carry past
   them. In a corner the sides share what pushes: those of a triangle are not at right angles in the reference coordinates. Far
   from a minimum the metric alone leads downhill. */
INLINE double foot_of(const Panel *p, const double *x, double *foot)
{
    static const double WALLS[2][4][3] = {{{-1.0, 0.0, 0.0}, {0.0, -1.0, 0.0}, {1.0, 1.0, 1.0}, {0.0, 0.0, 1.0}},
                                          {{-1.0, 0.0, 1.0}, {0.0, -1.0, 1.0}, {1.0, 0.0, 1.0}, {0.0, 1.0, 1.0}}};
    const double(*walls)[3] = WALLS[p->corners == 4];
    double y[3], a[3], b[3], best = INFINITY;
    for (int i = 0; i < 5; i++)
        for (int j = 0; j < (p->corners == 4 ? 5 : 5 - i); j++) {
            const double s = p->corners == 4 ? 0.5 * i - 1.0 : 0.25 * i, t = p->corners == 4 ? 0.5 * j - 1.0 : 0.25 * j;
            place_of(p->shape, s, t, y, a, b);
            for (int k = 0; k < 3; k++)
                y[k] -= x[k];
            const double square = dot3(y, y);
            if (square < best) {
                best = square;
                foot[0] = s;
                foot[1] = t;
            }
        }
    for (int n = 0; n < STEPS; n++) {
        const double s = foot[0], t = foot[1], *c = p->shape;
        double aa[3], ab[3], bb[3];
        place_of(c, s, t, y, a, b);
        for (int k = 0; k < 3; k++) {
            y[k] -= x[k];
            aa[k] = 2.0 * (c[18 + k] + t * (c[21 + k] + t * c[24 + k]));
            bb[k] = 2.0 * (c[6 + k] + s * (c[15 + k] + s * c[24 + k]));
            ab[k] = c[12 + k] + 2.0 * (t * c[15 + k] + s * c[21 + k]) + 4.0 * s * t * c[24 + k];
        }
        /* a panel that has collapsed onto a line or a point has no length across it */
        const double slope[2] = {dot3(a, y), dot3(b, y)}, least = ROUNDED * (dot3(a, a) + dot3(b, b)) + 1e-300;
        const double m00 = dot3(a, a) + least, m01 = dot3(a, b), m11 = dot3(b, b) + least;
        double h00 = m00 + dot3(aa, y), h01 = m01 + dot3(ab, y), h11 = m11 + dot3(bb, y);
        if (!(h00 > 0.2 * m00 && h00 * h11 - h01 * h01 > 0.04 * (m00 * m11 - m01 * m01))) {
            h00 = m00;
            h01 = m01;
            h11 = m11;
        }
        const double over = 1.0 / (h00 * h11 - h01 * h01);
        double step[2] = {-(h11 * slope[0] - h01 * slope[1]) * over, -(h00 * slope[1] - h01 * slope[0]) * over};
        double share = 1.0, most = 0.0, push[4] = {0.0};
        int met = 0, at[4], held = 0, wall = 0, is_active[4] = {0};
        for (int k = 0; k < p->corners; k++) {
            const double *w = walls[k];
            push[k] = -(w[0] * slope[0] + w[1] * slope[1]);
            if (w[0] * s + w[1] * t >= w[2] - 1e-12)
                at[met++] = k;
        }
        for (int i = 0; i < met; i++) { /* in a corner two sides share what pushes */
            const int k = at[i], o = at[met - 1 - i];
            const double *w = walls[k], *v = walls[o];
            const double square = v[0] * v[0] + v[1] * v[1], beside = w[0] * v[0] + w[1] * v[1];
            is_active[k] = (met == 2 ? square * push[k] - beside * push[o] : push[k]) > 0.0;
            wall = is_active[k] && !held ? k : wall;
            held += is_active[k];
        }
        for (int i = 0; i < met && (!held || most > 0.0); i++) { /* what Newton's step would pass */
            const double *w = walls[at[i]], rate = w[0] * step[0] + w[1] * step[1];
            if (rate > most) {
                is_active[wall] = 0;
                most = rate;
                held = 1;
                wall = at[i];
                is_active[wall] = 1;
            }
        }
        if (held > 1)
            step[0] = step[1] = 0.0;
        else if (held) {
            const double u = -walls[wall][1], v = walls[wall][0];
            const double length = -(u * slope[0] + v * slope[1]) / (u * u * h00 + 2.0 * u * v * h01 + v * v * h11);
            step[0] = length * u;
            step[1] = length * v;
        }
        for (int k = 0; k < p->corners; k++) {
            const double *w = walls[k], rate = w[0] * step[0] + w[1] * step[1];
            const double room = w[2] - (w[0] * s + w[1] * t);
            if (!is_active[k] && rate > 0.0 && room < share * rate)
                share = room > 0.0 ? room / rate : 0.0;
        }
        foot[0] += share * step[0];
        foot[1] += share * step[1];
        if (fabs(step[0]) < 1e-9 && fabs(step[1]) < 1e-9)
            break;
    }
    place_of(p->shape, foot[0], foot[1], y, a, b);
    for (int k = 0; k < 3; k++)
        y[k] -= x[k];
    return sqrt(dot3(y, y));
}

#endif
