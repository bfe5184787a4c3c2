/* Rays about the foot of a target on a curved panel and Gauss points along them: petcontact.bem.kelvin3d.polar in C, with
   the same formulas; see there. Four rays make a vector, and take the same number of points. */

#ifndef PETCONTACT_POLAR_H
#define PETCONTACT_POLAR_H

#include "foot.h"

enum {
    MOST = 40, /* Gauss points in one direction of polar coordinates */
    RAYS = 4 * MOST
};

typedef struct { /* what follows the table of weights in a family of curved panels */
    double coefficients[NODES][NODES], digits, xi[MOST + 1][MOST], weight[MOST + 1][MOST];
} Near; /* coefficients: of all basis functions by a monomial */

typedef struct { /* rays about the foot of one target, in whole vectors */
    int count, own, points[RAYS / 4]; /* whether the target lies on the panel; points along the rays of a vector */
    double foot[2], twist[3];             /* of the principal value: end n - n end at 01, 02 and 12, n being the unit normal */
    double xi[RAYS], eta[RAYS], share[RAYS]; /* local coordinates by ρ, and the weight */
    double reach[RAYS]; /* length of the ray, of use where the target lies on the panel; else ρ = c sinh v - b: */
    double along[RAYS], scale[RAYS], up[RAYS], half[RAYS]; /* b, c, and v = ln up ± half */
} Rays;

INLINE const Near *near_of(const Family *family)
{
    return (const Near *)(family->weights + RULES * RULES * POINTS * NODES);
}

/* Gauss points on an interval whose integrand is analytic in a strip of width π about it. */
INLINE int count_of(double digits, double span, int least)
{
    const int n = (int)ceil(digits / (2.0 * area_sinh(PI / span)));
    return n < least ? least : n > MOST ? MOST : n;
}

/* e to the arsinh of x. */
INLINE double up_to(double x)
{
    const double whole = fabs(x) + sqrt(x * x + 1.0);
    return x < 0.0 ? 1.0 / whole : whole;
}

