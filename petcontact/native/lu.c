/* LU with partial pivoting and both substitutions by panels: petcontact.linalg.elimination in C. Unlike LAPACK's they take the
   inverses of the small triangles of panels: OpenBLAS solves with few rows at a tenth of the speed of its products. */

#include "elementary.h"

enum { PANEL = 32, BLOCK = 128 };

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

/* Of `wide` columns, the swaps of each panel after those before it, in `count` columns that begin n apart. */
INLINE void swapped(double *columns, int64_t n, int64_t count, const int *pivots, int64_t wide)
{
    for (int64_t c = 0; c < count; c++) {
        for (int64_t i = 0; i < wide; i++) {
            // of the next column, whose rows are not read in order
            __builtin_prefetch(columns + (c + 1) * n + i / PANEL * PANEL + pivots[i] - 1, 1);
            double *from = columns + c * n + i / PANEL * PANEL + pivots[i] - 1, x = *from;
            *from = columns[c * n + i];
            columns[c * n + i] = x;
        }
    }
}

/* What the panels of a block at its first row do to `count` columns beside it; `work` has room for 32 of their rows. */
INLINE void updated(const double *block, const double *inverses, const int *pivots, int n, int rows, int wide, double *columns,
                    int count, double *work, Product *product)
{
    const double one = 1.0, minus = -1.0, zero = 0.0;
    int below = rows - wide;
    swapped(columns, n, count, pivots, wide);
    for (int j = 0; j < wide; j += PANEL) {
        int k = wide - j < PANEL ? wide - j : PANEL;
        if (j > 0)
            product("N", "N", &k, &count, &j, &minus, block + j, &n, columns, &n, &one, columns + j, &n);
        for (int64_t c = 0; c < count; c++)
            memcpy(work + c * k, columns + c * n + j, (size_t)k * sizeof(double));
        product("N", "N", &k, &count, &k, &one, inverses + j * PANEL, &k, work, &k, &zero, columns + j, &n);
    }
    if (below > 0)
        product("N", "N", &below, &count, &wide, &minus, block + wide, &n, columns, &n, &one, columns + wide, &n);
}

/* A = P_1 L_1 P_2 L_2 ... U in place of A (n, n), and of B (n, width), both by columns, what A^-1 B is before the solution with
   U; without `factor` A is factored already. L_1 are the first 128 columns of L, P_1 their swaps: `pivots`, counted from 1 on in
   each panel of 32 columns, which are never applied to blocks further left. `zero_pivot`: the first one, from 1 on, or 0. `work`
   has room for 32 (128 + n + width). */
DISPATCHED void petcontact_lu(double *a, double *b, int64_t size, int64_t width, int *pivots, int64_t *zero_pivot,
                              double *work, void *factor, void *product)
{
    int n = (int)size;
    double *inverses = work, *copy = work + BLOCK * PANEL;
    *zero_pivot = 0;
    for (int first = 0; first < n; first += BLOCK) {
        int wide = n - first < BLOCK ? n - first : BLOCK, rows = n - first, right = rows - wide;
        double *block = a + (int64_t)first * n + first;
        for (int j = 0; j < wide; j += PANEL) {
            int k = wide - j < PANEL ? wide - j : PANEL, high = rows - j, beside = wide - j - k, info = 0;
            double *panel = block + (int64_t)j * n + j;
            if (factor) {
                ((Factor *)factor)(&high, &k, panel, &n, pivots + first + j, &info);
                swapped(block + j, n, j, pivots + first + j, k);
            }
            if (info > 0 && *zero_pivot == 0)
                *zero_pivot = first + j + info;
            inverted(panel, n, k, inverses + j * PANEL);
            if (factor && beside > 0)
                updated(panel, inverses + j * PANEL, pivots + first + j, n, high, k, panel + (int64_t)k * n, beside, copy,
                        (Product *)product);
        }
        if (factor && right > 0)
            updated(block, inverses, pivots + first, n, rows, wide, block + (int64_t)wide * n, right, copy, (Product *)product);
        if (width > 0)
            updated(block, inverses, pivots + first, n, rows, wide, b + first, (int)width, copy, (Product *)product);
    }
}

/* U^-1 B in place of B, `width` columns of `size` numbers that begin `ldb` apart; those of U begin `ldu` apart. `work` has room
   for 32 (32 + width). */
DISPATCHED void petcontact_back(const double *u, int64_t ldu, int64_t size, double *b, int64_t ldb, int64_t width,
                                double *work, void *product)
{
    const double one = 1.0, minus = -1.0, zero = 0.0;
    const int lda = (int)ldu, step = (int)ldb, count = (int)width;
    double *inverse = work, *copy = work + PANEL * PANEL;
    for (int j = ((int)size - 1) / PANEL * PANEL; j >= 0 && width > 0; j -= PANEL) {
        int k = (int)size - j < PANEL ? (int)size - j : PANEL;
        const double *panel = u + (int64_t)j * ldu;
        memset(inverse, 0, (size_t)(k * k) * sizeof(double));
        for (int c = 0; c < k; c++) {
            double *column = inverse + c * k;
            column[c] = 1.0;
            for (int p = c; p >= 0; p--) {
                const double *other = panel + (int64_t)p * ldu + j;
                column[p] /= other[p];
                for (int i = 0; i < p; i++)
                    column[i] -= other[i] * column[p];
            }
        }
        for (int c = 0; c < count; c++)
            memcpy(copy + (int64_t)c * k, b + c * ldb + j, (size_t)k * sizeof(double));
        ((Product *)product)("N", "N", &k, &count, &k, &one, inverse, &k, copy, &k, &zero, b + j, &step);
        if (j > 0)
            ((Product *)product)("N", "N", &j, &count, &k, &minus, panel, &lda, b + j, &step, &one, b, &step);
    }
}
