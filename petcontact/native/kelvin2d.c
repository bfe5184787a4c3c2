/* Both kernels of plane strain over straight elements of order 0: petcontact.bem.kelvin2d.constant_elements in C, with the
   same formulas; see there. */

#include "elementary.h"

enum { CHUNK = 128 };                      /* targets at a time: what lies between two loops stays in the first cache */

typedef struct {
    double x1, y1, x2, y2;                 /* end points */
    double tx, ty, half;                   /* unit tangent and half the length */
} Element;

typedef struct {
    double scale, factor, nu, log_length;  /* 1/(4π(1-ν)), 3-4ν */
} Constants;

typedef struct {                           /* of one element at each target of a chunk */
    double g00[CHUNK], g01[CHUNK], g11[CHUNK], h00[CHUNK], h01[CHUNK], h10[CHUNK], h11[CHUNK];
} Values;

INLINE Element element_between(const double *start, const double *end)
{
    double dx = end[0] - start[0], dy = end[1] - start[1], half = 0.5 * sqrt(dx * dx + dy * dy);
    Element e = {start[0], start[1], end[0], end[1], 0.5 * dx / half, 0.5 * dy / half, half};
    return e;
}

INLINE Constants constants_of(double nu, double length)
{
    Constants c = {1.0 / (4.0 * PI * (1.0 - nu)), 3.0 - 4.0 * nu, nu, logarithm(length)};
    return c;
}

/* What both kernels need of a pair: ξ, 2h/a, W and θ. `on` is 0 where element and target lie on one line, else 1. */
typedef struct {
    double offset, double_h, ratio, angle, along, across;
} Pair;

INLINE Pair pair_of(const Element *e, double x1, double y1, double x2, double y2, double square_1, double square_2,
                    double log_1, double log_2, double on)
{
    Pair p;
    double half = e->half, tx = e->tx, ty = e->ty, half_square = half * half, over = 1.0 / half;
    p.offset = ((x1 + x2) * tx + (y1 + y2) * ty) * (0.5 * over);
    double from_1 = y1 * tx - x1 * ty, from_2 = y2 * tx - x2 * ty;
    double nearest = square_1 < square_2 ? square_1 : square_2;
    /* Close to an end point the distance from the line has to come from the differences to that end. */
    int by_second = (square_2 < square_1) & (square_2 < 0.01 * half_square);
    p.double_h = (by_second ? from_2 : from_1) * (2.0 * over) * on;
    double more = 4.0 * half_square * fabs(p.offset);
    double distant = twice_atanh(more / (2.0 * nearest + more)), close = fabs(log_1 - log_2);
    p.ratio = copysign(more < 0.41 * nearest ? distant : close, p.offset);
    p.along = x1 * x2;
    p.across = y1 * y2;
    p.angle = angle_of(p.double_h * half_square, p.along + p.across) * on;
    return p;
}

INLINE void write_h(const Element *e, const Constants *c, const Pair *p, double x1, double y1, double x2, double y2,
                    double square_1, double square_2, int k, Values *out)
{
    double dipole = p->double_h * (-c->scale * e->half * e->half) / (square_1 * square_2);
    double deviator = (p->along - p->across) * dipole;
    double isotropic = p->angle * (-c->scale * (2.0 - 2.0 * c->nu));
    double off = (x1 * y2 + x2 * y1) * dipole, rotation = p->ratio * (0.5 * c->scale * (1.0 - 2.0 * c->nu));
    out->h00[k] = isotropic + deviator;
    out->h11[k] = isotropic - deviator;
    out->h01[k] = off + rotation;
    out->h10[k] = off - rotation;
}

INLINE void write_g(const Element *e, const Constants *c, const Pair *p, double log_1, double log_2, int k, Values *out)
{
    double scale = c->scale * e->half;
    double turn_re = scale * (e->tx * e->tx - e->ty * e->ty), turn_im = scale * (2.0 * e->tx * e->ty);
    double bend = p->angle * p->double_h, shear = p->double_h * p->ratio;
    double sum = p->ratio * p->offset + log_1 + log_2 + bend;
    double diagonal = sum * (-0.5 * c->factor * scale) + scale * (1.0 + 2.0 * c->factor * (1.0 + c->log_length));
    double deviator = turn_re - bend * (0.5 * turn_re) - shear * (0.25 * turn_im);
    out->g01[k] = shear * (0.25 * turn_re) - bend * (0.5 * turn_im) + turn_im;
    out->g00[k] = diagonal + deviator;
    out->g11[k] = diagonal - deviator;
}

/* Squared distances of the targets of a chunk from a point, and their logarithms. */
INLINE void distances(const double *point, int count, const double *px, const double *py, double *square, double *log)
{
    double x = point[0], y = point[1];
    for (int k = 0; k < count; k++) {
        double dx = px[k] - x, dy = py[k] - y;
        square[k] = dx * dx + dy * dy;
        log[k] = logarithm(square[k]);
    }
}

