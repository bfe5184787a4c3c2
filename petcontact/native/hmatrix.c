/* Blocks of hierarchical matrices: adaptive cross approximation, recompression and products; petcontact.compression.hmatrix
   in C, see there. Entries come from a function of the caller, d rows a node, d columns a node and, beside these, some further
   columns. Numbers are kept in single or in double precision; all sums are in double. */

#include "elementary.h"

/* system (k, d, m, d) by column node, direction, row node, component; beside (columns beside, m, d); either may be null. */
typedef void (*Filler)(const void *context, int64_t m, const int64_t *rows, int64_t k, const int64_t *columns,
                       double *system, double *beside);

enum { CHECKS = 4, CHECKS_OF_KNOWN = 8 }; /* nodes whose rows have to be right in the end */

typedef struct {
    Filler fill;
    const void *context;
    int64_t d;
    const int64_t *nodes, *beside; /* 0, 1, 2 ...; first column beside of each node */
    double tolerance;
} Operator;

typedef struct {
    int64_t row, column, m, n, rows, in,
        columns;         /* first nodes, their numbers; scalar rows, columns of nodes, all columns */
    const double *dense; /* all entries, column after column, or null */
} Block;

typedef struct {                            /* scratch memory for one block */
    double *dense;                          /* all its entries, where it is known whole */
    double *u, *v;                          /* `most` crosses, rows and columns */
    double *gram_u, *gram_v, *core, *basis; /* most² */
    double *values;                         /* most */
    double *row, *fetched;                  /* d rows, or a column; d rows of a node, or the columns of one */
    char *used_rows, *used_columns;
    int64_t most;
} Work;

typedef struct { /* what is built: numbers, room for them, and a rank for each block */
    int64_t single;
    void *values;
    int64_t capacity, *ranks;
} Store;

INLINE void fill_block(const Operator *a, int64_t m, const int64_t *rows, int64_t k, const int64_t *columns, double *out)
{
    a->fill(a->context, m, rows, k, columns, out, out + k * a->d * m * a->d);
}

typedef double Lanes __attribute__((vector_size(8 * sizeof(double)), aligned(sizeof(double)), may_alias));
typedef float Singles __attribute__((vector_size(8 * sizeof(float)), aligned(sizeof(float)), may_alias));

INLINE double total(Lanes lane)
{
    return ((lane[0] + lane[4]) + (lane[2] + lane[6])) + ((lane[1] + lane[5]) + (lane[3] + lane[7]));
}

INLINE double dot(const double *x, const double *y, int64_t n)
{
    Lanes lane = {0.0};
    int64_t j = 0;
    for (; j + 8 <= n; j += 8)
        lane += *(const Lanes *)(x + j) * *(const Lanes *)(y + j);
    double sum = total(lane);
    for (; j < n; j++)
        sum += x[j] * y[j];
    return sum;
}

/* y -= Σ factor[l] rows[l], four rows at a time. */
INLINE void subtract_rows(int64_t k, const double *factor, int64_t stride, const double *rows, int64_t n, double *y)
{
    int64_t l = 0;
    for (; l + 4 <= k; l += 4) {
        const double f0 = factor[l * stride], f1 = factor[(l + 1) * stride], f2 = factor[(l + 2) * stride],
                     f3 = factor[(l + 3) * stride];
        const double *r0 = rows + l * n, *r1 = r0 + n, *r2 = r1 + n, *r3 = r2 + n;
        for (int64_t j = 0; j < n; j++)
            y[j] -= (f0 * r0[j] + f1 * r1[j]) + (f2 * r2[j] + f3 * r3[j]);
    }
    for (; l < k; l++) {
        const double f = factor[l * stride], *r = rows + l * n;
        for (int64_t j = 0; j < n; j++)
            y[j] -= f * r[j];
    }
}

/* The d rows of one node, into w->row. */
INLINE void fetch_rows(const Operator *a, const Block *b, const Work *w, int64_t node)
{
    const int64_t d = a->d;
    if (b->dense) {
        for (int64_t j = 0; j < b->columns; j++)
            for (int64_t c = 0; c < d; c++)
                w->row[c * b->columns + j] = b->dense[j * b->rows + d * node + c];
    } else {
        fill_block(a, 1, a->nodes + b->row + node, b->n, a->nodes + b->column, w->fetched);
        for (int64_t j = 0; j < b->columns; j++)
            for (int64_t c = 0; c < d; c++)
                w->row[c * b->columns + j] = w->fetched[j * d + c];
    }
}

