/* Laws of contact at every node: petcontact.contact.laws and petcontact.contact.linearisation in C. */

#include "elementary.h"

static double length_of(const double *x, int64_t count)
{
    if (count == 1)
        return fabs(x[0]);
    double a = fabs(x[0]), b = fabs(x[1]), large = a > b ? a : b, small = a > b ? b : a;
    return large > 0.0 ? large * sqrt(1.0 + (small / large) * (small / large)) : large;
}

/* Projection of tau (m, k), its derivative (m, k, k) and the states (m,) by Signorini's and Coulomb's law, k = 2 or 3; any of
   the three, and `absent`, may be NULL. */
void petcontact_coulomb(int64_t m, int64_t k, const double *tau, const double *coefficient, const double *bound,
                        const uint8_t *unilateral, const uint8_t *absent, double *projection, double *derivative,
                        int8_t *states)
{
    int64_t t = k - 1;
    for (int64_t i = 0; i < m; i++, tau += k) {
        double normal = tau[t], mu = coefficient[i];
        int opened = (unilateral[i] && normal <= 0.0) || (absent && absent[i]), coulomb = isfinite(mu);
        double p = opened ? 0.0 : normal, limit = coulomb ? mu * fabs(p) : INFINITY;
        double radius = unilateral[i] && p <= 0.0 ? 0.0 : limit < bound[i] || isnan(limit) ? limit : bound[i];
        double size = length_of(tau, t);
        int outside = size > radius || radius == 0.0;
        if (projection) {
            double shrink = size > radius ? radius / size : 1.0;
            for (int64_t a = 0; a < t; a++)
                /* on a line the bound itself, to its last digit */
                *projection++ = t == 1 && size > radius ? copysign(radius, tau[a]) : shrink * tau[a];
            *projection++ = p;
        }
        if (derivative) {
            double slope = coulomb && radius < bound[i] && !opened && outside ? (p > 0.0) * mu - (p < 0.0) * mu : 0.0;
            double left = !outside ? 1.0 : t == 1 || radius == 0.0 ? 0.0 : radius / size;
            for (int64_t a = 0; a < t; a++) {
                double along = size > 0.0 ? (t == 1 ? copysign(1.0, tau[a]) : tau[a] / size) : 0.0;
                for (int64_t b = 0; b < t; b++) {
                    double other = outside && t > 1 && size > 0.0 ? tau[b] / size : 0.0;
                    *derivative++ = left * ((a == b) - along * other);
                }
                *derivative++ = slope * along;
            }
            for (int64_t b = 0; b < t; b++)
                *derivative++ = 0.0;
            *derivative++ = !opened;
        }
        if (states)
            states[i] = opened ? 2 : outside;
    }
}

/* constant = derivative tau - projection (m, k), 0 where `stick`; `active` and `stick` (m, k): columns of the derivative that
   are not zero, and its rows that are those of the identity. */
void petcontact_linearise(int64_t m, int64_t k, const double *tau, const double *projection, const double *derivative,
                          double *constant, uint8_t *active, uint8_t *stick)
{
    for (int64_t i = 0; i < m; i++, tau += k, projection += k, derivative += k * k, constant += k, active += k, stick += k) {
        for (int64_t a = 0; a < k; a++)
            active[a] = 0, stick[a] = 1, constant[a] = -projection[a];
        for (int64_t a = 0; a < k; a++)
            for (int64_t b = 0; b < k; b++) {
                double entry = derivative[k * a + b];
                constant[a] += entry * tau[b];
                active[b] |= entry != 0.0;
                stick[a] &= entry == (a == b);
            }
        for (int64_t a = 0; a < k; a++)
            if (stick[a])
                constant[a] = 0.0;
    }
}
