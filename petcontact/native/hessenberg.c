/* Equations with I + rho H, H of Hessenberg's form, for one rho after another: petcontact.linalg.hessenberg in C. */

#include "elementary.h"

/* (I + rho H) x = b in O(n^2) operations, b overwritten by x. Column j of H begins at columns[j n], zero below row j + 1.
   Columns are combined from the last one on (RQ by Gauss's transformations with pivoting, after Henry 1994), so that the
   matrix is read once and n numbers are kept of it; `work` has room for 3 n. */
DISPATCHED void petcontact_hessenberg_solve(const double *columns, int64_t n, double rho, double *b, double *work)
{
    double *carried = work, *factor = work + n, *swapped = work + 2 * n;
    for (int64_t i = 0; i < n; i++)
        carried[i] = rho * columns[(n - 1) * n + i];
    carried[n - 1] += 1.0;
    for (int64_t k = n - 1; k > 0; k--) {
        const double *column = columns + (k - 1) * n;
        double below = rho * column[k];
        swapped[k] = fabs(carried[k]) < fabs(below);
        if (swapped[k] != 0.0) {
            double f = carried[k] / below, x = b[k] / below;
            for (int64_t i = 0; i < k; i++) {
                double other = rho * column[i];
                b[i] -= x * other;
                carried[i] -= f * other;
            }
            b[k - 1] -= x;
            carried[k - 1] -= f;
            factor[k] = f, b[k] = x;
        } else {
            double f = below / carried[k], x = b[k] / carried[k];
            for (int64_t i = 0; i < k; i++) {
                b[i] -= x * carried[i];
                carried[i] = rho * column[i] - f * carried[i];
            }
            carried[k - 1] += 1.0;
            factor[k] = f, b[k] = x;
        }
    }
    double coefficient = b[0] / carried[0];
    for (int64_t k = 1; k < n; k++) {
        double x = b[k] - factor[k] * coefficient;
        b[k - 1] = swapped[k] != 0.0 ? x : coefficient;
        coefficient = swapped[k] != 0.0 ? coefficient : x;
    }
    b[n - 1] = coefficient;
}
