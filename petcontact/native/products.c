/* Products of many small dense blocks with one vector: petcontact.compression.hodlr.block_batches in C. Sums run over eight
   interleaved partial sums, whatever the width of the processor's vectors. */

#include "elementary.h"

/* One stack: `count` blocks of p rows and q columns, with the places of their rows and columns. */
typedef struct {
    int64_t count, p, q;
    const double *values;
    const int64_t *rows, *columns;
} Stack;

INLINE Stack stack_of(const int64_t *entry)
{
    Stack s = {entry[0],
               entry[1],
               entry[2],
               (const double *)(intptr_t)entry[3],
               (const int64_t *)(intptr_t)entry[4],
               (const int64_t *)(intptr_t)entry[5]};
    return s;
}

/* Scalar products of `count` rows of q numbers with x. */
INLINE void rows_times(int count, const double *rows, int64_t q, const double *x, double *result)
{
    Quad sums[4][2] = {{{0.0}}};
    int64_t whole = q - q % 8;
    for (int64_t j = 0; j < whole; j += 8)
        for (int r = 0; r < count; r++)
            add_products(rows + r * q + j, x + j, sums[r]);
    for (int r = 0; r < count; r++) {
        result[r] = total(sums[r]);
        for (int64_t j = whole; j < q; j++)
            result[r] += rows[r * q + j] * x[j];
    }
}

/* y[rows] += sign · block x[columns] for every block of some stacks. `entries` holds six numbers a stack (see Stack);
   `work` has room for the columns of a block. */
DISPATCHED void petcontact_multiply(int64_t stacks, const int64_t *entries, const double *x, double *y, double sign,
                                    double *work)
{
    for (int64_t i = 0; i < stacks; i++) {
        Stack s = stack_of(entries + 6 * i);
        for (int64_t b = 0; b < s.count; b++) {
            const int64_t *rows = s.rows + b * s.p, *columns = s.columns + b * s.q;
            const double *block = s.values + b * s.p * s.q;
            double result[4];
            int64_t r = 0;
            for (int64_t j = 0; j < s.q; j++)
                work[j] = x[columns[j]];
            for (; r + 4 <= s.p; r += 4) {
                rows_times(4, block + r * s.q, s.q, work, result);
                for (int k = 0; k < 4; k++)
                    y[rows[r + k]] += sign * result[k];
            }
            for (; r < s.p; r++) {
                rows_times(1, block + r * s.q, s.q, work, result);
                y[rows[r]] += sign * result[0];
            }
        }
    }
}
