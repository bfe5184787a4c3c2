/* Both kernels over a curved panel that is near, by the points of polar.c. */

#include "polar.h"
#include "sources.h"

/* Products at a vector's points, times weights; along rays r and the normal times area are polynomials. */
INLINE void products_along(const double (*c)[3], Four xi, Four eta, const Four *rho, const Four *weight, int count,
                           const int wants_g, const int wants_h, const int corners, Four (*out)[ALL])
{
    const int slopes = corners == 3 ? 1 : 3, bends = corners == 3 ? 2 : 5; /* degrees of tangents and normal */
    Four place[5][3], a[4][3], b[4][3], turn[6][3];
    const Four xx = xi * xi, xy = xi * eta, yy = eta * eta;
    for (int k = 0; k < 3; k++) {
        place[0][k] = c[0][k] - (Four){0.0};
        place[1][k] = xi * c[3][k] + eta * c[1][k];
        place[2][k] = xx * c[6][k] + xy * c[4][k] + yy * c[2][k];
        a[0][k] = c[3][k] - (Four){0.0};
        b[0][k] = c[1][k] - (Four){0.0};
        a[1][k] = xi * (2.0 * c[6][k]) + eta * c[4][k];
        b[1][k] = xi * c[4][k] + eta * (2.0 * c[2][k]);
        if (corners == 4) {
            const Four mixed = xy * (2.0 * c[8][k]);
            place[3][k] = xy * (xi * c[7][k] + eta * c[5][k]);
            place[4][k] = xx * yy * c[8][k];
            a[2][k] = xy * (2.0 * c[7][k]) + yy * c[5][k];
            b[2][k] = xx * c[7][k] + xy * (2.0 * c[5][k]);
            a[3][k] = mixed * eta;
            b[3][k] = mixed * xi;
        }
    }
    for (int d = 0; d <= bends; d++)
        for (int k = 0; k < 3; k++) {
            turn[d][k] = (Four){0.0};
            for (int i = d > slopes ? d - slopes : 0; i <= d && i <= slopes; i++)
                turn[d][k] += a[i][(k + 1) % 3] * b[d - i][(k + 2) % 3] - a[i][(k + 2) % 3] * b[d - i][(k + 1) % 3];
        }
    for (int q = 0; q < count; q++) {
        Four r[3], normal[3], area = {0.0};
        for (int k = 0; k < 3; k++) {
            r[k] = place[slopes + 1][k];
            for (int d = slopes; d >= 0; d--)
                r[k] = r[k] * rho[q] + place[d][k];
            normal[k] = turn[bends][k];
            for (int d = bends - 1; d >= 0; d--)
                normal[k] = normal[k] * rho[q] + turn[d][k];
            normal[k] *= weight[q];
        }
        const Four square = normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2];
        for (int l = 0; l < 4 && wants_g; l++)
            area[l] = sqrt(square[l]);
        products_of_four(r, normal, area, 1, wants_g, wants_h, out[q]);
    }
}

/* Their sums times powers of ρ up to the highest. */
INLINE void sums_along(Four (*products)[ALL], const Four *rho, int count, int low, int high, const int highest,
                       Four (*out)[ALL])
{
    for (int c = low; c < high; c += 3) { /* three at once hide how long a sum takes */
        Four sum[7][3];
        for (int d = 0; d <= highest; d++)
            for (int k = 0; k < 3; k++)
                sum[d][k] = (Four){0.0};
        for (int q = 0; q < count; q++) {
            for (int k = 0; k < 3; k++) {
                Four value = products[q][c + k];
                for (int d = 0; d < highest; d++) {
                    sum[d][k] += value;
                    value *= rho[q];
                }
                sum[highest][k] += value;
            }
        }
        for (int d = 0; d <= highest; d++)
            for (int k = 0; k < 3; k++)
                out[d][c + k] = sum[d][k];
    }
}

