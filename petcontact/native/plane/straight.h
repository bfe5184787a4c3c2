/* Both kernels over straight elements of any order: petcontact.bem.kelvin2d.segments and moments in C, with the same
   formulas; see there. From afar ever fewer Gauss points are enough. */

#ifndef PETCONTACT_STRAIGHT_H
#define PETCONTACT_STRAIGHT_H

#include "elements.h"

typedef struct { /* moments of one function at some targets, as in bem.kelvin2d.moments.Moments */
    Vector log, tangential, normal, shear_re, shear_im, dipole_re, dipole_im;
} Moments;

INLINE Vector at(const double *numbers)
{
    return *(const Unaligned *)numbers;
}

INLINE void local_of(const Element *e, const Targets *t, Local *p)
{
    const double over = 1.0 / e->half;
    for (int i = 0; i < t->count; i++) {
        const double ax = t->x[i] - e->start[0], ay = t->y[i] - e->start[1];
        const double bx = t->x[i] - e->end[0], by = t->y[i] - e->end[1];
        const int own = t->element[i] == e->index, flat = own | (t->line[i] == e->line);
        const double a = (ax * e->tx + ay * e->ty) * over, b = (bx * e->tx + by * e->ty) * over;
        const double ha = (ay * e->tx - ax * e->ty) * over, hb = (by * e->tx - bx * e->ty) * over;
        const double lift = a * a + ha * ha < b * b + hb * hb ? ha : hb;
        p->left[i] = own ? t->xi[i] + 1.0 : a;
        p->right[i] = own ? t->xi[i] - 1.0 : b;
        p->h[i] = flat ? 0.0 : lift;
        p->on_line[i] = flat;
    }
    for (int i = t->count; i < t->count + LANES; i++) /* what fills the last vector */
        p->left[i] = p->right[i] = p->h[i] = p->on_line[i] = 0.0;
}

INLINE void tiers_of(const Element *e, int count, Local *p)
{
    double distance[CHUNK];
    for (int i = 0; i < count; i++) {
        const double z = 0.5 * (p->left[i] + p->right[i]), square = p->h[i] * p->h[i];
        p->rule[i] = !(sum_of(p->left[i], p->right[i], p->h[i]) < e->rule->close_sum);
        distance[i] = z * z + square;
    }
    for (int k = 1; k < (int)e->rule->tiers; k++)
        for (int i = 0; i < count; i++)
            p->rule[i] += distance[i] >= e->rule->radius_2[k];
}

/* G and H from moments in a frame of squared tangent (re, im). */
INLINE void combine(const Element *e, const Constants *c, const Moments *m, double weight, double re, double im, Wanted w,
                    Values *v, int first)
{
    if (w.g) {
        const double scale = c->scale * e->half * c->unit;
        const double constant = scale * (0.5 - c->factor * (logarithm(e->half) - c->log_length)) * weight;
        const Vector sum = constant - (c->factor * scale) * m->log;
        const Vector deviator = m->shear_re * (scale * re) - m->shear_im * (scale * im);
        *(Unaligned *)(v->g01 + first) = m->shear_re * (scale * im) + m->shear_im * (scale * re);
        *(Unaligned *)(v->g00 + first) = sum + deviator;
        *(Unaligned *)(v->g11 + first) = sum - deviator;
    }
    if (w.h) {
        const double scale = -c->scale;
        const Vector deviator = m->dipole_re * (scale * re) - m->dipole_im * (scale * im);
        const Vector off = m->dipole_re * (scale * im) + m->dipole_im * (scale * re);
        const Vector rotation = m->tangential * (scale * (1.0 - 2.0 * c->nu));
        const Vector sum = m->normal * (scale * (2.0 - 2.0 * c->nu));
        *(Unaligned *)(v->h00 + first) = sum + deviator;
        *(Unaligned *)(v->h11 + first) = sum - deviator;
        *(Unaligned *)(v->h01 + first) = off + rotation;
        *(Unaligned *)(v->h10 + first) = off - rotation;
    }
}

/* What moments of straight elements have in common, from ∫ L/(s-z) and h ∫ L/(s-z)². */
INLINE void finish_straight(const Element *e, const Constants *c, Moments *m, double weight, Vector h, Wanted w, Values *v,
                            int first)
{
    m->shear_re = 0.5 * weight - h * m->normal;
    m->shear_im = -h * m->tangential;
    combine(e, c, m, weight, e->tx * e->tx - e->ty * e->ty, 2.0 * e->tx * e->ty, w, v, first);
}

INLINE void straight_by_points(const Element *e, const Constants *c, int points, const Local *p, int first, Wanted w,
                               Values *v)
{
    const Gauss *rule = e->rule->gauss + points;
    const Vector h = at(p->h + first), xi = 0.5 * (at(p->left + first) + at(p->right + first));
    Vector inverse[POINTS], along[POINTS], square[POINTS], bent[POINTS];
    double log[POINTS * LANES];
    for (int q = 0; q < points; q++) {
        const Vector u = rule->s[q] - xi, distance = u * u + h * h;
        *(Unaligned *)(log + q * LANES) = distance;
        inverse[q] = 1.0 / distance;
        along[q] = u * inverse[q];
        square[q] = inverse[q] * inverse[q];
        bent[q] = along[q] * inverse[q];
    }
    for (int k = 0; w.g && k < points * LANES; k++)
        log[k] = logarithm(log[k]);
    for (int n = w.node; n < w.last; n++) {
        Moments m = {{0.0}, {0.0}, {0.0}, {0.0}, {0.0}, {0.0}, {0.0}};
        for (int q = 0; q < points; q++) {
            const double weight = rule->product[n][q];
            m.tangential += weight * along[q];
            m.normal += weight * inverse[q];
            if (w.g)
                m.log += weight * at(log + q * LANES);
            if (w.h) {
                m.dipole_re += weight * square[q];
                m.dipole_im += weight * bent[q];
            }
        }
        const Vector twice = 2.0 * h * h;
        m.dipole_re = h * (m.normal - twice * m.dipole_re);
        m.dipole_im *= -twice;
        m.normal *= h;
        m.log *= 0.5;
        finish_straight(e, c, &m, e->rule->weight[n], h, w, v + n, first);
    }
}