INLINE void rays_about(const Panel *p, const Near *near, const double *x, Rays *rays)
{
    static const double CORNERS[2][4][2] = {{{0.0, 0.0}, {1.0, 0.0}, {0.0, 1.0}, {0.0, 0.0}},
                                            {{-1.0, -1.0}, {1.0, -1.0}, {1.0, 1.0}, {-1.0, 1.0}}};
    const double(*reference)[2] = CORNERS[p->corners == 4], *foot = rays->foot;
    double distance = INFINITY, y[3], a[3], b[3], e1[3], e2[3], corner[4][2], size = 0.0, end[2] = {0.0, 0.0};
    for (int n = 0; n < p->nodes; n++) { /* nodes are known exactly */
        const double *at = p->nodes_at + 5 * n;
        const double r[3] = {at[0] - x[0], at[1] - x[1], at[2] - x[2]};
        if (dot3(r, r) < 1e-20 * p->size * p->size) {
            rays->foot[0] = at[3];
            rays->foot[1] = at[4];
            distance = 0.0;
        }
    }
    if (distance > 0.0)
        distance = foot_of(p, x, rays->foot);
    place_of(p->shape, foot[0], foot[1], y, a, b);
    const double m00 = sqrt(dot3(a, a));
    for (int k = 0; k < 3; k++)
        e1[k] = a[k] / m00;
    const double m01 = dot3(b, e1);
    for (int k = 0; k < 3; k++) {
        e2[k] = b[k] - m01 * e1[k];
        y[k] -= x[k];
    }
    const double m11 = sqrt(dot3(e2, e2)), over = 1.0 / (m00 * m11);
    for (int k = 0; k < 3; k++)
        e2[k] /= m11;
    const double away[2] = {dot3(y, e1), dot3(y, e2)}, square = distance * distance;
    for (int i = 0; i < p->corners; i++) {
        const double u = reference[i][0] - foot[0], v = reference[i][1] - foot[1];
        corner[i][0] = m00 * u + m01 * v;
        corner[i][1] = m11 * v;
        const double length = sqrt(corner[i][0] * corner[i][0] + corner[i][1] * corner[i][1]);
        size = length > size ? length : size;
    }
    rays->own = distance <= 1e-10 * size;
    const double digits = near->digits * p->warp;
    const int least = 4 + (p->corners == 4 ? p->order : p->order / 2);
    double s[RAYS], height[RAYS], side[2][RAYS];
    int n = 0;
    for (int i = 0; i < p->corners; i++) {
        const double *start = corner[i], *stop = corner[(i + 1) % p->corners];
        const double u = stop[0] - start[0], v = stop[1] - start[1], length = sqrt(u * u + v * v);
        const double t[2] = {u / length, v / length}, h = t[1] * start[0] - t[0] * start[1];
        if (h < 1e-10 * size)
            continue;
        const double s1 = area_sinh((t[0] * start[0] + t[1] * start[1]) / h);
        const double s2 = area_sinh((t[0] * stop[0] + t[1] * stop[1]) / h);
        const int around = count_of(digits, s2 - s1, least);
        for (int j = 0; j < around; j++, n++) {
            s[n] = 0.5 * (s1 + s2) + 0.5 * (s2 - s1) * near->xi[around][j];
            rays->share[n] = 0.5 * (s2 - s1) * near->weight[around][j] * over;
            height[n] = h;
            side[0][n] = t[0];
            side[1][n] = t[1];
        }
    }
    for (; n % 4; n++) {
        s[n] = s[n - 1];
        rays->share[n] = 0.0;
        height[n] = height[n - 1];
        side[0][n] = side[0][n - 1];
        side[1][n] = side[1][n - 1];
    }
    rays->count = n;
    int count = (int)(0.25 * digits) + least - 2;
    count = count < MOST ? count : MOST;
    double ray[2][RAYS], sum = 0.0;
    for (int k = 0; k < count; k++)
        sum += near->weight[count][k] / (1.0 + near->xi[count][k]);
    for (int i = 0; i < n; i++) {
        const double up = power_of_e(s[i]), down = 1.0 / up, sinh = 0.5 * (up - down), cosh = 0.5 * (up + down);
        ray[0][i] = (side[1][i] + sinh * side[0][i]) / cosh;
        ray[1][i] = (-side[0][i] + sinh * side[1][i]) / cosh;
        rays->share[i] /= cosh;
        rays->reach[i] = height[i] * cosh;
        rays->eta[i] = ray[1][i] / m11;
        rays->xi[i] = (ray[0][i] - m01 * rays->eta[i]) / m00;
    }
    if (rays->own)
        for (int i = 0; i < n; i++) {
            const double factor = rays->share[i] * (logarithm(rays->reach[i]) - sum);
            end[0] += factor * ray[0][i];
            end[1] += factor * ray[1][i];
        }
    else
        for (int i = 0; i < n; i++) {
            const double along = away[0] * ray[0][i] + away[1] * ray[1][i], rest = square - along * along;
            const double c = sqrt(rest > 0.01 * square ? rest : 0.01 * square);
            const double low = up_to(along / c), high = up_to((rays->reach[i] + along) / c);
            rays->along[i] = along;
            rays->scale[i] = c;
            rays->up[i] = sqrt(low * high);
            rays->half[i] = 0.5 * logarithm(high / low);
        }
    for (int i = 0; i < n; i += 4) {
        double widest = 0.0;
        for (int l = 0; l < 4 && !rays->own; l++)
            widest = rays->half[i + l] > widest ? rays->half[i + l] : widest;
        rays->points[i / 4] = rays->own ? count : count_of(digits + 2.0, 2.0 * widest, least);
    }
    double normal[3], whole[3];
    for (int k = 0; k < 3; k++) {
        normal[k] = e1[(k + 1) % 3] * e2[(k + 2) % 3] - e1[(k + 2) % 3] * e2[(k + 1) % 3];
        whole[k] = (end[0] * e1[k] + end[1] * e2[k]) / over;
    }
    rays->twist[0] = whole[0] * normal[1] - whole[1] * normal[0];
    rays->twist[1] = whole[0] * normal[2] - whole[2] * normal[0];
    rays->twist[2] = whole[1] * normal[2] - whole[2] * normal[1];
}

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
