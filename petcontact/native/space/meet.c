/* Where lines meet curved panels, and the points of these that are nearest to others: petcontact.mesh.pairs.panel_faces and
   petcontact.geometry.quadratic in C. */

#include "foot.h"

/* The vector product of a and b. */
INLINE void cross3(const double *a, const double *b, double *result)
{
    for (int k = 0; k < 3; k++) {
        const int l = (k + 1) % 3, m = (k + 2) % 3;
        result[k] = a[l] * b[m] - a[m] * b[l];
    }
}

/* Local coordinates (n, 2), and distances (n,), where lines through points x (n, 3) meet the panels `number` (n,) with
   coefficients `shape` (., 9, 3), corners `polygon` (., 4, 2) and sizes (.,), by Newton's method from their middles that leaves
   panels by at most `beyond`; NaN and infinity where they do not meet, or from behind. */
void petcontact_space_meet(int64_t n, const int64_t *number, const double *shape, const double *polygon, const double *size,
                           const double *x, const double *direction, int64_t steps, double close, double slack, double beyond,
                           double *place, double *distance)
{
    for (int64_t i = 0; i < n; i++, x += 3, direction += 3, place += 2, distance++) {
        const double *c = shape + 27 * number[i], *p = polygon + 8 * number[i];
        const int corners = p[4] == p[6] && p[5] == p[7] ? 3 : 4;
        double low[2], high[2], at[2], far = 0.0, y[3], a[3], b[3], normal[3], away[3], turned[3];
        for (int k = 0; k < 2; k++) {
            at[k] = 0.0;
            low[k] = high[k] = p[k];
            for (int j = 0; j < corners; j++) {
                const double v = p[2 * j + k];
                at[k] += v / corners;
                low[k] = v < low[k] ? v : low[k];
                high[k] = v > high[k] ? v : high[k];
            }
        }
        for (int64_t step = 0;; step++) {
            place_of(c, at[0], at[1], y, a, b);
            for (int k = 0; k < 3; k++)
                away[k] = y[k] - x[k] - far * direction[k];
            cross3(a, b, normal);
            if (step == steps)
                break;
            const double facing = dot3(normal, direction);
            double change[3] = {-away[0], -away[1], -away[2]};
            const int flat = !(fabs(facing) > slack * sqrt(dot3(normal, normal))); /* the line is along the panel */
            if (!flat) {
                cross3(b, direction, turned);
                change[0] = -dot3(away, turned) / facing;
                cross3(direction, a, turned);
                change[1] = -dot3(away, turned) / facing;
                change[2] = dot3(normal, away) / facing;
            }
            for (int k = 0; k < 2; k++) {
                const double next = at[k] + change[k], bounded = next > low[k] - beyond ? next : low[k] - beyond;
                at[k] = bounded < high[k] + beyond ? bounded : high[k] + beyond;
            }
            far += change[2];
            if (!flat && fabs(change[0]) < close && fabs(change[1]) < close)
                step = steps - 1;
        }
        const int missed = !(sqrt(dot3(away, away)) <= slack * size[number[i]]) || dot3(normal, direction) >= 0.0;
        place[0] = missed ? NAN : at[0];
        place[1] = missed ? NAN : at[1];
        *distance = missed ? INFINITY : far;
    }
}

/* Points y (n, 3) at local coordinates (n, 2) of the panels `number` (n,) with coefficients `shape` (., 9, 3), and the derivatives
   (n, 2, 3) along both. */
void petcontact_space_places(int64_t n, const int64_t *number, const double *shape, const double *local, double *y, double *along)
{
    for (int64_t i = 0; i < n; i++)
        place_of(shape + 27 * number[i], local[2 * i], local[2 * i + 1], y + 3 * i, along + 6 * i, along + 6 * i + 3);
}

/* Local coordinates (n, 2) of the nearest points of panels of so many corners with coefficients `shape` (n, 9, 3) to points x
   (n, 3), and the distances (n,). */
void petcontact_space_feet(int64_t n, int64_t corners, const double *shape, const double *x, double *place, double *distance)
{
    for (int64_t i = 0; i < n; i++) {
        const Panel p = {.corners = (int)corners, .shape = shape + 27 * i};
        distance[i] = foot_of(&p, x + 3 * i, place + 2 * i);
    }
}
