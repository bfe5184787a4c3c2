/* Both kernels summed over the Gauss points that stand for a panel, from afar. */

#ifndef PETCONTACT_SOURCES_H
#define PETCONTACT_SOURCES_H

#include "panel.h"

/* r r/r³ (6), and w r r/r⁵ (6), r/r³ (3) at vectors r; on curved panels, whose normals come times the area, the first six
   times that, and instead of the last three r n - n r, over r³, at 01, 02 and 12. For vectors of two lengths: eight targets
   at once, and four rays (eight do not fit into the registers of AVX2). */
#define DEFINE_PRODUCTS(NAME, TYPE) \
    INLINE void NAME(const TYPE *r, const TYPE *normal, TYPE area, int curved, int wants_g, int wants_h, TYPE *out) \
    { \
        const TYPE x = r[0], y = r[1], z = r[2], square = x * x + y * y + z * z; \
        TYPE over = {0.0}; \
        for (int l = 0; l < (int)(sizeof(TYPE) / sizeof(double)); l++) \
            over[l] = sqrt(square[l]); \
        over = 1.0 / over; \
        const TYPE cube = over * over * over, pairs[G] = {x * x, x * y, x * z, y * y, y * z, z * z}; \
        if (wants_g) { \
            const TYPE factor = curved ? area * cube : cube; \
            for (int c = 0; c < G; c++) \
                out[c] = pairs[c] * factor; \
        } \
        if (wants_h) { \
            const TYPE fifth = (x * normal[0] + y * normal[1] + z * normal[2]) * (cube * over * over); \
            for (int c = 0; c < G; c++) \
                out[G + c] = pairs[c] * fifth; \
            out[12] = (curved ? x * normal[1] - y * normal[0] : x) * cube; \
            out[13] = (curved ? x * normal[2] - z * normal[0] : y) * cube; \
            out[14] = (curved ? y * normal[2] - z * normal[1] : z) * cube; \
        } \
    }

DEFINE_PRODUCTS(products_of, Vector)
DEFINE_PRODUCTS(products_of_four, Four)

/* Integrals of the products against basis functions to 2µU (6, upper triangle) and T (9), in their place. */
INLINE void kernels_of(Vector *sums, const double *normal, double nu, double factor, int curved, int wants_g, int wants_h)
{
    const double scale = factor / (8.0 * PI * (1.0 - nu)), one_2nu = 1.0 - 2.0 * nu;
    if (wants_g) {
        const Vector part = (3.0 - 4.0 * nu) * (sums[0] + sums[3] + sums[5]);
        for (int c = 0; c < G; c++)
            sums[c] = scale * (c == 0 || c == 3 || c == 5 ? sums[c] + part : sums[c]);
    }
    if (wants_h) {
        Vector d[6], f[3];
        memcpy(d, sums + G, sizeof d);
        memcpy(f, sums + 2 * G, sizeof f);
        const Vector part = one_2nu * (d[0] + d[3] + d[5]);
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++) {
                const int k = i + j - 1; /* of 01, 02, 12 */
                const Vector twist = !curved  ? f[i] * normal[j] - f[j] * normal[i]
                                     : i == j ? (Vector){0.0}
                                     : i < j  ? f[k]
                                              : -f[k];
                const Vector value = one_2nu * twist - 3.0 * d[PLACE[i][j]];
                sums[G + 3 * i + j] = scale * (i == j ? value - part : value);
            }
    }
}

/* The normal and the area of one point of a rule, in all lanes. */
INLINE void spread(const Rule *rule, int q, Vector *normal, Vector *area)
{
    for (int c = 0; c < 3; c++)
        normal[c] = rule->normal[c][q] - (Vector){0.0};
    *area = rule->area[q] - (Vector){0.0};
}

