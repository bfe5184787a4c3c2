/* Curved panels: petcontact.bem.kelvin3d.curved and polar in C, with the same formulas; see there. */

#ifndef PETCONTACT_CURVED_H
#define PETCONTACT_CURVED_H

#include "sources.h"

enum {
    MOST = 40, /* Gauss points in one direction of polar coordinates */
    CLOUD = 4 * MOST * MOST + LANES,
    STEPS = 20 /* to a foot, at most */
};

typedef struct { /* what follows the table of weights in a family of curved panels */
    double coefficients[NODES * NODES], digits, xi[MOST + 1][MOST], weight[MOST + 1][MOST];
} Near;

typedef struct { /* points of the reference element for one target */
    int count, own; /* whether the target lies on the panel */
    double xi[CLOUD], eta[CLOUD], weight[CLOUD];
    double foot[2], twist[3]; /* of the principal value: end n - n end at 01, 02 and 12, n being the unit normal */
} Cloud;

INLINE const Near *near_of(const Family *family)
{
    return (const Near *)(family->weights + RULES * RULES * POINTS * NODES);
}

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

INLINE double dot3(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* The nearest point of a panel, and the distance: QuadraticCells.nearest. */
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
        const double slope[2] = {dot3(a, y), dot3(b, y)}, m00 = dot3(a, a), m01 = dot3(a, b), m11 = dot3(b, b);
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

/* Gauss points on an interval whose integrand is analytic in the strip of half width π about it. */
INLINE int count_of(double digits, double span, int least)
{
    const int n = (int)ceil(digits / (2.0 * area_sinh(PI / span)));
    return n < least ? least : n > MOST ? MOST : n;
}

/* Points about the foot of a target: polar.polar_rule. */
INLINE void polar(const Panel *p, const Near *near, const double *x, Cloud *cloud)
{
    static const double CORNERS[2][4][2] = {{{0.0, 0.0}, {1.0, 0.0}, {0.0, 1.0}, {0.0, 0.0}},
                                            {{-1.0, -1.0}, {1.0, -1.0}, {1.0, 1.0}, {-1.0, 1.0}}};
    const double(*reference)[2] = CORNERS[p->corners == 4], *foot = cloud->foot;
    double distance = INFINITY, y[3], a[3], b[3], e1[3], e2[3], corner[4][2], size = 0.0, end[2] = {0.0, 0.0};
    for (int n = 0; n < p->nodes; n++) { /* nodes are known exactly */
        const double *at = p->nodes_at + 5 * n;
        const double r[3] = {at[0] - x[0], at[1] - x[1], at[2] - x[2]};
        if (dot3(r, r) < 1e-20 * p->size * p->size) {
            cloud->foot[0] = at[3];
            cloud->foot[1] = at[4];
            distance = 0.0;
        }
    }
    if (distance > 0.0)
        distance = foot_of(p, x, cloud->foot);
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
    const double away[2] = {dot3(y, e1), dot3(y, e2)};
    for (int i = 0; i < p->corners; i++) {
        const double u = reference[i][0] - foot[0], v = reference[i][1] - foot[1];
        corner[i][0] = m00 * u + m01 * v;
        corner[i][1] = m11 * v;
        const double length = sqrt(corner[i][0] * corner[i][0] + corner[i][1] * corner[i][1]);
        size = length > size ? length : size;
    }
    cloud->own = distance <= 1e-10 * size;
    const double digits = near->digits * p->warp;
    const int least = 4 + (p->corners == 4 ? p->order : p->order / 2);
    int n = 0;
    for (int i = 0; i < p->corners; i++) {
        const double *start = corner[i], *stop = corner[(i + 1) % p->corners];
        const double u = stop[0] - start[0], v = stop[1] - start[1], length = sqrt(u * u + v * v);
        const double side[2] = {u / length, v / length}, h = side[1] * start[0] - side[0] * start[1];
        if (h < 1e-10 * size)
            continue;
        const double s1 = area_sinh((side[0] * start[0] + side[1] * start[1]) / h);
        const double s2 = area_sinh((side[0] * stop[0] + side[1] * stop[1]) / h);
        const int around = count_of(digits, s2 - s1, least);
        for (int j = 0; j < around; j++) {
            const double up = power_of_e(0.5 * (s1 + s2) + 0.5 * (s2 - s1) * near->xi[around][j]), down = 1.0 / up;
            const double sinh = 0.5 * (up - down), cosh = 0.5 * (up + down), reach = h * cosh;
            const double share = 0.5 * (s2 - s1) * near->weight[around][j] / cosh;
            const double ray[2] = {(side[1] + sinh * side[0]) / cosh, (-side[0] + sinh * side[1]) / cosh};
            const double eta = ray[1] / m11, xi = (ray[0] - m01 * eta) / m00;
            double rho[MOST], weight[MOST];
            int count;
            if (cloud->own) {
                double sum = 0.0;
                count = (int)(0.25 * digits) + least - 2;
                count = count < MOST ? count : MOST;
                for (int k = 0; k < count; k++) {
                    rho[k] = 0.5 * reach * (1.0 + near->xi[count][k]);
                    weight[k] = 0.5 * reach * near->weight[count][k];
                    sum += weight[k] / rho[k];
                }
                for (int k = 0; k < 2; k++)
                    end[k] += share * (logarithm(reach) - sum) * ray[k];
            } else {
                const double along = away[0] * ray[0] + away[1] * ray[1], square = distance * distance;
                const double rest = square - along * along, c = sqrt(rest > 0.01 * square ? rest : 0.01 * square);
                const double v1 = area_sinh(along / c), v2 = area_sinh((reach + along) / c);
                count = count_of(digits + 2.0, v2 - v1, least);
                for (int k = 0; k < count; k++) {
                    const double e = power_of_e(0.5 * (v1 + v2) + 0.5 * (v2 - v1) * near->xi[count][k]), f = 1.0 / e;
                    rho[k] = 0.5 * c * (e - f) - along;
                    weight[k] = 0.25 * (v2 - v1) * near->weight[count][k] * c * (e + f);
                }
            }
            for (int k = 0; k < count; k++, n++) {
                cloud->xi[n] = foot[0] + rho[k] * xi;
                cloud->eta[n] = foot[1] + rho[k] * eta;
                cloud->weight[n] = share * weight[k] * rho[k] * over;
            }
        }
    }
    for (; n % LANES; n++) {
        cloud->xi[n] = cloud->xi[n - 1];
        cloud->eta[n] = cloud->eta[n - 1];
        cloud->weight[n] = 0.0;
    }
    cloud->count = n;
    double normal[3], whole[3];
    for (int k = 0; k < 3; k++) {
        normal[k] = e1[(k + 1) % 3] * e2[(k + 2) % 3] - e1[(k + 2) % 3] * e2[(k + 1) % 3];
        whole[k] = end[0] * e1[k] + end[1] * e2[k];
    }
    cloud->twist[0] = whole[0] * normal[1] - whole[1] * normal[0];
    cloud->twist[1] = whole[0] * normal[2] - whole[2] * normal[0];
    cloud->twist[2] = whole[1] * normal[2] - whole[2] * normal[1];
}

/* Products times monomials, summed over a cloud in lanes; those from `low` to before `high`. */
INLINE void add_cloud(const Panel *p, const Cloud *cloud, const double *x, const int low, const int high,
                      Vector (*lanes)[ALL])
{
    for (int m = 0; m < p->nodes; m++)
        for (int c = low; c < high; c++)
            lanes[m][c] = (Vector){0.0};
    for (int q = 0; q < cloud->count; q += LANES) {
        Vector s, t, weight, r[3], normal[3], area, k[ALL], power = 1.0 - (Vector){0.0};
        memcpy(&s, cloud->xi + q, sizeof s);
        memcpy(&t, cloud->eta + q, sizeof s);
        memcpy(&weight, cloud->weight + q, sizeof s);
        places_of(p->shape, x, s, t, r, normal, &area);
        for (int c = 0; c < 3; c++)
            normal[c] *= weight;
        products_of(r, normal, area * weight, 1, low < G, high > G, k);
        for (int a = 0, m = 0; a <= p->order; a++) {
            Vector value = power;
            for (int b = 0; b <= (p->corners == 4 ? p->order : p->order - a); b++, m++) {
                for (int c = low; c < high; c++)
                    lanes[m][c] += value * k[c];
                value *= t;
            }
            power *= s;
        }
    }
}

/* Both kernels over a panel at a target t that is near. */
INLINE void near_curved(const Panel *p, const Family *family, const Targets *targets, int t, Wanted wanted, double *values)
{
    const Near *near = near_of(family);
    const double x[3] = {targets->x[0][t], targets->x[1][t], targets->x[2][t]};
    const int low = wanted.g ? 0 : G, high = wanted.h ? ALL : G, width = targets->width, nodes = p->nodes;
    Cloud cloud;
    Vector lanes[NODES][ALL];
    polar(p, near, x, &cloud);
    if (wanted.g && wanted.h)
        add_cloud(p, &cloud, x, 0, ALL, lanes);
    else if (wanted.g)
        add_cloud(p, &cloud, x, 0, G, lanes);
    else
        add_cloud(p, &cloud, x, G, ALL, lanes);
    double sums[NODES][ALL], at[NODES];
    monomials(p, cloud.foot[0], cloud.foot[1], at);
    for (int m = 0; m < nodes; m++) {
        for (int c = low; c < high; c++) {
            const Vector v = lanes[m][c];
            sums[m][c] = ((v[0] + v[4]) + (v[2] + v[6])) + ((v[1] + v[5]) + (v[3] + v[7]));
        }
        for (int c = 0; cloud.own && wanted.h && c < 3; c++)
            sums[m][G + 6 + c] += at[m] * cloud.twist[c];
    }
    for (int first = 0; first < nodes; first += LANES) {
        Vector nodal[ALL];
        for (int c = low; c < high; c++) {
            nodal[c] = (Vector){0.0};
            for (int l = 0; l < LANES && first + l < nodes; l++)
                for (int m = 0; m < nodes; m++)
                    nodal[c][l] += near->coefficients[(first + l) * nodes + m] * sums[m][c];
        }
        kernels_of(nodal, p->frame + 6, family->nu, 1.0, 1, wanted.g, wanted.h);
        for (int l = 0; l < LANES && first + l < nodes; l++)
            for (int c = low; c < high; c++)
                values[((first + l) * ALL + c) * width + t] = nodal[c][l];
    }
}

#endif
