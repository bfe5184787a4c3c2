/* Displacement and stress inside a body of the plane from the data at the nodes of elements: petcontact.bem.kelvin2d.inside in C,
   with the same formulas, but for the stress at points close to an element. */

#include "arcs.h"
#include "constant.h"
#include "straight.h"

void petcontact_plane_values(const Element *e, const Constants *c, const Targets *t, Wanted w, Ends *ends, Values *v);

enum { MIDDLE = 24 }; /* Gauss points between far and close */
static const double CLOSE_SUM = 2.9;

typedef struct { /* of Gauss points at targets: ds/ζ, ζ̄ ds/ζ², dx/ζ² and (dx̄ - 2ζ̄ dx/ζ)/ζ² */
    double line_re[POINTS][CHUNK], line_im[POINTS][CHUNK], bent_re[POINTS][CHUNK], bent_im[POINTS][CHUNK];
    double twice_re[POINTS][CHUNK], twice_im[POINTS][CHUNK], triple_re[POINTS][CHUNK], triple_im[POINTS][CHUNK];
} Integrands;

/* Gauss points for each target, 0 for those that are close. These kernels are more singular by one than those of G and H, whose
   rules take one point less. */
INLINE void counts_of(const Element *e, const Targets *t, int *count)
{
    Local p;
    if (e->arc)
        preimages_of(e, t, 0, t->count, &p);
    else {
        local_of(e, t, &p);
        tiers_of(e, t->count, &p);
    }
    for (int i = 0; i < t->count; i++) {
        const int near = e->arc ? MIDDLE : p.rule[i] < 2 ? MIDDLE : (int)e->rule->points[p.rule[i] - 1] + 1;
        count[i] = sum_of(p.left[i], p.right[i], p.h[i]) < CLOSE_SUM ? 0 : near;
    }
    for (int i = 0; e->arc && i < t->count; i++) {
        const double dx = t->x[i] - e->arc->middle[0], dy = t->y[i] - e->arc->middle[1];
        count[i] = dx * dx + dy * dy < e->arc->reach_2 ? count[i] : (int)e->arc->far + 1;
    }
}

INLINE void integrands_of(const Element *e, const Sources *s, int count, const double *x, const double *y, Integrands *v)
{
    for (int q = 0; q < s->count; q++)
        for (int i = 0; i < count; i++) {
            const double re = s->x[q] - x[i], im = s->y[q] - y[i], over = 1.0 / (re * re + im * im);
            const double inverse_re = re * over, inverse_im = -im * over;
            const double ratio_re = (re * re - im * im) * over, ratio_im = -2.0 * re * im * over;
            const double square_re = ratio_re * over, square_im = ratio_im * over;
            const double half_re = e->half * inverse_re, half_im = e->half * inverse_im;
            const double back_re = s->tx[q] - 2.0 * (ratio_re * s->tx[q] - ratio_im * s->ty[q]);
            const double back_im = -s->ty[q] - 2.0 * (ratio_re * s->ty[q] + ratio_im * s->tx[q]);
            v->line_re[q][i] = half_re;
            v->line_im[q][i] = half_im;
            v->bent_re[q][i] = ratio_re * half_re - ratio_im * half_im;
            v->bent_im[q][i] = ratio_re * half_im + ratio_im * half_re;
            v->twice_re[q][i] = s->tx[q] * square_re - s->ty[q] * square_im;
            v->twice_im[q][i] = s->tx[q] * square_im + s->ty[q] * square_re;
            v->triple_re[q][i] = back_re * square_re - back_im * square_im;
            v->triple_im[q][i] = back_re * square_im + back_im * square_re;
        }
}

/* Adds what an element gives to the displacement at targets (m, 2, states), and to the winding numbers (m,). */
INLINE void add_moved(const Element *e, const Values *values, int count, int64_t states, const double *u,
                      const double *traction, double *moved, double *wound)
{
    for (int n = 0; n <= e->order; n++) {
        const Values *v = values + n;
        for (int i = 0; i < count; i++)
            wound[i] -= 0.5 * (v->h00[i] + v->h11[i]);
        for (int64_t k = 0; k < states; k++) {
            const double tx = traction[2 * n * states + k], ty = traction[(2 * n + 1) * states + k];
            const double ux = u[2 * n * states + k], uy = u[(2 * n + 1) * states + k];
            for (int i = 0; i < count; i++) {
                double *to = moved + 2 * i * states + k;
                to[0] += (v->g00[i] * tx + v->g01[i] * ty) - (v->h00[i] * ux + v->h01[i] * uy);
                to[states] += (v->g01[i] * tx + v->g11[i] * ty) - (v->h10[i] * ux + v->h11[i] * uy);
            }
        }
    }
}

