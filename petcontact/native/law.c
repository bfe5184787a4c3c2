/* Laws of contact at every node: petcontact.contact.laws and petcontact.contact.linearisation in C. */

#include "elementary.h"

static double length_of(const double *x, int64_t count)
{
    if (count == 1)
        return fabs(x[0]);
    double a = fabs(x[0]), b = fabs(x[1]), large = a > b ? a : b, small = a > b ? b : a;
    return large > 0.0 ? large * sqrt(1.0 + (small / large) * (small / large)) : large;
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

/* Projection of tau (m, k), its derivative (m, k, k) and the states (m,) by Signorini's and Coulomb's law, k = 2 or 3; any of
   the three, and `absent`, may be NULL; with `constant` all of `petcontact_linearise` besides. */
void petcontact_coulomb(int64_t m, int64_t k, const double *tau, const double *coefficient, const double *bound,
                        const uint8_t *unilateral, const uint8_t *absent, double *projection, double *derivative,
                        int8_t *states, double *constant, uint8_t *active, uint8_t *stick)
{
    int64_t t = k - 1;
    const double *from = tau, *onto = projection, *slopes = derivative;
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
    if (constant)
        petcontact_linearise(m, k, from, onto, slopes, constant, active, stick);
}

/* sigma + projection of rho v - sigma (m, k) by the same law, rho (k,). */
void petcontact_coulomb_residual(int64_t m, int64_t k, const double *v, const double *sigma, const double *rho,
                                 const double *coefficient, const double *bound, const uint8_t *unilateral,
                                 const uint8_t *absent, double *residual)
{
    for (int64_t i = 0; i < m; i++, v += k, sigma += k, residual += k) {
        double tau[3];
        for (int64_t a = 0; a < k; a++)
            tau[a] = rho[a] * v[a] - sigma[a];
        petcontact_coulomb(1, k, tau, coefficient + i, bound + i, unilateral + i, absent ? absent + i : NULL, residual, NULL,
                           NULL, NULL, NULL, NULL);
        for (int64_t a = 0; a < k; a++)
            residual[a] += sigma[a];
    }
}

static double largest_of(int64_t n, const double *x, const uint8_t *left_out)
{
    double largest = 0.0;
    for (int64_t i = 0; i < n; i++) {
        double size = left_out && left_out[i] ? 0.0 : fabs(x[i]);
        largest = size > largest || isnan(size) ? size : largest;
    }
    return largest;
}

/* tau = rho v - sigma and rho (m, k) after a step, t components of a node being tangential: `next_tau` in `active_set.pivots`. */
void petcontact_next_tau(int64_t m, int64_t k, int64_t t, const double *sigma, const double *v, const uint8_t *stick,
                         const double *guess, double noise, double least, double pull, double *tau, double *rho)
{
    double size = largest_of(m * k, sigma, NULL), moved = largest_of(m * k, v, stick);
    size = least > size ? least : size;
    double ratio = (size != 0.0 ? size : 1.0) / (moved != 0.0 ? moved : 1.0);
    for (int64_t i = 0; i < m; i++) {
        double slid[2] = {0.0, 0.0};
        for (int64_t a = 0; a < t; a++)
            slid[a] = stick[k * i + a] ? 0.0 : v[k * i + a];
        double push = length_of(sigma + k * i, t), way = length_of(slid, t);
        double own = way > 0.0 && push > 0.0 ? pull * push / way : ratio;
        own = own < 1e-9 * ratio ? 1e-9 * ratio : own > 1e9 * ratio ? 1e9 * ratio : own;
        for (int64_t a = 0; a < k; a++) {
            int64_t j = k * i + a;
            rho[j] = a < t ? own : ratio;
            tau[j] = (stick[j] ? 0.0 : rho[j] * v[j]) - sigma[j];
        }
    }
    double largest = largest_of(m * k, tau, NULL), guessed = largest_of(m * k, guess, NULL);
    double share = guessed > largest ? largest / guessed : 1.0;
    for (int64_t j = 0; j < m * k; j++)
        tau[j] += noise * (share * guess[j] - tau[j]);
}

/* sigma = derivative y + constant (m, k) of active y: `so_far` where nodes stick and -tau elsewhere, and the slack
   (y - sigma)/rho. Without constant, slack and `stick` the product with `so_far`. */
void petcontact_first_traction(int64_t m, int64_t k, const double *derivative, const double *constant, const double *tau,
                               const double *rho, const uint8_t *active, const uint8_t *stick, const double *so_far,
                               double *sigma, double *slack)
{
    for (int64_t j = 0; j < m * k; j++) {
        int64_t first = j - j % k;
        double total = constant ? constant[j] : 0.0;
        for (int64_t b = 0; b < k; b++) {
            int64_t other = first + b;
            if (active[other])
                total += derivative[k * j + b] * (!stick || stick[other] ? so_far[other] : -tau[other]);
        }
        sigma[j] = total;
        if (slack)
            slack[j] = stick[j] ? 0.0 : (-tau[j] - total) / rho[j];
    }
}

/* The block (q, q) of (I - derivative)/rho + S derivative on q components, it and S (n, n) by columns; `mixed` has room for q
   numbers. */
void petcontact_active_block(int64_t n, int64_t k, const double *s, const double *derivative, const double *rho,
                             const int64_t *active, int64_t q, int64_t *mixed, int64_t rows, double *block)
{
    int64_t count = 0;
    for (int64_t c = 0; c < q; c++) {
        int64_t own = active[c] % k, first = active[c] - own, differs = 0;
        for (int64_t b = 0; b < k; b++)
            differs |= derivative[k * (first + b) + own] != (b == own);
        if (differs)
            mixed[count++] = c;
    }
    for (int64_t c = 0; c < q; c++)
        for (int64_t r = 0; r < q; r++)
            block[rows * c + r] = s[n * active[c] + active[r]];
    for (int64_t i = 0; i < count; i++) {
        int64_t column = active[mixed[i]], first = column - column % k;
        for (int64_t r = 0; r < q; r++) {
            double total = 0.0;
            for (int64_t b = 0; b < k; b++)
                total += s[n * (first + b) + active[r]] * derivative[k * first + k * b + column - first];
            if (active[r] >= first && active[r] < first + k)
                total += ((column == active[r]) - derivative[k * active[r] + column - first]) / rho[active[r]];
            block[rows * mixed[i] + r] = total;
        }
    }
}

/* Weighted Euclidean norms (k,) of the components of each of some arrays (m, k); nothing overflows or underflows on the way. */
void petcontact_norms(int64_t m, int64_t k, int64_t count, const double *weight, const double *const *arrays, double *norms)
{
    for (; count--; arrays++)
        for (int64_t a = 0; a < k; a++) {
            const double *x = *arrays + a;
            double total = 0.0, size = 0.0;
            for (int64_t i = 0; i < m; i++)
                total += weight[i] * x[k * i] * x[k * i];
            if (!(total > 1e-100 && total < 1e100)) {
                for (int64_t i = 0; i < m; i++)
                    size = fabs(x[k * i]) > size ? fabs(x[k * i]) : size;
                if (size > 0.0 && isfinite(size)) {
                    total = 0.0;
                    for (int64_t i = 0; i < m; i++)
                        total += weight[i] * (x[k * i] / size) * (x[k * i] / size);
                    total = sqrt(total) * size;
                    *norms++ = total;
                    continue;
                }
            }
            *norms++ = sqrt(total);
        }
}