/* ... less what crosses `from` to `k` know of them. */
INLINE void reduce_rows(const Operator *a, const Block *b, const Work *w, int64_t from, int64_t k, int64_t node)
{
    for (int64_t c = 0; c < a->d; c++)
        subtract_rows(k - from, w->u + from * b->rows + a->d * node + c, b->rows, w->v + from * b->columns, b->columns,
                      w->row + c * b->columns);
}

/* One column less what k crosses know of it. */
INLINE void residual_column(const Operator *a, const Block *b, const Work *w, int64_t k, int64_t column, double *u)
{
    const int64_t d = a->d;
    const double *from;
    if (b->dense)
        from = b->dense + column * b->rows;
    else if (column < b->in) {
        a->fill(a->context, b->m, a->nodes + b->row, 1, a->nodes + b->column + column / d, w->fetched, 0);
        from = w->fetched + (column % d) * b->rows;
    } else {
        int64_t node = b->column, one = a->beside[b->column] + column - b->in;
        while (a->beside[node + 1] <= one)
            node++;
        a->fill(a->context, b->m, a->nodes + b->row, 1, a->nodes + node, 0, w->fetched);
        from = w->fetched + (one - a->beside[node]) * b->rows;
    }
    memcpy(u, from, b->rows * sizeof(double));
    subtract_rows(k, w->v + column, b->columns, w->u, b->rows, u);
}

INLINE uint64_t random_after(uint64_t *state)
{
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    return *state;
}

INLINE int64_t largest(const double *x, const char *used, int64_t n)
{
    int64_t best = -1;
    double most = 0.0;
    for (int64_t j = 0; j < n; j++)
        if (!used[j] && fabs(x[j]) > most) {
            most = fabs(x[j]);
            best = j;
        }
    return best;
}

/* Crosses u vᵀ, partially pivoted, until one is small and the rows of some random nodes are right (of all nodes where the
   block is known whole); returns their number, or -1 where w->most of them do not do. The Gram matrices of u and of v, which
   the norm takes, stay in w. */
INLINE int64_t crosses(const Operator *a, const Block *b, const Work *w)
{
    const int64_t d = a->d, most = w->most;
    const double square = a->tolerance * a->tolerance;
    uint64_t state = 88172645463325252u ^ (uint64_t)(b->row * 2654435761 + b->column * 40503 + 1);
    int64_t k = 0, passed = 0, node = -1, reduced = 0, next = d * (b->m / 2), checks = b->dense ? CHECKS_OF_KNOWN : CHECKS;
    int checking = 0;
    double norm = 0.0;
    memset(w->used_rows, 0, b->rows);
    memset(w->used_columns, 0, b->columns);
    for (;;) {
        int64_t column = -1, row = -1;
        if (!checking) {
            row = next;
        } else
            row = d * (int64_t)(random_after(&state) % (uint64_t)b->m);
        if (row / d != node) {
            node = row / d;
            reduced = 0;
            fetch_rows(a, b, w, node);
        }
        reduce_rows(a, b, w, reduced, k, node);
        reduced = k;
        if (checking) {
            double worst = 0.0;
            row = -1;
            for (int64_t c = 0; c < d; c++) {
                const double *r = w->row + c * b->columns, size = dot(r, r, b->columns);
                if (size > worst) {
                    worst = size;
                    row = d * node + c;
                }
            }
            if (row < 0 || w->used_rows[row] || worst * (double)b->rows <= square * norm) {
                if (++passed == checks)
                    return k;
                continue;
            }
        }
        w->used_rows[row] = 1;
        column = largest(w->row + (row % d) * b->columns, w->used_columns, b->columns);
        if (column < 0) { /* a row that is known already */
            checking = 1;
            continue;
        }
        if (k == most)
            return -1;
        passed = 0;
        double *u = w->u + k * b->rows, *v = w->v + k * b->columns;
        const double *r = w->row + (row % d) * b->columns, over = 1.0 / r[column];
        for (int64_t j = 0; j < b->columns; j++)
            v[j] = over * r[j];
        w->used_columns[column] = 1;
        residual_column(a, b, w, k, column, u);
        double cross = 0.0;
        for (int64_t l = 0; l <= k; l++) {
            double uu = dot(u, w->u + l * b->rows, b->rows), vv = dot(v, w->v + l * b->columns, b->columns);
            w->gram_u[l * most + k] = w->gram_u[k * most + l] = uu;
            w->gram_v[l * most + k] = w->gram_v[k * most + l] = vv;
            cross += (l < k ? 2.0 : 1.0) * uu * vv;
        }
        const double size = w->gram_u[k * most + k] * w->gram_v[k * most + k];
        norm = norm + cross > size ? norm + cross : size;
        k++;
        next = largest(u, w->used_rows, b->rows);
        checking = size <= square * norm || next < 0;
    }
}