typedef struct { /* Legendre moments: of the logarithm, 1/(s-z) and 1/(s-z)² */
    Vector log[NODES], re[NODES + 1], im[NODES + 1], square_re[NODES], square_im[NODES];
} Legendre;

/* ∫ P_k of 1/(s-z), the logarithm and 1/(s-z)² by the three-term recursion of Q_k. */
INLINE void legendre_moments(int order, const Local *p, int first, Legendre *m)
{
    const Vector h = at(p->h + first), left = at(p->left + first), right = at(p->right + first), x = 0.5 * (left + right);
    double log[LANES], ratio[LANES], angle[LANES];
    for (int k = 0; k < LANES; k++) {
        const double l = p->left[first + k], r = p->right[first + k], y = p->h[first + k], total = l + r;
        const double s1 = l * l + y * y, s2 = r * r + y * y, nearest = s1 < s2 ? s1 : s2, more = 2.0 * fabs(total);
        const double l1 = logarithm(s1), l2 = logarithm(s2);
        const double far = twice_atanh(more / (2.0 * nearest + more)), near = fabs(l1 - l2);
        angle[k] = angle_of(2.0 * y, l * r + y * y) * (1.0 - p->on_line[first + k]);
        ratio[k] = copysign(0.5 * (more < 0.41 * nearest ? far : near), -total);
        log[k] = 0.5 * (l1 + l2) - 0.5 * total * ratio[k] + y * angle[k] - 2.0;
    }
    m->log[0] = at(log);
    m->re[0] = at(ratio);
    m->im[0] = at(angle);
    m->re[1] = x * m->re[0] - h * m->im[0] + 2.0;
    m->im[1] = x * m->im[0] + h * m->re[0];
    const Vector re = left * right - h * h, im = h * (left + right), over = 2.0 / (re * re + im * im);
    m->square_re[0] = re * over;
    m->square_im[0] = -im * over;
    if (order > 0) {
        m->square_re[1] = x * m->square_re[0] - h * m->square_im[0] + m->re[0];
        m->square_im[1] = x * m->square_im[0] + h * m->square_re[0] + m->im[0];
    }
    for (int n = 1; n <= order; n++) {
        const double one = (2.0 * n + 1.0) / (n + 1.0), two = n / (n + 1.0), odd = 2.0 * n + 1.0;
        m->re[n + 1] = one * (x * m->re[n] - h * m->im[n]) - two * m->re[n - 1];
        m->im[n + 1] = one * (x * m->im[n] + h * m->re[n]) - two * m->im[n - 1];
        m->log[n] = (m->re[n - 1] - m->re[n + 1]) / odd;
        if (n < order) {
            m->square_re[n + 1] = m->square_re[n - 1] + odd * m->re[n];
            m->square_im[n + 1] = m->square_im[n - 1] + odd * m->im[n];
        }
    }
}

INLINE void straight_closed(const Element *e, const Constants *c, const Local *p, int first, Wanted w, Values *v)
{
    const Vector h = at(p->h + first), lifted = h * (1.0 - at(p->on_line + first));
    Legendre l;
    legendre_moments(e->order, p, first, &l);
    for (int n = w.node; n < w.last; n++) {
        Moments m = {{0.0}, {0.0}, {0.0}, {0.0}, {0.0}, {0.0}, {0.0}};
        for (int k = 0; k <= e->order; k++) {
            const double weight = e->rule->to_basis[n][k];
            m.log += weight * l.log[k];
            m.tangential += weight * l.re[k];
            m.normal += weight * l.im[k];
            m.dipole_re += weight * l.square_re[k];
            m.dipole_im += weight * l.square_im[k];
        }
        m.dipole_re *= lifted;
        m.dipole_im *= -lifted;
        finish_straight(e, c, &m, e->rule->weight[n], h, w, v + n, first);
    }
}

/* Runs of targets with one rule, a vector at a time: what a vector holds beyond its run the next run overwrites. */
INLINE void straight_values(const Element *e, const Constants *c, const Targets *t, Wanted w, Values *v)
{
    Local p;
    local_of(e, t, &p);
    tiers_of(e, t->count, &p);
    for (int first = 0, last; first < t->count; first = last) {
        const int rule = p.rule[first];
        for (last = first + 1; last < t->count && p.rule[last] == rule;)
            last++;
        for (int i = first; i < last; i += LANES)
            if (rule == 0)
                straight_closed(e, c, &p, i, w, v);
            else
                straight_by_points(e, c, (int)e->rule->points[rule - 1], &p, i, w, v);
    }
}

#endif
