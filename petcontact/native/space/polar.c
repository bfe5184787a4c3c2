/* Rays about the foot of a target on a curved panel, and how many Gauss points lie along them.

   The map ζ = M(ξ - ξ_0), MᵀM the metric at the foot ξ_0, makes |y - y_0| = ρ + O(ρ²) in every direction. From 0 to a side at
   the distance h its coordinate is t = h sinh s, dφ = ds/cosh s and the length of the ray h cosh s, so that Gauss points in s
   do not feel how flat the angle is. Along the rays ρ itself serves on the panel; beside it |y - x|² ≈ d² + 2bρ + ρ², and with
   ρ = -b + c sinh v, c² = max(d² - b², d²/100), the integrand is smooth in v. Numbers of points follow from Bernstein's
   ellipses through the zeros of |y - y_0| and of the area factor on the true panel. Compare Guiggiani et al. (J. Appl. Mech.
   59, 1992) for the principal value, and Johnston, Johnston and Elliott (J. Comput. Appl. Math. 245, 2013) for sinh. */

#include "foot.h"
#include "polar.h"

/* Derivatives of the position over factorials at a place, by powers of both local coordinates up to 2. */
INLINE void taylor_of(const double *c, double s, double t, double (*out)[3])
{
    double up[9][3]; /* by powers of ξ about the origin, and of η about the place */
    for (int i = 0; i < 3; i++, c += 9)
        for (int k = 0; k < 3; k++) {
            up[3 * i][k] = c[k] + t * (c[3 + k] + t * c[6 + k]);
            up[3 * i + 1][k] = c[3 + k] + 2.0 * t * c[6 + k];
            up[3 * i + 2][k] = c[6 + k];
        }
    for (int j = 0; j < 3; j++)
        for (int k = 0; k < 3; k++) {
            out[j][k] = up[j][k] + s * (up[3 + j][k] + s * up[6 + j][k]);
            out[3 + j][k] = up[3 + j][k] + 2.0 * s * up[6 + j][k];
            out[6 + j][k] = up[6 + j][k];
        }
}

/* ln ρ of Bernstein's ellipse through x + iy, about the interval of so great a half and middle. */
INLINE double ellipse(double x, double y, double middle, double half)
{
    const double over = 1.0 / half, u = (x - middle) * over, v = y * over * y * over;
    const double mean = 0.5 * (sqrt((u - 1.0) * (u - 1.0) + v) + sqrt((u + 1.0) * (u + 1.0) + v));
    return logarithm(mean + sqrt(mean > 1.0 ? mean * mean - 1.0 : 0.0));
}

/* arsinh of x + iy, y >= 0. */
INLINE void complex_area_sinh(double x, double y, double *re, double *im)
{
    const double up = sqrt(x * x + (y + 1.0) * (y + 1.0)), down = sqrt(x * x + (y - 1.0) * (y - 1.0));
    const double cosh = 0.5 * (up + down), sin = 0.5 * (up - down);
    *re = copysign(logarithm(cosh + sqrt(cosh > 1.0 ? cosh * cosh - 1.0 : 0.0)), x);
    *im = angle_of(sin, sqrt(sin < 1.0 ? 1.0 - sin * sin : 0.0));
}

/* A side from the foot, by powers of τ from -1 to 1. */
INLINE void side_of(const double (*taylor)[3], const double *foot, const double *start, const double *stop, double (*out)[3])
{
    double y[3][3];
    for (int i = 0; i < 3; i++) {
        const double s = start[0] + 0.5 * i * (stop[0] - start[0]) - foot[0];
        const double t = start[1] + 0.5 * i * (stop[1] - start[1]) - foot[1];
        for (int k = 0; k < 3; k++) {
            const double low = taylor[3][k] + t * (taylor[4][k] + t * taylor[5][k]);
            const double high = taylor[6][k] + t * (taylor[7][k] + t * taylor[8][k]);
            y[i][k] = t * (taylor[1][k] + t * taylor[2][k]) + s * (low + s * high);
        }
    }
    for (int k = 0; k < 3; k++) {
        out[0][k] = y[1][k];
        out[1][k] = 0.5 * (y[2][k] - y[0][k]);
        out[2][k] = 0.5 * (y[2][k] + y[0][k]) - y[1][k];
    }
}