/* Eigenvalues (on the diagonal) and eigenvectors (rows of y) of a symmetric matrix with rows of `stride`, by Jacobi, up to
   entries that are `small` beside the whole: those between eigenvalues that are both as small stay as they are. */
INLINE void eigenvectors(int64_t k, int64_t stride, double small, double *s, double *y)
{
    for (int64_t i = 0; i < k; i++) {
        memset(y + i * stride, 0, k * sizeof(double));
        y[i * stride + i] = 1.0;
    }
    for (int sweep = 0; sweep < 30; sweep++) {
        double off = 0.0, on = 0.0;
        for (int64_t i = 0; i < k; i++) {
            on += s[i * stride + i] * s[i * stride + i];
            for (int64_t j = i + 1; j < k; j++)
                off += s[i * stride + j] * s[i * stride + j];
        }
        const double limit = small * small * (on + 2.0 * off);
        if (off <= limit)
            return;
        for (int64_t p = 0; p < k; p++)
            for (int64_t q = p + 1; q < k; q++) {
                const double pq = s[p * stride + q];
                if (pq * pq * (double)(k * k) <= limit)
                    continue;
                const double theta = 0.5 * (s[q * stride + q] - s[p * stride + p]) / pq;
                const double t = (theta < 0.0 ? -1.0 : 1.0) / (fabs(theta) + sqrt(theta * theta + 1.0));
                const double c = 1.0 / sqrt(t * t + 1.0), n = t * c;
                double *sp = s + p * stride, *sq = s + q * stride, *yp = y + p * stride, *yq = y + q * stride;
                for (int64_t j = 0; j < k; j++) {
                    const double one = sp[j], other = sq[j], first = yp[j], second = yq[j];
                    sp[j] = c * one - n * other;
                    sq[j] = n * one + c * other;
                    yp[j] = c * first - n * second;
                    yq[j] = n * first + c * second;
                }
                for (int64_t i = 0; i < k; i++) {
                    const double one = s[i * stride + p], other = s[i * stride + q];
                    s[i * stride + p] = c * one - n * other;
                    s[i * stride + q] = n * one + c * other;
                }
            }
    }
}

/* With V Vᵀ = L Lᵀ and Lᵀ U Uᵀ L = Yᵀ S² Y the singular values of Uᵀ V are S; of the k crosses those combinations stay that
   hold the tolerance: rows (Y Lᵀ) U and the orthonormal rows (Y L⁻¹) V. Returns their number; the coefficients are left in
   gram_u (left) and gram_v (right), a row each. V, whose pivots are 1, is well conditioned. */
