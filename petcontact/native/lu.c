/* LU with partial pivoting, and forward substitution, by panels: petcontact.linalg.elimination in C. Unlike LAPACK's they
   take the inverse of the small triangle of each panel: OpenBLAS solves with few rows at a tenth of the speed of its products. */

#include "elementary.h"

enum { PANEL = 64 };

/* LAPACK's dgetrf and the BLAS' dgemm. */
typedef void Factor(const int *m, const int *n, double *a, const int *lda, int *pivots, int *info);
typedef void Product(const char *, const char *, const int *m, const int *n, const int *k, const double *alpha,
                     const double *a, const int *lda, const double *b, const int *ldb, const double *beta, double *c,
                     const int *ldc);

/* Of the unit lower triangle of a panel of k columns. */
INLINE void inverted(const double *panel, int64_t n, int64_t k, double *inverse)
{
    memset(inverse, 0, (size_t)(k * k) * sizeof(double));
    for (int64_t j = 0; j < k; j++) {
        double *column = inverse + j * k;
        column[j] = 1.0;
        for (int64_t p = j; p < k; p++)
            for (int64_t i = p + 1; i < k; i++)
                column[i] -= panel[p * n + i] * column[p];
    }
}

INLINE void swapped(double *column, const int *pivots, int64_t k)
{
    for (int64_t i = 0; i < k; i++) {
        double x = column[i];
        column[i] = column[pivots[i] - 1];
        column[pivots[i] - 1] = x;
    }
}

/* What a panel at its first row does to `count` columns beside it; `work` has room for k of their rows. */
INLINE void updated(const double *panel, const double *inverse, const int *pivots, int n, int rows, int k, double *columns,
                    int count, double *work, Product *product)
{
    const double one = 1.0, minus = -1.0, zero = 0.0;
    int below = rows - k;
    for (int64_t c = 0; c < count; c++) {
        swapped(columns + c * n, pivots, k);
        memcpy(work + c * k, columns + c * n, (size_t)k * sizeof(double));
    }
    product("N", "N", &k, &count, &k, &one, inverse, &k, work, &k, &zero, columns, &n);
    if (below > 0)
        product("N", "N", &below, &count, &k, &minus, panel + k, &n, columns, &n, &one, columns + k, &n);
}

/* P A = L U in place of A (n, n), L^-1 P B in place of B (n, width), both by columns; `pivots` as LAPACK has them; the first
   zero pivot, from 1 on, or 0. `work` has room for 64 (64 + n + width). */
DISPATCHED void petcontact_lu(double *a, double *b, int64_t size, int64_t width, int *pivots, int64_t *zero_pivot,
                              double *work, void *factor, void *product)
{
    int n = (int)size;
    double *inverse = work, *copy = work + PANEL * PANEL;
    *zero_pivot = 0;
    for (int j = 0; j < n; j += PANEL) {
        int k = n - j < PANEL ? n - j : PANEL, rows = n - j, right = rows - k, info = 0;
        double *panel = a + (int64_t)j * n + j;
        ((Factor *)factor)(&rows, &k, panel, &n, pivots + j, &info);
        if (info > 0 && *zero_pivot == 0)
            *zero_pivot = j + info;
        inverted(panel, n, k, inverse);
        for (int64_t c = 0; c < j; c++)
            swapped(a + c * n + j, pivots + j, k);
        if (right > 0)
            updated(panel, inverse, pivots + j, n, rows, k, panel + (int64_t)k * n, right, copy, (Product *)product);
        if (width > 0)
            updated(panel, inverse, pivots + j, n, rows, k, b + j, (int)width, copy, (Product *)product);
        for (int i = 0; i < k; i++)
            pivots[j + i] += j;
    }
}