/* Zeros above the real axis of a quartic that is a squared length, by powers: one by Newton's steps from x + iy, and the other. */
INLINE void zeros_of(const double *q, int steps, double x, double y, double *re, double *im)
{
    for (int step = 0; step < steps; step++) {
        double u = q[4], v = 0.0, du = 0.0, dv = 0.0;
        for (int d = 3; d >= 0; d--) {
            const double slope = du * x - dv * y + u, old = u;
            dv = du * y + dv * x + v;
            du = slope;
            u = old * x - v * y + q[d];
            v = old * y + v * x;
        }
        const double over = 1.0 / (du * du + dv * dv);
        x -= (u * du + v * dv) * over;
        y -= (v * du - u * dv) * over;
    }
    const double fourth = q[4] > 1e-12 * fabs(q[2]) ? q[4] : 1e-12 * fabs(q[2]), mean = -0.5 * q[3] / fourth - x;
    const double rest = mean * mean - q[0] / (fourth * (x * x + y * y)), root = sqrt(fabs(rest));
    re[0] = x;
    im[0] = fabs(y);
    re[1] = rest > 0.0 ? mean - copysign(root, mean) : mean;
    im[1] = rest > 0.0 ? 0.0 : root;
}

/* ln ρ of an interval of the angle s about a side from t1 to t2 along it, at a height over the foot: zeros of |y - y_0|² on the flat
   side, and on the true one, whose position is a + b τ + c τ², τ from -1 to 1: two pairs. */
INLINE double around_side(double height, double t1, double t2, const double *s, const double *a, const double *b,
                          const double *c)
{
    const double middle = 0.5 * (s[0] + s[1]), half = 0.5 * (s[1] - s[0]);
    const double q[5] = {dot3(a, a), 2.0 * dot3(a, b), dot3(b, b) + 2.0 * dot3(a, c), 2.0 * dot3(b, c), dot3(c, c)};
    double re[2], im[2];
    zeros_of(q, 4, -(t1 + t2) / (t2 - t1), 2.0 * height / (t2 - t1), re, im);
    double least = ellipse(0.0, 0.5 * PI, middle, half);
    for (int k = 0; k < 2; k++) {
        double u, v;
        complex_area_sinh((0.5 * (t1 + t2) + 0.5 * (t2 - t1) * re[k]) / height, 0.5 * (t2 - t1) * im[k] / height, &u, &v);
        const double bent = ellipse(u, v, middle, half);
        least = bent < least ? bent : least;
    }
    return least;
}

/* ln ρ of an interval of v about the zeros of |y - x|² along a ray, where the target is about as far as its centre of curvature:
   powers q of ρ, q[2] less than one and q[4] > 0; ρ = c sinh v - b. */
INLINE double around_centre(const double *q, double along, double scale, double middle, double half)
{
    const double rest = q[2] * q[2] - 4.0 * q[4] * q[0], over = 0.5 / q[4]; /* first without the odd powers */
    double x = 0.0, y = 0.0, least = INFINITY, re[2], im[2];
    if (rest > 0.0)
        y = sqrt(2.0 * q[0] / (fabs(q[2]) + sqrt(rest)));
    else {
        const double size = sqrt(q[0] / q[4]);
        x = sqrt(0.5 * (size - q[2] * over));
        y = sqrt(0.5 * (size + q[2] * over));
    }
    zeros_of(q, 8, x, y, re, im);
    for (int k = 0; k < 2; k++) {
        double u, v;
        complex_area_sinh((re[k] + along) / scale, im[k] / scale, &u, &v);
        const double zero = ellipse(u, v, middle, half);
        least = zero < least ? zero : least;
    }
    return least;
}

/* |f|² over its value at 0 is 1 + 2 slope ρ + bend ρ² to its second order, f being a quadratic of ρ. */
INLINE void bends_of(Four (*f)[3], double *slope, double *bend)
{
    Four square = {0.0}, one = {0.0}, two = {0.0};
    for (int k = 0; k < 3; k++) {
        square += f[0][k] * f[0][k];
        one += f[0][k] * f[1][k];
        two += f[1][k] * f[1][k] + 2.0 * f[0][k] * f[2][k];
    }
    one /= square;
    two /= square;
    memcpy(slope, &one, sizeof one);
    memcpy(bend, &two, sizeof two);
}

/* Its zero nearest to 0; what bends less than a bound bends like it. */
INLINE void nearest_zero(double slope, double bend, double straight, double *re, double *im)
{
    const double square = fabs(bend) > straight ? bend : straight;
    const double rest = slope * slope - square, root = sqrt(fabs(rest));
    *re = (rest > 0.0 ? copysign(root, slope) - slope : -slope) / square;
    *im = rest > 0.0 ? 0.0 : root / fabs(square);
}