INLINE int64_t recompress(const Work *w, int64_t k, double tolerance)
{
    const int64_t p = w->most;
    double *l = w->gram_v, *s = w->core, *y = w->basis, *values = w->values;
    for (int64_t j = 0; j < k; j++)
        for (int64_t i = j; i < k; i++) {
            double sum = l[i * p + j];
            for (int64_t q = 0; q < j; q++)
                sum -= l[i * p + q] * l[j * p + q];
            l[i * p + j] = i == j ? sqrt(sum > 0.0 ? sum : 1e-300) : sum / l[j * p + j];
        }
    /* y = (U Uᵀ) L for the moment, s = Lᵀ y */
    for (int64_t i = 0; i < k; i++)
        for (int64_t j = 0; j < k; j++) {
            double sum = 0.0;
            for (int64_t q = j; q < k; q++)
                sum += w->gram_u[i * p + q] * l[q * p + j];
            y[i * p + j] = sum;
        }
    for (int64_t i = 0; i < k; i++)
        for (int64_t j = 0; j < k; j++) {
            double sum = 0.0;
            for (int64_t q = i; q < k; q++)
                sum += l[q * p + i] * y[q * p + j];
            s[i * p + j] = sum;
        }
    for (int64_t i = 0; i < k; i++)
        for (int64_t j = 0; j < i; j++)
            s[i * p + j] = s[j * p + i] = 0.5 * (s[i * p + j] + s[j * p + i]);
    eigenvectors(k, p, 0.01 * tolerance * tolerance, s, y);
    double all = 0.0, left = 0.0;
    for (int64_t i = 0; i < k; i++)
        all += s[i * p + i] > 0.0 ? s[i * p + i] : 0.0;
    /* from the largest down: a selection by repeated search is nothing beside the rest */
    int64_t rank = 0;
    for (int64_t i = 0; i < k; i++)
        values[i] = s[i * p + i];
    left = all;
    while (rank < k && left > tolerance * tolerance * all) {
        int64_t best = 0;
        for (int64_t i = 1; i < k; i++)
            if (values[i] > values[best])
                best = i;
        if (values[best] <= 0.0)
            break;
        left -= values[best];
        values[best] = -1.0;
        double *right = w->gram_u + rank * p; /* later: left and right change places */
        memcpy(right, y + best * p, k * sizeof(double));
        rank++;
    }
    /* rows of y now: left coefficients Y Lᵀ in s, right ones Y L⁻¹ in place */
    for (int64_t r = 0; r < rank; r++) {
        double *one = w->gram_u + r * p, *with = s + r * p;
        for (int64_t i = 0; i < k; i++) {
            double sum = 0.0;
            for (int64_t q = 0; q <= i; q++)
                sum += one[q] * l[i * p + q];
            with[i] = sum;
        }
        for (int64_t i = k - 1; i >= 0; i--) {
            double sum = one[i];
            for (int64_t q = i + 1; q < k; q++)
                sum -= one[q] * l[q * p + i];
            one[i] = sum / l[i * p + i];
        }
    }
    for (int64_t r = 0; r < rank; r++) {
        memcpy(w->gram_v + r * p, w->gram_u + r * p, k * sizeof(double));
        memcpy(w->gram_u + r * p, s + r * p, k * sizeof(double));
    }
    return rank;
}

/* rank combinations of k rows of n numbers into the store. */
INLINE void combine(int64_t rank, int64_t k, const double *coefficients, int64_t stride, const double *rows, int64_t n,
                    double *line, int single, void *out)
{
    for (int64_t r = 0; r < rank; r++) {
        memset(line, 0, n * sizeof(double));
        subtract_rows(k, coefficients + r * stride, 1, rows, n, line);
        if (single)
            for (int64_t j = 0; j < n; j++)
                ((float *)out)[r * n + j] = (float)-line[j];
        else
            for (int64_t j = 0; j < n; j++)
                ((double *)out)[r * n + j] = -line[j];
    }
}

INLINE void store(const double *values, int64_t n, int single, void *out)
{
    if (single)
        for (int64_t j = 0; j < n; j++)
            ((float *)out)[j] = (float)values[j];
    else
        memcpy(out, values, n * sizeof(double));
}

/* Builds blocks one after another until one may not fit any more; returns through `done` how many were built and the numbers
   used. A block is five numbers (first row node, their number, first column node, their number, kind: 0 dense, 1 of low
   rank); its result the rank, -1 where it is kept whole, or -2 where the crosses do not do and it has to be divided. Blocks
   of low rank are kept as rank rows of U and rank rows of V, whole ones column after column. Those of low rank with at most
   `whole` entries are known whole, too. */