/* A rule's points as sources for some targets of a chunk: the same sums in the same order whatever the vectors hold. */
INLINE void far(const Panel *p, const Rule *rule, double nu, Group group, Wanted wanted, int curved, double *values)
{
    const int wants_g = wanted.g, wants_h = wanted.h, node = wanted.node, last_node = wanted.last;
    const int count = group.count, *target = group.target, width = group.targets->width;
    const double(*x)[CHUNK] = group.targets->x, *plane = p->frame + 6;
    Vector normal[3] = {plane[0] - (Vector){0.0}, plane[1] - (Vector){0.0}, plane[2] - (Vector){0.0}}, area = {0.0};
    const int low = wants_g ? 0 : G, high = wants_h ? ALL : G;
    Vector k[4][ALL];
    for (int first = 0; first < count; first += LANES) {
        const int some = count - first < LANES ? count - first : LANES;
        if (some < FEW) {
            for (int i = first; i < first + some; i++) {
                const int t = target[i], wide = (p->nodes + LANES - 1) / LANES;
                Vector sums[NODES / LANES][ALL];
                for (int n = 0; n < wide; n++)
                    for (int c = low; c < high; c++)
                        sums[n][c] = (Vector){0.0};
                for (int q = 0; q < rule->count; q += LANES) {
                    Vector r[3];
                    for (int c = 0; c < 3; c++) {
                        memcpy(r + c, rule->x[c] + q, sizeof(Vector));
                        r[c] -= x[c][t];
                    }
                    for (int c = 0; curved && c < 3; c++)
                        memcpy(normal + c, rule->normal[c] + q, sizeof(Vector));
                    if (curved)
                        memcpy(&area, rule->area + q, sizeof(Vector));
                    products_of(r, normal, area, curved, wants_g, wants_h, k[0]);
                    if (rule->nodal) {
                        Vector weight = {0.0};
                        for (int l = 0; l < LANES && q + l < p->nodes; l++)
                            weight[l] = rule->weight[q + l][q + l];
                        for (int c = low; c < high; c++)
                            sums[q / LANES][c] = weight * k[0][c];
                        continue;
                    }
                    for (int n = 0; n < wide; n++) {
                        Vector weight[LANES];
                        for (int l = 0; l < LANES; l++)
                            memcpy(weight + l, rule->weight[q + l] + n * LANES, sizeof(Vector));
                        for (int c = low; c < high; c++) {
                            Vector sum = sums[n][c];
                            for (int l = 0; l < LANES; l++)
                                sum += weight[l] * k[0][c][l];
                            sums[n][c] = sum;
                        }
                    }
                }
                for (int n = 0; n < wide; n++) {
                    kernels_of(sums[n], plane, nu, rule->scale, curved, wants_g, wants_h);
                    for (int l = 0; l < LANES && n * LANES + l < p->nodes; l++)
                        for (int c = low; c < high; c++)
                            values[((n * LANES + l) * ALL + c) * width + t] = sums[n][c][l];
                }
            }
            continue;
        }
        const int together = some == LANES && target[first + LANES - 1] == target[first] + LANES - 1;
        Vector at[3] = {{0.0}}, sums[NODES][ALL];
        for (int c = 0; c < 3; c++)
            for (int l = 0; l < LANES; l++)
                at[c][l] = x[c][target[first + (l < some ? l : some - 1)]];
        for (int n = node; n < last_node; n++) {
            for (int c = low; c < high; c++)
                sums[n][c] = (Vector){0.0};
            if (rule->nodal) {
                const Vector r[3] = {rule->x[0][n] - at[0], rule->x[1][n] - at[1], rule->x[2][n] - at[2]};
                if (curved)
                    spread(rule, n, normal, &area);
                products_of(r, normal, area, curved, wants_g, wants_h, k[0]);
                for (int c = low; c < high; c++)
                    sums[n][c] = rule->weight[n][n] * k[0][c];
            }
        }
        for (int q = 0; !rule->nodal && q < rule->count; q += 4) {
            for (int j = 0; j < 4; j++) {
                const Vector r[3] = {rule->x[0][q + j] - at[0], rule->x[1][q + j] - at[1], rule->x[2][q + j] - at[2]};
                if (curved)
                    spread(rule, q + j, normal, &area);
                products_of(r, normal, area, curved, wants_g, wants_h, k[j]);
            }
            for (int c = low; c < high; c++) {
                const Vector k0 = k[0][c], k1 = k[1][c], k2 = k[2][c], k3 = k[3][c];
                for (int n = node; n < last_node; n++) {
                    Vector sum = sums[n][c] + rule->weight[q][n] * k0;
                    sum += rule->weight[q + 1][n] * k1;
                    sum += rule->weight[q + 2][n] * k2;
                    sums[n][c] = sum + rule->weight[q + 3][n] * k3;
                }
            }
        }
        for (int n = node; n < last_node; n++) {
            double *out = values + n * ALL * width;
            kernels_of(sums[n], plane, nu, rule->scale, curved, wants_g, wants_h);
            for (int c = low; c < high; c++)
                if (together)
                    memcpy(out + c * width + target[first], &sums[n][c], sizeof(Vector));
                else
                    for (int l = 0; l < some; l++)
                        out[c * width + target[first + l]] = sums[n][c][l];
        }
    }
}

#endif