/* G and H (those that are wanted) of one element at the targets of a chunk; `line` is -2 on none. */
INLINE void values_of(const Element *e, const Constants *c, int64_t line, int64_t index, int count, const double *px,
                      const double *py, const int64_t *target_line, const int64_t *target_element, const double *xi,
                      const double *square_1, const double *log_1, const double *square_2, const double *log_2,
                      int wants_g, int wants_h, Values *out)
{
    int64_t own = 0;
    for (int k = 0; k < count; k++) {
        double x1 = px[k] - e->x1, y1 = py[k] - e->y1, x2 = px[k] - e->x2, y2 = py[k] - e->y2;
        double on = target_line[k] == line ? 0.0 : 1.0;
        own |= target_element[k] == index;
        Pair p = pair_of(e, x1, y1, x2, y2, square_1[k], square_2[k], log_1[k], log_2[k], on);
        if (wants_h)
            write_h(e, c, &p, x1, y1, x2, y2, square_1[k], square_2[k], k, out);
        if (wants_g)
            write_g(e, c, &p, log_1[k], log_2[k], k, out);
    }
    for (int k = 0; own && k < count; k++) {
        if (target_element[k] != index)
            continue;
        /* A node of the element itself: distances along it, the principal value. */
        double x1 = px[k] - e->x1, y1 = py[k] - e->y1, x2 = px[k] - e->x2, y2 = py[k] - e->y2;
        double reach_1 = e->half * (1.0 + xi[k]), reach_2 = e->half * (1.0 - xi[k]);
        double s1 = reach_1 * reach_1, s2 = reach_2 * reach_2, l1 = logarithm(s1), l2 = logarithm(s2);
        Pair p = pair_of(e, x1, y1, x2, y2, s1, s2, l1, l2, 0.0);
        double more = 4.0 * e->half * e->half * fabs(xi[k]), nearest = s1 < s2 ? s1 : s2;
        p.offset = xi[k];
        p.ratio = copysign(more < 0.41 * nearest ? twice_atanh(more / (2.0 * nearest + more)) : fabs(l1 - l2), xi[k]);
        if (wants_h)
            write_h(e, c, &p, x1, y1, x2, y2, s1, s2, k, out);
        if (wants_g)
            write_g(e, c, &p, l1, l2, k, out);
    }
}

/* G and H, (2, 2, n, m) each or null, of n elements at m targets. The planes of G and of H are `plane` numbers apart, and
   their rows `row`. Lines are -1 on none, elements of targets -1 where they are nodes of none. */
DISPATCHED void petcontact_constant(
    int64_t n, const double *start, const double *end, const int64_t *line, const int64_t *index, int64_t m,
    const double *x, const int64_t *target_line, const int64_t *target_element, const double *xi, double nu, double length,
    double *g, double *h, int64_t plane, int64_t row)
{
    Constants c = constants_of(nu, length);
    Values values;
    double px[CHUNK], py[CHUNK], square[2][CHUNK], log[2][CHUNK];
    for (int64_t first = 0; first < m; first += CHUNK) {
        int count = m - first < CHUNK ? (int)(m - first) : CHUNK, one = 0;
        for (int k = 0; k < count; k++) {
            px[k] = x[2 * (first + k)];
            py[k] = x[2 * (first + k) + 1];
        }
        for (int64_t i = 0; i < n; i++) {
            Element e = element_between(start + 2 * i, end + 2 * i);
            /* Neighbours share an end point, and with it the distances and logarithms to all targets. */
            if (i > 0 && start[2 * i] == end[2 * i - 2] && start[2 * i + 1] == end[2 * i - 1])
                one = 1 - one;
            else
                distances(start + 2 * i, count, px, py, square[one], log[one]);
            distances(end + 2 * i, count, px, py, square[1 - one], log[1 - one]);
            values_of(&e, &c, line[i] < 0 ? -2 : line[i], index[i], count, px, py, target_line + first,
                      target_element + first, xi + first, square[one], log[one], square[1 - one], log[1 - one], g != 0,
                      h != 0, &values);
            size_t bytes = count * sizeof(double);
            if (g) {
                double *to = g + i * row + first;
                memcpy(to, values.g00, bytes);
                memcpy(to + plane, values.g01, bytes);
                memcpy(to + 2 * plane, values.g01, bytes);
                memcpy(to + 3 * plane, values.g11, bytes);
            }
            if (h) {
                double *to = h + i * row + first;
                memcpy(to, values.h00, bytes);
                memcpy(to + plane, values.h01, bytes);
                memcpy(to + 2 * plane, values.h10, bytes);
                memcpy(to + 3 * plane, values.h11, bytes);
            }
        }
    }
}

/* One interleaved pair (component 0, component 1) a target: the kernel's columns times a vector. */
INLINE void put(int count, const double *k00, const double *k01, const double *k10, const double *k11, double f0, double f1,
                double *out)
{
    for (int k = 0; k < count; k++) {
        out[2 * k] = k00[k] * f0 + k01[k] * f1;
        out[2 * k + 1] = k10[k] * f0 + k11[k] * f1;
    }
}

