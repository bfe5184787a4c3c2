/* LU with partial pivoting and both substitutions by panels: petcontact.linalg.blocked_lu in C. Unlike LAPACK's they take the
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

/* What the panels of a block, whose columns begin lda apart, do to `count` columns beside it that begin ld apart; `work` has room
   for 32 of their rows. */
INLINE void updated(const double *block, int lda, const double *inverses, const int *pivots, int rows, int wide, double *columns,
                    int ld, int count, double *work, Product *product)
{
    const double one = 1.0, minus = -1.0, zero = 0.0;
    int below = rows - wide;
    swapped(columns, ld, count, pivots, wide);
    for (int j = 0; j < wide; j += PANEL) {
        int k = wide - j < PANEL ? wide - j : PANEL;
        if (j > 0)
            product("N", "N", &k, &count, &j, &minus, block + j, &lda, columns, &ld, &one, columns + j, &ld);
        for (int64_t c = 0; c < count; c++)
            memcpy(work + c * k, columns + c * ld + j, (size_t)k * sizeof(double));
        product("N", "N", &k, &count, &k, &one, inverses + j * PANEL, &k, work, &k, &zero, columns + j, &ld);
    }
    if (below > 0)
        product("N", "N", &below, &count, &wide, &minus, block + wide, &lda, columns, &ld, &one, columns + wide, &ld);
}

/* P_1 L_1 U of a block of at most 128 columns, in its place, that begin lda apart and have `rows` rows. `pivots` are the swaps,
   counted from 1 on in each panel of 32 columns; `inverses` (32 for each column) those of the triangles of panels; `zero_pivot`
   the first one, from 1 on, or 0. `work` has room for 32 * 128 numbers. */
DISPATCHED void petcontact_lu_block(double *block, int64_t lda, int64_t rows, int64_t wide, int *pivots, double *inverses,
                                    int64_t *zero_pivot, double *work, void *factor, void *product)
{
    int n = (int)lda;
    *zero_pivot = 0;
    for (int j = 0; j < wide; j += PANEL) {
        int k = wide - j < PANEL ? (int)wide - j : PANEL, high = (int)rows - j, beside = (int)wide - j - k, info = 0;
        double *panel = block + (int64_t)j * n + j;
        ((Factor *)factor)(&high, &k, panel, &n, pivots + j, &info);
        swapped(block + j, n, j, pivots + j, k);
        if (info > 0 && *zero_pivot == 0)
            *zero_pivot = j + info;
        inverted(panel, n, k, inverses + j * PANEL);
        if (beside > 0)
            updated(panel, n, inverses + j * PANEL, pivots + j, high, k, panel + (int64_t)k * n, n, beside, work,
                    (Product *)product);
    }
}

/* L_1^-1 P_1 of `count` columns that begin ld apart, from the block's first row on, in their place. `work` has room for 32 of
   their rows. */
DISPATCHED void petcontact_lu_update(const double *block, int64_t lda, const double *inverses, const int *pivots, int64_t rows,
                                     int64_t wide, double *columns, int64_t ld, int64_t count, double *work, void *product)
{
    updated(block, (int)lda, inverses, pivots, (int)rows, (int)wide, columns, (int)ld, (int)count, work, (Product *)product);
}

/* What the last `wide` columns of U, which begin `ldu` apart, do to `width` columns of `size` numbers that begin `ldb` apart, in
   their place: with all columns of U it is U^-1. `work` has room for 32 (32 + width). */
DISPATCHED void petcontact_back(const double *u, int64_t ldu, int64_t size, int64_t wide, double *b, int64_t ldb, int64_t width,
                                double *work, void *product)
{
    const double one = 1.0, minus = -1.0, zero = 0.0;
    const int lda = (int)ldu, step = (int)ldb, count = (int)width, first = (int)(size - wide);
    double *inverse = work, *copy = work + PANEL * PANEL;
    for (int j = first + ((int)wide - 1) / PANEL * PANEL; j >= first && width > 0; j -= PANEL) {
        int k = (int)size - j < PANEL ? (int)size - j : PANEL;
        const double *panel = u + (int64_t)(j - first) * ldu;
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