/* Integrals of the products times monomials about the foot, in lanes; those from `low` to before `high`. */
INLINE void add_rays(const Panel *p, const Near *near, const Rays *rays, int low, int high, Four (*lanes)[ALL])
{
    const double(*taylor)[3] = (const double(*)[3])rays->taylor;
    Four rho[MOST], weight[MOST], products[MOST][ALL], sums[7][ALL];
    for (int m = 0; m < p->nodes; m++)
        for (int c = low; c < high; c++)
            lanes[m][c] = (Four){0.0};
    for (int first = 0; first < rays->count; first += 4) {
        const int count = points_along(rays, near, first, rho, weight);
        Four xi, eta, power = 1.0 - (Four){0.0};
        memcpy(&xi, rays->xi + first, sizeof xi);
        memcpy(&eta, rays->eta + first, sizeof eta);
        switch (8 * (p->corners == 4) + 4 * (low < G) + 2 * (high > G)) { /* a copy for each saves a third of the time */
        case 4: products_along(taylor, xi, eta, rho, weight, count, 1, 0, 3, products); break;
        case 2: products_along(taylor, xi, eta, rho, weight, count, 0, 1, 3, products); break;
        case 6: products_along(taylor, xi, eta, rho, weight, count, 1, 1, 3, products); break;
        case 12: products_along(taylor, xi, eta, rho, weight, count, 1, 0, 4, products); break;
        case 10: products_along(taylor, xi, eta, rho, weight, count, 0, 1, 4, products); break;
        default: products_along(taylor, xi, eta, rho, weight, count, 1, 1, 4, products);
        }
        switch (p->degree) {
        case 0: sums_along(products, rho, count, low, high, 0, sums); break;
        case 1: sums_along(products, rho, count, low, high, 1, sums); break;
        case 2: sums_along(products, rho, count, low, high, 2, sums); break;
        case 3: sums_along(products, rho, count, low, high, 3, sums); break;
        case 4: sums_along(products, rho, count, low, high, 4, sums); break;
        default: sums_along(products, rho, count, low, high, 6, sums);
        }
        for (int a = 0, m = 0; a <= p->order; a++) {
            Four value = power;
            for (int b = 0; b <= (p->corners == 4 ? p->order : p->order - a); b++, m++) {
                for (int c = low; c < high; c++)
                    lanes[m][c] += value * sums[a + b][c];
                value *= eta;
            }
            power *= xi;
        }
    }
}

/* Integrals times monomials about a place to those about the origin. */
INLINE void recentre(const Panel *p, const double *place, double (*sums)[ALL])
{
    const int order = p->order, is_triangle = p->corners == 3;
    int at[NODES / 4 + 1] = {0}; /* of the powers of the first coordinate */
    for (int a = 0; a < order; a++)
        at[a + 1] = at[a] + (is_triangle ? order - a : order) + 1;
    for (int round = 1; round <= order; round++)
        for (int high = order; high >= round; high--)
            for (int other = 0; other <= (is_triangle ? order - high : order); other++)
                for (int c = 0; c < ALL; c++)
                    sums[at[high] + other][c] += place[0] * sums[at[high - 1] + other][c];
    for (int round = 1; round <= order; round++)
        for (int other = 0; other <= order - (is_triangle ? round : 0); other++)
            for (int high = is_triangle ? order - other : order; high >= round; high--)
                for (int c = 0; c < ALL; c++)
                    sums[at[other] + high][c] += place[1] * sums[at[other] + high - 1][c];
}

/* Both kernels over a panel at a target t that is near. */
DISPATCHED void petcontact_near_curved(const Panel *p, const Family *family, const Targets *targets, int t, Wanted wanted,
                                       double *values)
{
    const Near *near = near_of(family);
    const double x[3] = {targets->x[0][t], targets->x[1][t], targets->x[2][t]};
    const int low = wanted.g ? 0 : G, high = wanted.h ? ALL : G, width = targets->width, nodes = p->nodes;
    double sums[NODES][ALL] = {{0.0}};
    Rays rays;
    Four lanes[NODES][ALL];
    petcontact_rays(p, near, x, &rays);
    add_rays(p, near, &rays, low, high, lanes);
    for (int m = 0; m < nodes; m++)
        for (int c = low; c < high; c++) {
            const Four v = lanes[m][c];
            sums[m][c] = (v[0] + v[2]) + (v[1] + v[3]);
        }
    for (int c = 0; rays.own && wanted.h && c < 3; c++)
        sums[0][G + 6 + c] += rays.twist[c];
    recentre(p, rays.foot, sums);
    for (int first = 0; first < nodes; first += LANES) {
        Vector nodal[ALL];
        for (int c = low; c < high; c++) {
            nodal[c] = (Vector){0.0};
            for (int m = 0; m < nodes; m++) {
                Vector some;
                memcpy(&some, near->coefficients[m] + first, sizeof some);
                nodal[c] += some * sums[m][c];
            }
        }
        kernels_of(nodal, p->frame + 6, family->nu, 1.0, 1, wanted.g, wanted.h);
        for (int l = 0; l < LANES && first + l < nodes; l++)
            for (int c = low; c < high; c++)
                values[((first + l) * ALL + c) * width + t] = nodal[c][l];
    }
}