DISPATCHED void petcontact_hmatrix_build(const Operator *a, const Work *w, int64_t whole, int64_t count,
                                         const int64_t *blocks, const Store *to, int64_t *done)
{
    const int64_t d = a->d, most = w->most, size = to->single ? sizeof(float) : sizeof(double);
    int64_t used = 0, i = 0;
    for (; i < count; i++) {
        const int64_t *g = blocks + 5 * i;
        Block b = {g[0], g[2], g[1], g[3], d * g[1], d * g[3], d * g[3] + a->beside[g[2] + g[3]] - a->beside[g[2]], 0};
        const int64_t both = b.rows + b.columns, all = b.rows * b.columns, limit = most * both < all ? most * both : all;
        char *out = (char *)to->values + used * size;
        if (used + (g[4] ? limit : all) > to->capacity)
            break;
        if (!g[4] || all <= whole) {
            fill_block(a, b.m, a->nodes + b.row, b.n, a->nodes + b.column, w->dense);
            b.dense = w->dense;
        }
        to->ranks[i] = -1;
        if (g[4]) {
            const int64_t k = crosses(a, &b, w);
            to->ranks[i] = b.dense ? -1 : -2;
            if (k >= 0) {
                const int64_t rank = recompress(w, k, a->tolerance);
                if (rank * both < all) {
                    to->ranks[i] = rank;
                    combine(rank, k, w->gram_u, most, w->u, b.rows, w->row, to->single, out);
                    combine(rank, k, w->gram_v, most, w->v, b.columns, w->row, to->single, out + rank * b.rows * size);
                    used += rank * both;
                }
            }
        }
        if (to->ranks[i] == -1) {
            store(b.dense, all, to->single, out);
            used += all;
        }
    }
    done[0] = i;
    done[1] = used;
}

INLINE Lanes widened(const float *x)
{
    return __builtin_convertvector(*(const Singles *)x, Lanes);
}

INLINE Lanes kept(const double *x)
{
    return *(const Lanes *)x;
}

/* Sums over eight interleaved partial sums, whatever the width of the processor's vectors. */
#define PRODUCTS(NAME, TYPE, LOAD)                                                                                          \
    INLINE double NAME##_dot(const TYPE *a, const double *x, int64_t n)                                                     \
    {                                                                                                                       \
        Lanes lane = {0.0}, other = {0.0};                                                                                  \
        int64_t j = 0;                                                                                                      \
        for (; j + 16 <= n; j += 16) {                                                                                      \
            lane += LOAD(a + j) * kept(x + j);                                                                              \
            other += LOAD(a + j + 8) * kept(x + j + 8);                                                                     \
        }                                                                                                                   \
        double sum = total(lane + other);                                                                                   \
        for (; j < n; j++)                                                                                                  \
            sum += a[j] * x[j];                                                                                             \
        return sum;                                                                                                         \
    }                                                                                                                       \
    /* y += Σ factor[l] a[l, :], four rows at a time */                                                                    \
    INLINE void NAME##_add(const TYPE *a, int64_t k, const double *factor, int64_t n, double *y)                            \
    {                                                                                                                       \
        int64_t l = 0;                                                                                                      \
        for (; l + 4 <= k; l += 4) {                                                                                        \
            const TYPE *a0 = a + l * n, *a1 = a0 + n, *a2 = a1 + n, *a3 = a2 + n;                                           \
            const double f0 = factor[l], f1 = factor[l + 1], f2 = factor[l + 2], f3 = factor[l + 3];                        \
            for (int64_t j = 0; j < n; j++)                                                                                 \
                y[j] += (f0 * a0[j] + f1 * a1[j]) + (f2 * a2[j] + f3 * a3[j]);                                              \
        }                                                                                                                   \
        for (; l < k; l++)                                                                                                  \
            for (int64_t j = 0; j < n; j++)                                                                                 \
                y[j] += factor[l] * a[l * n + j];                                                                           \
    }                                                                                                                       \
    INLINE void NAME##_block(const int64_t *g, const TYPE *a, const double *x, double *y, double *work)                     \
    {                                                                                                                       \
        const int64_t m = g[1], n = g[3], q = g[5], rank = g[6];                                                            \
        const double *x_n = x + g[2], *x_q = x + g[4];                                                                      \
        if (rank < 0) {                                                                                                     \
            NAME##_add(a, n, x_n, m, y + g[0]);                                                                             \
            NAME##_add(a + n * m, q, x_q, m, y + g[0]);                                                                     \
            return;                                                                                                         \
        }                                                                                                                   \
        const TYPE *v = a + rank * m;                                                                                       \
        for (int64_t l = 0; l < rank; l++)                                                                                  \
            work[l] = NAME##_dot(v + l * (n + q), x_n, n) + NAME##_dot(v + l * (n + q) + n, x_q, q);                        \
        NAME##_add(a, rank, work, m, y + g[0]);                                                                             \
    }

PRODUCTS(single, float, widened)
PRODUCTS(full, double, kept)

/* y += A x over blocks: first row, rows, first column, columns of nodes, first column beside, number beside, rank (-1 for
   whole ones), and the address of the numbers. `work` has room for the largest rank. */
