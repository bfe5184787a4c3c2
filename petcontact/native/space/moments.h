/* Moments of flat polygons in closed form: petcontact.bem.kelvin3d.moments in C, with the same recursions; see there. */

#ifndef PETCONTACT_MOMENTS_H
#define PETCONTACT_MOMENTS_H

#include "../elementary.h"

enum {
    HIGHEST = 3,              /* order of panels */
    POWER = HIGHEST + 3,      /* u^a v^b with a, b below */
    DEGREE = 2 * HIGHEST + 2, /* numbers of powers of t along an edge */
    EDGES = 4
};
static const double FLAT = 1e-12; /* heights below this fraction of the size are none */

typedef double Four __attribute__((vector_size(32))); /* the edges of a polygon; those that are missing add nothing */

typedef struct {
    Four normal_u, normal_v, distance, start, end;
} Edges;

typedef struct { /* Σ ν_u I[a, b], Σ ν_v I[0, b] and Σ s I[a, b] over the edges */
    double u[POWER][POWER], v[POWER], s[POWER][POWER];
} Table;

typedef struct { /* M_1, M_3, P = w M_3 and Q = 3w M_5, but w² Q[0, 0] beside */
    double m_1[POWER][POWER], m_3[POWER][POWER], p[POWER][POWER], q[POWER][POWER], w_q;
} Moments;

INLINE Edges edges_of(const double *polygon, int corners, double x, double y)
{
    Edges e = {{0.0}, {0.0}, {0.0}, {0.0}, {0.0}};
    for (int c = 0; c < EDGES; c++) {
        const double *a = polygon + 2 * c, *b = polygon + 2 * (c + 1 < corners ? c + 1 : 0);
        if (c >= corners) {
            e.normal_u[c] = e.normal_v[c] = e.distance[c] = 0.0;
            e.start[c] = e.end[c] = 1.0;
            continue;
        }
        double ax = a[0] - x, ay = a[1] - y, bx = b[0] - x, by = b[1] - y, dx = bx - ax, dy = by - ay;
        double length = sqrt(dx * dx + dy * dy);
        dx /= length;
        dy /= length;
        e.normal_u[c] = dy;
        e.normal_v[c] = -dx;
        e.start[c] = dx * ax + dy * ay;
        e.end[c] = dx * bx + dy * by;
        e.distance[c] = dy * ax - dx * ay;
    }
    return e;
}

/* ∫ t^j / r and ∫ t^j / r³ along the edges for j = 0 ... degree. */
INLINE void powers_of(const Edges *e, double w, int degree, int cubes, Four *first, Four *third)
{
    Four square = {0.0}, r_1 = {0.0}, r_2 = {0.0};
    for (int c = 0; c < EDGES; c++) {
        double s = e->distance[c], t_1 = e->start[c], t_2 = e->end[c];
        square[c] = s * s + w * w;
        r_1[c] = sqrt(square[c] + t_1 * t_1);
        r_2[c] = sqrt(square[c] + t_2 * t_2);
        /* where t keeps its sign, from the side where nothing cancels */
        int up = t_1 + t_2 > 0.0;
        double above = up ? t_2 + r_2[c] : r_1[c] - t_1, below = up ? t_1 + r_1[c] : r_2[c] - t_2;
        /* t changes its sign: the smaller of both is c² over the other */
        int cancels = up ? t_1 < 0.0 : t_2 > 0.0;
        double other = up ? r_1[c] - t_1 : r_2[c] + t_2;
        first[0][c] = cancels ? logarithm(above) + logarithm(other) - logarithm(square[c]) : logarithm(above / below);
        int same = t_1 * t_2 > 0.0;
        double x_1 = t_1 / r_1[c], x_2 = t_2 / r_2[c];
        third[0][c] = same ? (t_2 - t_1) * (t_2 + t_1) / (r_1[c] * r_2[c] * (t_2 * r_1[c] + t_1 * r_2[c]))
                           : (x_2 - x_1) / (square[c] == 0.0 ? 1.0 : square[c]);
    }
    Four t_1 = e->start, t_2 = e->end, top_1 = r_1, top_2 = r_2;
    if (degree > 0) {
        first[1] = (t_2 - t_1) * (t_2 + t_1) / (r_2 + r_1);
        third[1] = 1.0 / r_1 - 1.0 / r_2;
    }
    for (int j = 2; j <= degree; j++) {
        top_1 *= t_1;
        top_2 *= t_2;
        first[j] = (top_2 - top_1 - (double)(j - 1) * square * first[j - 2]) / (double)j;
        if (cubes)
            third[j] = first[j - 2] - square * third[j - 2];
    }
}