/* The mean of σ_xx and σ_yy and the conjugate deviator, over c->scale, at `count` targets, from one state's data. */
INLINE void sums_of(const Element *e, const Constants *c, const Integrands *v, int points, int count, int64_t states,
                    double length, const double *u, const double *traction, double *mean, double *re, double *im)
{
    const Gauss *rule = e->rule->gauss + points;
    for (int i = 0; i < count; i++)
        mean[i] = re[i] = im[i] = 0.0;
    for (int q = 0; q < points; q++) {
        double tx = 0.0, ty = 0.0, ux = 0.0, uy = 0.0;
        for (int n = 0; n <= e->order; n++) {
            const double weight = rule->product[n][q];
            tx += weight * traction[2 * n * states];
            ty += weight * traction[(2 * n + 1) * states];
            ux += weight * length * u[2 * n * states];
            uy += weight * length * u[(2 * n + 1) * states];
        }
        for (int i = 0; i < count; i++) {
            const double l_re = v->line_re[q][i], l_im = v->line_im[q][i], b_re = v->bent_re[q][i], b_im = v->bent_im[q][i];
            const double d_re = v->twice_re[q][i], d_im = v->twice_im[q][i], t_re = v->triple_re[q][i],
                         t_im = v->triple_im[q][i];
            mean[i] += (l_re * tx - l_im * ty) + (d_im * ux + d_re * uy);
            re[i] += 0.5 * (c->factor * (l_re * tx + l_im * ty) + (b_re * tx - b_im * ty));
            im[i] += 0.5 * (c->factor * (l_im * tx - l_re * ty) + (b_im * tx + b_re * ty));
            re[i] -= 0.5 * ((t_im * ux + t_re * uy) - (d_im * ux - d_re * uy));
            im[i] += 0.5 * ((t_re * ux - t_im * uy) - (d_re * ux + d_im * uy));
        }
    }
}

/* Adds to the displacement (m, 2, states), the stress (m, 3, states) over the scale of tractions and the winding number (m,) at m
   points what n elements of one order cause there by displacements and scaled tractions, (n nodes, 2, states); `close` (n, m)
   becomes 1 where an element is close to a point, whose stress gets nothing from it. */
DISPATCHED void petcontact_plane_field(const Elements *elements, int64_t n, const Points *points, int64_t m, int64_t states,
                                       const double *u, const double *traction, double *moved, double *stress, double *wound,
                                       char *close)
{
    const Constants c = constants_of(elements);
    Targets t;
    Ends ends;
    Values values[NODES];
    Sources s;
    Integrands v;
    int counts[CHUNK], rows[CHUNK];
    double x[CHUNK], y[CHUNK], mean[CHUNK], re[CHUNK], im[CHUNK];
    for (int64_t first = 0; first < m; first += CHUNK) {
        load_targets(points, 0, first, m - first < CHUNK ? (int)(m - first) : CHUNK, &t);
        for (int64_t i = 0; i < n; i++) {
            const Element e = element_of(elements, i);
            const int64_t data = i * (e.order + 1) * 2 * states;
            if (!i)
                ends.end = 0;
            petcontact_plane_values(&e, &c, &t, (Wanted){1, 1, 0, e.order + 1}, &ends, values);
            add_moved(&e, values, t.count, states, u + data, traction + data, moved + 2 * first * states, wound + first);
            counts_of(&e, &t, counts);
            for (int k = 0; k < t.count; k++)
                close[i * m + first + k] = counts[k] == 0;
            for (int number = 1; number <= POINTS; number++) {
                int count = 0;
                for (int k = 0; k < t.count; k++)
                    if (counts[k] == number) {
                        x[count] = t.x[k];
                        y[count] = t.y[k];
                        rows[count++] = k;
                    }
                if (!count)
                    continue;
                sources_of(&e, number, &s);
                integrands_of(&e, &s, count, x, y, &v);
                for (int64_t k = 0; k < states; k++) {
                    sums_of(&e, &c, &v, number, count, states, elements->length, u + data + k, traction + data + k, mean, re,
                            im);
                    for (int j = 0; j < count; j++) {
                        double *to = stress + (first + rows[j]) * 3 * states + k;
                        to[0] += c.scale * (mean[j] + re[j]);
                        to[states] += c.scale * (mean[j] - re[j]);
                        to[2 * states] -= c.scale * im[j];
                    }
                }
            }
        }
    }
}