/* Gauss points for an integrand that is analytic in Bernstein's ellipse of ln ρ. */
INLINE int count_of(double digits, double log_rho, int more, int least)
{
    const double n = ceil(digits / (2.0 * log_rho)) + more;
    return n < least ? least : n < MOST ? (int)n : MOST;
}

/* e to the arsinh of x. */
INLINE double up_to(double x)
{
    const double whole = fabs(x) + sqrt(x * x + 1.0);
    return x < 0.0 ? 1.0 / whole : whole;
}

/* Rays about the foot of a target x (3). */
DISPATCHED void petcontact_rays(const Panel *p, const Near *near, const double *x, Rays *rays)
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
    const double straight = 1e-6 / (size * size);
    rays->own = distance <= 1e-10 * size;
    taylor_of(p->shape, foot[0], foot[1], rays->taylor);
    for (int k = 0; k < 3; k++)
        rays->taylor[0][k] = rays->own ? 0.0 : y[k];
    const double digits = near->digits * p->warp;
    const int least = 4 + (p->corners == 4 ? p->order : p->order / 2);
    const int more = (p->corners == 4 ? p->order + 1 : (p->order + 1) / 2) + !rays->own;
    double s[RAYS], height[RAYS], side[2][RAYS];
    int n = 0;
    for (int i = 0; i < p->corners; i++) {
        const double *start = corner[i], *stop = corner[(i + 1) % p->corners];
        const double u = stop[0] - start[0], v = stop[1] - start[1], length = sqrt(u * u + v * v);
        const double t[2] = {u / length, v / length}, h = t[1] * start[0] - t[0] * start[1];
        if (h < 1e-10 * size)
            continue;
        const double t1 = t[0] * start[0] + t[1] * start[1], t2 = t[0] * stop[0] + t[1] * stop[1];
        double bent[3][3];
        side_of(rays->taylor, foot, reference[i], reference[(i + 1) % p->corners], bent);
        double ends[3] = {area_sinh(t1 / h), area_sinh(t2 / h), area_sinh(t2 / h)};
        double zero = around_side(h, t1, t2, ends, bent[0], bent[1], bent[2]);
        const int parts = digits > 2.0 * (MOST - 2) * zero ? 2 : 1; /* cut above the foot */
        if (parts > 1)
            ends[1] = ends[0] * ends[2] < 0.0 ? 0.0 : 0.5 * (ends[0] + ends[2]);
        for (int part = 0; part < parts; part++) {
            const double *of = ends + part, half = 0.5 * (of[1] - of[0]);
            zero = parts > 1 ? around_side(h, t1, t2, of, bent[0], bent[1], bent[2]) : zero;
            const int around = count_of(digits, zero, 2, least);
            for (int j = 0; j < around; j++, n++) {
                s[n] = 0.5 * (of[0] + of[1]) + half * near->xi[around][j];
                rays->share[n] = half * near->weight[around][j] * over;
                height[n] = h;
                side[0][n] = t[0];
                side[1][n] = t[1];
            }
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
    double ray[2][RAYS], log_rho[RAYS];
    for (int i = 0; i < n; i++) {
        const double up = power_of_e(s[i]), down = 1.0 / up, sinh = 0.5 * (up - down), cosh = 0.5 * (up + down);
        ray[0][i] = (side[1][i] + sinh * side[0][i]) / cosh;
        ray[1][i] = (-side[0][i] + sinh * side[1][i]) / cosh;
        rays->share[i] /= cosh;
        rays->reach[i] = height[i] * cosh;
        rays->eta[i] = ray[1][i] / m11;
        rays->xi[i] = (ray[0][i] - m01 * rays->eta[i]) / m00;
    }
    const double(*c)[3] = (const double(*)[3])rays->taylor;
    double slope[2][RAYS], bend[2][RAYS], middle[RAYS], half[RAYS], powers[3][RAYS]; /* of ρ, 2 to 4, in |y - x|² */
    for (int i = 0; i < n; i += 4) {
        Four xi, eta, y[3][3], a[2][3], b[2][3], normal[3][3];
        memcpy(&xi, rays->xi + i, sizeof xi);
        memcpy(&eta, rays->eta + i, sizeof eta);
        for (int k = 0; k < 3; k++) {
            y[0][k] = xi * c[3][k] + eta * c[1][k];
            y[1][k] = xi * xi * c[6][k] + xi * eta * c[4][k] + eta * eta * c[2][k];
            y[2][k] = xi * eta * (xi * c[7][k] + eta * c[5][k]);
            a[0][k] = 2.0 * xi * c[6][k] + eta * c[4][k];
            b[0][k] = xi * c[4][k] + 2.0 * eta * c[2][k];
            a[1][k] = eta * (2.0 * xi * c[7][k] + eta * c[5][k]);
            b[1][k] = xi * (xi * c[7][k] + 2.0 * eta * c[5][k]);
        }
        for (int k = 0; k < 3; k++) {
            const int u = (k + 1) % 3, v = (k + 2) % 3;
            normal[0][k] = (c[3][u] * c[1][v] - c[3][v] * c[1][u]) - (Four){0.0};
            normal[1][k] = c[3][u] * b[0][v] - c[3][v] * b[0][u] + a[0][u] * c[1][v] - a[0][v] * c[1][u];
            normal[2][k] = c[3][u] * b[1][v] - c[3][v] * b[1][u] + a[0][u] * b[0][v] - a[0][v] * b[0][u] +
                           a[1][u] * c[1][v] - a[1][v] * c[1][u];
        }
        Four second = 1.0 - (Four){0.0}, third = {0.0}, fourth = {0.0};
        for (int k = 0; k < 3; k++) {
            second += 2.0 * c[0][k] * y[1][k];
            third += 2.0 * (y[0][k] * y[1][k] + c[0][k] * y[2][k]);
            fourth += y[1][k] * y[1][k] + 2.0 * y[0][k] * y[2][k];
        }
        memcpy(powers[0] + i, &second, sizeof second);
        memcpy(powers[1] + i, &third, sizeof third);
        memcpy(powers[2] + i, &fourth, sizeof fourth);
        bends_of(y, slope[0] + i, bend[0] + i);
        bends_of(normal, slope[1] + i, bend[1] + i);
    }
    for (int i = 0; i < n; i++) {
        middle[i] = half[i] = 0.5 * rays->reach[i];
        log_rho[i] = INFINITY;
    }
    if (!rays->own)
        for (int i = 0; i < n; i++) {
            const double along = away[0] * ray[0][i] + away[1] * ray[1][i], rest = square - along * along;
            const double scale = sqrt(rest > 0.01 * square ? rest : 0.01 * square);
            const double low = up_to(along / scale), high = up_to((rays->reach[i] + along) / scale);
            middle[i] = 0.5 * logarithm(low * high);
            half[i] = 0.5 * logarithm(high / low);
            log_rho[i] = ellipse(0.0, 0.5 * PI, middle[i], half[i]);
            if (powers[0][i] < 0.5) {
                const double fourth = powers[2][i] > straight ? powers[2][i] : straight;
                const double q[5] = {square, 2.0 * along, powers[0][i], powers[1][i], fourth};
                const double zero = around_centre(q, along, scale, middle[i], half[i]);
                log_rho[i] = zero < log_rho[i] ? zero : log_rho[i];
            }
            rays->along[i] = along;
            rays->scale[i] = scale;
            rays->up[i] = sqrt(low * high);
            rays->half[i] = half[i];
        }
    for (int k = 0; k < 2; k++) {
        double re[RAYS], im[RAYS];
        for (int i = 0; i < n; i++)
            nearest_zero(slope[k][i], bend[k][i], straight, re + i, im + i);
        if (!rays->own)
            for (int i = 0; i < n; i++) {
                double along, up;
                complex_area_sinh((re[i] + rays->along[i]) / rays->scale[i], im[i] / rays->scale[i], &along, &up);
                re[i] = along;
                im[i] = up;
            }
        for (int i = 0; i < n; i++) {
            const double other = ellipse(re[i], im[i], middle[i], half[i]);
            log_rho[i] = other < log_rho[i] ? other : log_rho[i];
        }
    }
    for (int i = 0; i < n; i += 4) {
        double least_log = log_rho[i], sum = 0.0;
        for (int l = 1; l < 4; l++)
            least_log = log_rho[i + l] < least_log ? log_rho[i + l] : least_log;
        const int count = rays->points[i / 4] = count_of(digits, least_log, more, 3);
        for (int k = 0; rays->own && k < count; k++)
            sum += near->weight[count][k] / (1.0 + near->xi[count][k]);
        for (int l = i; rays->own && l < i + 4; l++) {
            const double factor = rays->share[l] * (logarithm(rays->reach[l]) - sum);
            end[0] += factor * ray[0][l];
            end[1] += factor * ray[1][l];
        }
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