INLINE double sum_of(const Four *x)
{
    return (((*x)[0] + (*x)[1]) + (*x)[2]) + (*x)[3];
}

/* a, b <= highest, a + b <= degree */
INLINE void table_of(const Edges *e, const Four *powers, int highest, int degree, Table *t)
{
    const Four along_u = -e->normal_v, along_v = e->normal_u, across_u = e->distance * e->normal_u,
               across_v = e->distance * e->normal_v;
    Four base[DEGREE], line[DEGREE];
    for (int j = 0; j <= degree; j++)
        base[j] = powers[j];
    for (int b = 0; b <= highest && b <= degree; b++) {
        for (int j = 0; j <= degree - b; j++)
            line[j] = base[j];
        for (int a = 0; a <= highest && a + b <= degree; a++) {
            const Four out = e->normal_u * line[0], across = e->distance * line[0];
            t->u[a][b] = sum_of(&out);
            t->s[a][b] = sum_of(&across);
            for (int j = 0; j < degree - b - a; j++)
                line[j] = across_u * line[j] + along_u * line[j + 1];
        }
        const Four out = e->normal_v * base[0];
        t->v[b] = sum_of(&out);
        for (int j = 0; j < degree - b; j++)
            base[j] = across_v * base[j] + along_v * base[j + 1];
    }
}

/* ∫ w / r³: 0 in the plane of the polygon. */
INLINE double solid_angle(const Edges *e, double w)
{
    double height = fabs(w), total = 0.0;
    for (int c = 0; c < EDGES; c++) {
        double s = e->distance[c], t_1 = e->start[c], t_2 = e->end[c], square = s * s + w * w;
        total += angle_of(s * t_2, square + height * sqrt(square + t_2 * t_2));
        total -= angle_of(s * t_1, square + height * sqrt(square + t_1 * t_1));
    }
    return w > 0.0 ? total : w < 0.0 ? -total : 0.0;
}

/* a, b <= order + 2, a + b <= degree + 2 (M_1: degree); Q where the traction is wanted. */
INLINE void moments_of(const double *polygon, int corners, double x, double y, double w, int order, int degree, int traction,
                       Moments *m)
{
    Edges e = edges_of(polygon, corners, x, y);
    Four first[DEGREE], third[DEGREE];
    Table one, three;
    powers_of(&e, w, degree + 1, traction, first, third);
    table_of(&e, first, order + 2, degree + 1, &one);
    if (traction)
        table_of(&e, third, order + 2, degree + 1, &three);
    m->p[0][0] = solid_angle(&e, w);
    for (int total = 0; total <= degree + 2; total++) {
        for (int a = total > order + 2 ? total - order - 2 : 0; a <= total && a <= order + 2; a++) {
            int b = total - a;
            if (a > 0)
                m->m_3[a][b] = (a > 1 ? (a - 1) * m->m_1[a - 2][b] : 0.0) - one.u[a - 1][b];
            else if (b > 0)
                m->m_3[a][b] = (b > 1 ? (b - 1) * m->m_1[a][b - 2] : 0.0) - one.v[b - 1];
            if (total > 0)
                m->p[a][b] = w * m->m_3[a][b];
            if (traction && a > 0)
                m->q[a][b] = (a > 1 ? (a - 1) * m->p[a - 2][b] : 0.0) - w * three.u[a - 1][b];
            else if (traction && b > 0)
                m->q[a][b] = (b > 1 ? (b - 1) * m->p[a][b - 2] : 0.0) - w * three.v[b - 1];
            if (total <= degree)
                m->m_1[a][b] = (one.s[a][b] - w * m->p[a][b]) / (total + 1);
        }
    }
    m->w_q = traction ? m->p[0][0] + w * three.s[0][0] : 0.0;
}

#endif