INLINE void subtract(int count, const Values *v, double f0, double f1, double *out)
{
    for (int k = 0; k < count; k++) {
        out[2 * k] -= v->h00[k] * f0 + v->h01[k] * f1;
        out[2 * k + 1] -= v->h10[k] * f0 + v->h11[k] * f1;
    }
}

/* Columns of the boundary operators of a mesh of straight elements of order 0, one node in the middle of each.

   start, end, x (n, 2), line (n,), known (n, 2) and frame (n, 2, 2) are the whole mesh's; node i has the right-hand sides
   rhs_first[i] to rhs_first[i+1]-1, each G times a traction less (½ + H) times a displacement. Filled are, where not null,
   system (k, 2, m, 2) and beside (number of the columns' right-hand sides, m, 2), G in units of the length. */
DISPATCHED void petcontact_columns(
    int64_t m, const int64_t *rows, int64_t k, const int64_t *columns, const double *start, const double *end,
    const int64_t *line, const double *x, const int64_t *known, const double *frame, const int64_t *rhs_first,
    const double *rhs_traction, const double *rhs_displacement, double nu, double length, double *system, double *beside)
{
    Constants c = constants_of(nu, length);
    const double unit = 1.0 / length;
    Values v;
    double px[CHUNK], py[CHUNK], xi[CHUNK] = {0.0}, square[2][CHUNK], log[2][CHUNK];
    int64_t target_line[CHUNK];
    for (int64_t first = 0; first < m; first += CHUNK) {
        const int count = m - first < CHUNK ? (int)(m - first) : CHUNK;
        const int64_t *row = rows + first;
        int one = 0;
        int64_t rhs = 0;
        for (int i = 0; i < count; i++) {
            px[i] = x[2 * row[i]];
            py[i] = x[2 * row[i] + 1];
            target_line[i] = line[row[i]];
        }
        for (int64_t j = 0; j < k; j++) {
            const int64_t node = columns[j], last = j ? columns[j - 1] : 0, first_rhs = rhs_first[node];
            const int64_t own_rhs = rhs_first[node + 1] - first_rhs;
            const int64_t *is_known = known + 2 * node;
            int needs_g = system && !(is_known[0] && is_known[1]), needs_h = system && (is_known[0] || is_known[1]);
            for (int64_t q = first_rhs; beside && q < first_rhs + own_rhs; q++) {
                needs_g |= rhs_traction[2 * q] != 0.0 || rhs_traction[2 * q + 1] != 0.0;
                needs_h |= rhs_displacement[2 * q] != 0.0 || rhs_displacement[2 * q + 1] != 0.0;
            }
            const Element e = element_between(start + 2 * node, end + 2 * node);
            if (j > 0 && start[2 * node] == end[2 * last] && start[2 * node + 1] == end[2 * last + 1])
                one = 1 - one;
            else
                distances(start + 2 * node, count, px, py, square[one], log[one]);
            const double *s1 = square[one], *l1 = log[one];
            double *s2 = square[1 - one], *l2 = log[1 - one];
            const int64_t on = line[node] < 0 ? -2 : line[node];
            distances(end + 2 * node, count, px, py, s2, l2);
            if (needs_g && needs_h)
                values_of(&e, &c, on, node, count, px, py, target_line, row, xi, s1, l1, s2, l2, 1, 1, &v);
            else if (needs_g)
                values_of(&e, &c, on, node, count, px, py, target_line, row, xi, s1, l1, s2, l2, 1, 0, &v);
            else if (needs_h)
                values_of(&e, &c, on, node, count, px, py, target_line, row, xi, s1, l1, s2, l2, 0, 1, &v);
            int own = count;                                   /* place of the node among the targets */
            if (row[0] <= node && node <= row[count - 1])
                for (own = 0; own < count && row[own] != node;)
                    own++;
            for (int d = 0; system && d < 2; d++) {
                const double *f = frame + 4 * node + 2 * d;
                double *out = system + ((2 * j + d) * m + first) * 2;
                if (is_known[d]) {
                    put(count, v.h00, v.h01, v.h10, v.h11, f[0], f[1], out);
                    if (own < count) {
                        out[2 * own] += 0.5 * f[0];
                        out[2 * own + 1] += 0.5 * f[1];
                    }
                } else
                    put(count, v.g00, v.g01, v.g01, v.g11, -unit * f[0], -unit * f[1], out);
            }
            for (int64_t q = first_rhs; beside && q < first_rhs + own_rhs; q++, rhs++) {
                const double *t = rhs_traction + 2 * q, *u = rhs_displacement + 2 * q;
                double *out = beside + (rhs * m + first) * 2;
                if (t[0] != 0.0 || t[1] != 0.0)
                    put(count, v.g00, v.g01, v.g01, v.g11, unit * t[0], unit * t[1], out);
                else
                    memset(out, 0, 2 * count * sizeof(double));
                if (u[0] != 0.0 || u[1] != 0.0) {
                    subtract(count, &v, u[0], u[1], out);
                    if (own < count) {
                        out[2 * own] -= 0.5 * u[0];
                        out[2 * own + 1] -= 0.5 * u[1];
                    }
                }
            }
        }
    }
}
