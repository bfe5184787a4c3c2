/* Places, tangents and Gauss points of curved panels. */

#ifndef PETCONTACT_CURVED_H
#define PETCONTACT_CURVED_H

#include "panel.h"

/* The same in lanes, from the target: r, normal times area, and area. */
INLINE void places_of(const double *shape, const double *x, Vector s, Vector t, Vector *r, Vector *normal, Vector *area)
{
    Vector a[3], b[3];
    for (int k = 0; k < 3; k++) {
        const double *c = shape + k;
        const Vector c0 = c[0] + t * (c[3] + t * c[6]), c1 = c[9] + t * (c[12] + t * c[15]),
                     c2 = c[18] + t * (c[21] + t * c[24]);
        r[k] = (c0 - x[k]) + s * (c1 + s * c2);
        a[k] = c1 + 2.0 * s * c2;
        b[k] = (c[3] + 2.0 * t * c[6]) + s * ((c[12] + 2.0 * t * c[15]) + s * (c[21] + 2.0 * t * c[24]));
    }
    for (int k = 0; k < 3; k++)
        normal[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
    const Vector square = normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2];
    for (int l = 0; l < LANES; l++)
        (*area)[l] = sqrt(square[l]);
}

/* Points of the reference element as a rule's points; their number is a multiple of the lanes. */
INLINE void points_of(const Panel *p, const double *xi, const double *eta, int count, Rule *rule)
{
    const double origin[3] = {0.0, 0.0, 0.0};
    for (int q = 0; q < count; q += LANES) {
        Vector s, t, r[3], normal[3], area;
        memcpy(&s, xi + q, sizeof s);
        memcpy(&t, eta + q, sizeof t);
        places_of(p->shape, origin, s, t, r, normal, &area);
        for (int c = 0; c < 3; c++) {
            memcpy(rule->x[c] + q, r + c, sizeof s);
            memcpy(rule->normal[c] + q, normal + c, sizeof s);
        }
        memcpy(rule->area + q, &area, sizeof s);
    }
    rule->scale = 1.0;
    rule->count = count;
}

/* Gauss points of a curved panel that is far. */
INLINE void curved_rule_of(const Panel *p, const Family *family, int first, int second, Rule *rule)
{
    const Rules *rules = family->rules;
    const int nx = (int)rules->count[first], ny = (int)rules->count[second];
    double xi[POINTS + LANES], eta[POINTS + LANES];
    int q = 0;
    for (int i = 0; i < nx; i++)
        for (int j = 0; j < ny; j++, q++) {
            const double s = rules->xi[first][i], t = rules->xi[second][j];
            xi[q] = p->corners == 4 ? s : 0.25 * (1.0 + s) * (1.0 - t);
            eta[q] = p->corners == 4 ? t : 0.5 * (1.0 + t);
        }
    for (; q % LANES; q++) {
        xi[q] = xi[q - 1];
        eta[q] = eta[q - 1];
    }
    points_of(p, xi, eta, q, rule);
    rule->weight = (const double(*)[NODES])(family->weights + (first * RULES + second) * POINTS * NODES);
    rule->nodal = p->corners == 4 && nx == p->order + 1 && ny == nx;
}

#endif
