/* Rays about the foot of a target on a curved panel and Gauss points along them, see polar.c.
   Four rays make a vector, and take the same number of points. */

#ifndef PETCONTACT_POLAR_H
#define PETCONTACT_POLAR_H

#include "panel.h"

enum {
    MOST = 40, /* Gauss points in one direction of polar coordinates */
    RAYS = 8 * MOST
};

typedef struct { /* what follows the table of weights in a family of curved panels */
    double coefficients[NODES][NODES], digits, xi[MOST + 1][MOST], weight[MOST + 1][MOST];
} Near; /* coefficients: of all basis functions by a monomial */

typedef struct { /* rays about the foot of one target, in whole vectors */
    int count, own, points[RAYS / 4]; /* whether the target lies on the panel; points along the rays of a vector */
    double foot[2], taylor[9][3];         /* position from the target by powers of both local coordinates about the foot */
    double twist[3];                      /* of the principal value: end n - n end at 01, 02 and 12, n being the unit normal */
    double xi[RAYS], eta[RAYS], share[RAYS]; /* local coordinates by ρ, and the weight */
    double reach[RAYS]; /* length of the ray, of use where the target lies on the panel; else ρ = c sinh v - b: */
    double along[RAYS], scale[RAYS], up[RAYS], half[RAYS]; /* b, c, and v = ln up ± half */
} Rays;

INLINE const Near *near_of(const Family *family)
{
    return (const Near *)(family->weights + RULES * RULES * POINTS * NODES);
}

/* Rays about the foot of a target x (3). */
void petcontact_rays(const Panel *p, const Near *near, const double *x, Rays *rays);

/* Points ρ along the rays of the vector that begins at `first`, and weights of dξ dη; how many. */
INLINE int points_along(const Rays *rays, const Near *near, int first, Four *rho, Four *weight)
{
    const int count = rays->points[first / 4];
    const double *xi = near->xi[count], *w = near->weight[count];
    Four share, reach, along, scale, up, half;
    memcpy(&share, rays->share + first, sizeof share);
    if (rays->own) {
        memcpy(&reach, rays->reach + first, sizeof reach);
        share *= 0.5 * reach;
        for (int k = 0; k < count; k++) {
            rho[k] = (0.5 * (1.0 + xi[k])) * reach;
            weight[k] = (w[k] * share) * rho[k];
        }
        return count;
    }
    memcpy(&along, rays->along + first, sizeof along);
    memcpy(&scale, rays->scale + first, sizeof scale);
    memcpy(&up, rays->up + first, sizeof up);
    memcpy(&half, rays->half + first, sizeof half);
    scale *= 0.5;
    share *= half * scale;
    const Four down = 1.0 / up;
    for (int k = 0, o = count - 1; k <= o; k++, o--) { /* both ±ξ by one power of e */
        Four more = {0.0};
        for (int l = 0; l < 4; l++)
            more[l] = power_of_e(half[l] * xi[o]);
        const Four less = 1.0 / more, p = up * more, q = down * less, r = up * less, s = down * more;
        rho[o] = scale * (p - q) - along;
        weight[o] = (w[o] * share) * (p + q) * rho[o];
        rho[k] = scale * (r - s) - along;
        weight[k] = (w[k] * share) * (r + s) * rho[k];
    }
    return count;
}

#endif
