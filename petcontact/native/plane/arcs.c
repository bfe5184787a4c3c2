/* Both kernels over circular arcs of any order: petcontact.bem.kelvin2d.arc_elements in C, with the same formulas; see there. */

#include "arcs.h"
#include "straight.h"

enum { MIDDLE = 24 }; /* Gauss points between far and close */
static const double CLOSE_SUM = 2.9;
enum { CLOSED, NEAR, FAR }; /* rules */

INLINE double sinc(double x)
{
    return series_of(-x * x, 1);
}
INLINE double cosine(double x)
{
    return series_of(-x * x, 0);
}
INLINE double exponential(double x)
{
    return series_of(x * x, 0) + x * sinhc(x);
}

/* As `local_of`: coordinates of those that are not far, each accurate close to the ends of the arc. */
INLINE void local_of_arc(const Element *e, const Targets *t, Local *p)
{
    const Arc *a = e->arc;
    int from = t->count, to = 0;
    for (int i = 0; i < t->count; i++) {
        const double dx = t->x[i] - a->middle[0], dy = t->y[i] - a->middle[1];
        p->rule[i] = dx * dx + dy * dy < a->reach_2 ? NEAR : FAR;
    }
    for (int i = 0; i < t->count; i++)
        if (p->rule[i] == NEAR) {
            from = from < i ? from : i;
            to = i + 1;
        }
    preimages_of(e, t, from, to, p);
    for (int i = from; i < to; i++)
        if (p->rule[i] == NEAR && sum_of(p->left[i], p->right[i], p->h[i]) < CLOSE_SUM)
            p->rule[i] = CLOSED;
    for (int i = to; i < t->count + LANES; i++) /* what fills the last vector */
        p->left[i] = p->right[i] = p->h[i] = p->on_line[i] = 0.0;
}

/* Moments in the global frame by Gauss quadrature. */
INLINE void arc_by_points(const Element *e, const Constants *c, const Sources *s, const Targets *t, int first, Wanted w,
                          Values *v)
{
    const Gauss *rule = e->rule->gauss + s->count;
    const double log_half = logarithm(e->half);
    double px[LANES], py[LANES], log[POINTS * LANES];
    for (int k = 0; k < LANES; k++) {
        const int i = first + k < t->count ? first + k : t->count - 1;
        px[k] = t->x[i];
        py[k] = t->y[i];
    }
    Vector tangential[POINTS], normal[POINTS], shear_re[POINTS], shear_im[POINTS];
    for (int q = 0; q < s->count; q++) {
        const Vector x = s->x[q] - at(px), y = s->y[q] - at(py), xx = x * x, yy = y * y, square = xx + yy,
                     over = 1.0 / square;
        *(Unaligned *)(log + q * LANES) = square;
        tangential[q] = (x * s->tx[q] + y * s->ty[q]) * over;
        normal[q] = (x * s->ty[q] - y * s->tx[q]) * over;
        shear_re[q] = (xx - yy) * over;
        shear_im[q] = 2.0 * x * y * over;
    }
    for (int k = 0; w.g && k < s->count * LANES; k++)
        log[k] = logarithm(log[k]);
    for (int n = w.node; n < w.last; n++) {
        Moments m = {{0.0}, {0.0}, {0.0}, {0.0}, {0.0}, {0.0}, {0.0}};
        for (int q = 0; q < s->count; q++) {
            const double weight = rule->product[n][q];
            const Vector dipole = weight * normal[q];
            m.tangential += weight * tangential[q];
            m.normal += dipole;
            m.dipole_re += dipole * shear_re[q];
            m.dipole_im += dipole * shear_im[q];
            if (w.g) {
                m.log += weight * at(log + q * LANES);
                m.shear_re += weight * shear_re[q];
                m.shear_im += weight * shear_im[q];
            }
        }
        m.log = 0.5 * m.log - e->rule->weight[n] * log_half;
        m.shear_re *= 0.5;
        m.shear_im *= 0.5;
        combine(e, c, &m, e->rule->weight[n], 1.0, 0.0, w, v + n, first);
    }
}

typedef struct { /* smooth remainders at the Gauss points: of the logarithm, of α/2 cot x and of (α/2)²/sin² x */
    Vector log[POINTS], first_re[POINTS], first_im[POINTS], second_re[POINTS], second_im[POINTS];
} Remainders;