DISPATCHED void petcontact_hmatrix_multiply(int64_t count, const int64_t *table, int64_t single, const double *x, double *y,
                                            double *work)
{
    for (int64_t i = 0; i < count; i++) {
        const int64_t *g = table + 8 * i;
        if (single)
            single_block(g, (const float *)(intptr_t)g[7], x, y, work);
        else
            full_block(g, (const double *)(intptr_t)g[7], x, y, work);
    }
}

/* Sums of n numbers by group: the groups met are listed, their sums held in `sums` (zero before, and to be zeroed after). */
INLINE int64_t grouped(const void *values, int64_t offset, int single, const int64_t *group, int64_t n, double *sums,
                       int64_t *met, int64_t found, char *seen)
{
    for (int64_t j = 0; j < n; j++) {
        const int64_t h = group[j];
        if (h < 0)
            continue;
        if (!seen[h]) {
            seen[h] = 1;
            met[found++] = h;
        }
        sums[h] += (single ? (double)((const float *)values)[offset + j] : ((const double *)values)[offset + j]);
    }
    return found;
}

typedef struct { /* groups of rows and of columns, -1 for none; scratch memory, zero before */
    const int64_t *row_group, *column_group;
    int64_t column_groups;
    double *row_sums, *column_sums;
    int64_t *rows_met, *columns_met;
    char *row_seen, *column_seen;
} Grouping;

/* coarse[row group, column group] += the sums of the blocks' entries, (row groups, column groups). */
DISPATCHED void petcontact_hmatrix_coarse(int64_t count, const int64_t *table, int64_t single, const Grouping *w,
                                          double *coarse)
{
    for (int64_t i = 0; i < count; i++) {
        const int64_t *g = table + 8 * i;
        const void *a = (const void *)(intptr_t)g[7];
        const int64_t m = g[1], n = g[3], q = g[5], terms = g[6] < 0 ? n + q : g[6];
        for (int64_t l = 0; l < terms; l++) {
            const int64_t rows = grouped(a, l * m, single, w->row_group + g[0], m, w->row_sums, w->rows_met, 0, w->row_seen);
            int64_t columns = 0;
            if (g[6] < 0) {
                const int64_t at = l < n ? g[2] + l : g[4] + l - n, h = w->column_group[at];
                if (h >= 0) {
                    w->column_sums[h] = 1.0;
                    w->columns_met[columns++] = h;
                }
            } else {
                const int64_t v = g[6] * m + l * (n + q), *group = w->column_group;
                columns = grouped(a, v, single, group + g[2], n, w->column_sums, w->columns_met, 0, w->column_seen);
                columns =
                    grouped(a, v + n, single, group + g[4], q, w->column_sums, w->columns_met, columns, w->column_seen);
            }
            for (int64_t r = 0; r < rows; r++) {
                double *to = coarse + w->rows_met[r] * w->column_groups;
                for (int64_t c = 0; c < columns; c++)
                    to[w->columns_met[c]] += w->row_sums[w->rows_met[r]] * w->column_sums[w->columns_met[c]];
            }
            for (int64_t r = 0; r < rows; r++) {
                w->row_sums[w->rows_met[r]] = 0.0;
                w->row_seen[w->rows_met[r]] = 0;
            }
            for (int64_t c = 0; c < columns; c++) {
                w->column_sums[w->columns_met[c]] = 0.0;
                w->column_seen[w->columns_met[c]] = 0;
            }
        }
    }
}

/* y[its rows] = block i times x[its columns], for blocks of numbers in single precision, row after row: a block is the
   address of its rows' numbers, their count, the address of its columns' numbers, their count, and its address. `work` has
   room for the columns. */
DISPATCHED void petcontact_patches_multiply(int64_t count, const int64_t *table, const double *x, double *y, double *work)
{
    for (int64_t i = 0; i < count; i++) {
        const int64_t *g = table + 5 * i, *rows = (const int64_t *)(intptr_t)g[0];
        const int64_t *columns = (const int64_t *)(intptr_t)g[2];
        const float *a = (const float *)(intptr_t)g[4];
        for (int64_t j = 0; j < g[3]; j++)
            work[j] = x[columns[j]];
        for (int64_t r = 0; r < g[1]; r++)
            y[rows[r]] = single_dot(a + r * g[3], work, g[3]);
    }
}