INLINE void remainders_of(const Element *e, Vector x, Vector h, Remainders *r)
{
    const Arc *a = e->arc;
    const int points = (int)a->rest, terms = (int)a->terms;
    const double scale = 0.5 * a->angle / PI, half = 0.5 * a->angle;
    for (int q = 0; q < points; q++) {
        const Vector re = scale * (e->rule->gauss[points].s[q] - x), im = -scale * h;
        const Vector square_re = re * re - im * im, square_im = 2.0 * re * im;
        Vector sum_re[3], sum_im[3];
        for (int c = 0; c < 3; c++) {
            sum_re[c] = e->series[c][terms] + 0.0 * re;
            sum_im[c] = 0.0 * re;
        }
        for (int k = terms - 1; k >= 0; k--)
            for (int c = 0; c < 3; c++) {
                const Vector old = sum_re[c];
                sum_re[c] = old * square_re - sum_im[c] * square_im + e->series[c][k];
                sum_im[c] = old * square_im + sum_im[c] * square_re;
            }
        r->log[q] = sum_re[0];
        r->first_re[q] = half * (re * sum_re[1] - im * sum_im[1]);
        r->first_im[q] = half * (re * sum_im[1] + im * sum_re[1]);
        r->second_re[q] = half * half * sum_re[2];
        r->second_im[q] = half * half * sum_im[2];
    }
}

/* Moments in the frame of the middle: those of a straight element in the coordinate s, and the remainders. */
INLINE void arc_closed(const Element *e, const Constants *c, const Local *p, int first, Wanted w, Values *v)
{
    const Arc *a = e->arc;
    const Vector h = at(p->h + first), x = 0.5 * (at(p->left + first) + at(p->right + first));
    const int points = (int)a->rest;
    const Gauss *rule = e->rule->gauss + points;
    double cos[LANES], sin[LANES], grown[LANES], lifted[LANES];
    for (int k = 0; k < LANES; k++) {
        const double turn = 0.5 * a->angle * (p->left[first + k] + p->right[first + k]), rise = a->angle * p->h[first + k];
        cos[k] = cosine(turn);
        sin[k] = turn * sinc(turn);
        grown[k] = exponential(rise);
        lifted[k] = p->h[first + k] * sinhc(rise);
    }
    /* exp(-iαz) and i exp(-iαξ) sinh(αh)/α */
    const Vector phase_re = at(grown) * at(cos), phase_im = -at(grown) * at(sin);
    const Vector lift_re = at(lifted) * at(sin), lift_im = at(lifted) * at(cos);
    Legendre l;
    Remainders r;
    legendre_moments(e->order, p, first, &l);
    remainders_of(e, x, h, &r);
    for (int n = w.node; n < w.last; n++) {
        const double weight = e->rule->weight[n], wave_re = a->wave_re[n], wave_im = a->wave_im[n];
        Vector log = -(0.5 * a->angle * weight) * h, re = {0.0}, im = {0.0}, second_re = {0.0}, second_im = {0.0};
        for (int k = 0; k <= e->order; k++) {
            const double factor = e->rule->to_basis[n][k];
            log += factor * l.log[k];
            re += factor * l.re[k];
            im += factor * l.im[k];
            second_re += factor * l.square_re[k];
            second_im += factor * l.square_im[k];
        }
        for (int q = 0; q < points; q++) {
            const double factor = rule->product[n][q];
            log += factor * r.log[q];
            re += factor * r.first_re[q];
            im += factor * r.first_im[q];
            second_re += factor * r.second_re[q];
            second_im += factor * r.second_im[q];
        }
        im += 0.5 * a->angle * weight;
        const Vector turned = im - a->angle * weight;
        /* ½ wave + lift (cauchy - iα), and ½α wave - i lift second */
        const Vector s_re = 0.5 * wave_re + (lift_re * re - lift_im * turned);
        const Vector s_im = 0.5 * wave_im + (lift_re * turned + lift_im * re);
        const Vector d_re = 0.5 * a->angle * wave_re + (lift_re * second_im + lift_im * second_re);
        const Vector d_im = 0.5 * a->angle * wave_im - (lift_re * second_re - lift_im * second_im);
        const Moments m = {
            .log = log,
            .tangential = re,
            .normal = im,
            .shear_re = phase_re * s_re - phase_im * s_im,
            .shear_im = -(phase_re * s_im + phase_im * s_re),
            .dipole_re = phase_re * d_re - phase_im * d_im,
            .dipole_im = -(phase_re * d_im + phase_im * d_re),
        };
        combine(e, c, &m, weight, e->tx * e->tx - e->ty * e->ty, 2.0 * e->tx * e->ty, w, v + n, first);
    }
}

/* As `straight_values`. */
DISPATCHED void petcontact_arc_values(const Element *e, const Constants *c, const Targets *t, Wanted w, Values *v)
{
    Local p;
    Sources far = {.count = 0}, near = {.count = 0};
    local_of_arc(e, t, &p);
    for (int first = 0, last; first < t->count; first = last) {
        const int rule = p.rule[first];
        for (last = first + 1; last < t->count && p.rule[last] == rule;)
            last++;
        if (rule == FAR && !far.count)
            sources_of(e, (int)e->arc->far, &far);
        if (rule == NEAR && !near.count)
            sources_of(e, MIDDLE, &near);
        for (int i = first; i < last; i += LANES)
            if (rule == CLOSED)
                arc_closed(e, c, &p, i, w, v);
            else
                arc_by_points(e, c, rule == FAR ? &far : &near, t, i, w, v);
    }
}
