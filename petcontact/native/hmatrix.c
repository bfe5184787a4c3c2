/* Blocks of hierarchical matrices: adaptive cross approximation, recompression and products; petcontact.compression.hmatrix
   in C, see there. Entries come from a function of the caller, d rows a node, d columns a node and, beside these, some further
   columns. Numbers are kept in double or in single precision, or as whole numbers of 16 bits after their scale; all sums are in
   double. Rows of U, of V (columns of nodes, then those beside) and columns of whole blocks are filled up with zeros to multiples
   of FULL, so that products know no remainders: vectors have room for as many numbers more. */

#include "elementary.h"

/* system (k, d, m, d) by column node, direction, row node, component; beside (columns beside, m, d); either may be null. */
typedef void (*Filler)(const void *context, int64_t m, const int64_t *rows, int64_t k, const int64_t *columns,
                       double *system, double *beside);

enum {
    CHECKS = 4,
    CHECKS_OF_KNOWN = 8, /* nodes whose rows have to be right in the end */
    COMPONENTS = 3       /* d at most */
};

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
    int64_t width; /* bytes of a number: 8, 4 or 2 */
    void *values;
    int64_t capacity, *ranks;
} Store;

INLINE void fill_block(const Operator *a, int64_t m, const int64_t *rows, int64_t k, const int64_t *columns, double *out)
{
    a->fill(a->context, m, rows, k, columns, out, out + k * a->d * m * a->d);
}

typedef float Singles __attribute__((vector_size(8 * sizeof(float)), aligned(sizeof(float)), may_alias));

INLINE double dot(const double *x, const double *y, int64_t n)
{
    Quad sums[2] = {{0.0}};
    int64_t j = 0;
    for (; j + 8 <= n; j += 8)
        add_products(x + j, y + j, sums);
    double sum = total(sums);
    for (; j < n; j++)
        sum += x[j] * y[j];
    return sum;
}

/* Products of x with k rows, four of them at a time. */
INLINE void dots(int64_t k, const double *rows, const double *x, int64_t n, double *out)
{
    int64_t l = 0;
    for (; l + 4 <= k; l += 4) {
        Quad sums[4][2] = {{{0.0}}};
        const double *r = rows + l * n;
        int64_t j = 0;
        for (; j + 8 <= n; j += 8)
            for (int i = 0; i < 4; i++)
                add_products(r + i * n + j, x + j, sums[i]);
        for (int i = 0; i < 4; i++) {
            out[l + i] = total(sums[i]);
            for (int64_t h = j; h < n; h++)
                out[l + i] += r[i * n + h] * x[h];
        }
    }
    for (; l < k; l++)
        out[l] = dot(rows + l * n, x, n);
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

/* Row c of them less what crosses `from` to `k` know of it. */
INLINE void reduce_row(const Operator *a, const Block *b, const Work *w, int64_t from, int64_t k, int64_t node, int64_t c)
{
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
    int64_t k = 0, passed = 0, node = -1, reduced[COMPONENTS] = {0}, next = d * (b->m / 2), checks = b->dense ? CHECKS_OF_KNOWN : CHECKS;
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
            memset(reduced, 0, sizeof reduced);
            fetch_rows(a, b, w, node);
        }
        for (int64_t c = checking ? 0 : row % d; c < (checking ? d : row % d + 1); c++) {
            reduce_row(a, b, w, reduced[c], k, node, c);
            reduced[c] = k;
        }
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
        double *uu = w->gram_u + k * most, *vv = w->gram_v + k * most;
        dots(k + 1, w->u, u, b->rows, uu);
        dots(k + 1, w->v, v, b->columns, vv);
        for (int64_t l = 0; l <= k; l++) {
            w->gram_u[l * most + k] = uu[l];
            w->gram_v[l * most + k] = vv[l];
            cross += (l < k ? 2.0 : 1.0) * uu[l] * vv[l];
        }
        const double size = w->gram_u[k * most + k] * w->gram_v[k * most + k];
        norm = norm + cross > size ? norm + cross : size;
        k++;
        next = largest(u, w->used_rows, b->rows);
        checking = size <= square * norm || next < 0;
    }
}

/* Rows b of k numbers with Σ bᵀb = S but for a trace that is `small` beside its own, by Cholesky's method with pivots; returns
   their number, and through `left` the rest of the trace. `rest` has room for k numbers. */
INLINE int64_t root_of(int64_t k, int64_t stride, const double *s, double small, double *b, double *rest, double *left)
{
    double trace = 0.0;
    for (int64_t i = 0; i < k; i++)
        trace += rest[i] = s[i * stride + i] > 0.0 ? s[i * stride + i] : 0.0;
    *left = trace;
    int64_t rank = 0;
    for (; rank < k && *left > small * trace; rank++) {
        int64_t pivot = 0;
        for (int64_t i = 1; i < k; i++)
            if (rest[i] > rest[pivot])
                pivot = i;
        double *row = b + rank * k;
        memcpy(row, s + pivot * stride, k * sizeof(double));
        subtract_rows(rank, b + pivot, k, b, k, row);
        if (row[pivot] <= 0.0)
            break;
        const double over = 1.0 / sqrt(row[pivot]);
        *left = 0.0;
        for (int64_t i = 0; i < k; i++) {
            row[i] *= over;
            rest[i] = i != pivot && rest[i] > row[i] * row[i] ? rest[i] - row[i] * row[i] : 0.0;
            *left += rest[i];
        }
    }
    return rank;
}

/* Turns rows of k numbers until they are orthogonal, by one-sided Jacobi; leaves their squares in `square`. Rows that come from
   pivots are nearly so. What is left of a product, over the smaller of two rows, counts as an error of the combinations, which may
   be `small`, squared. */
INLINE void orthogonal(int64_t rank, int64_t k, double small, double *b, double *square)
{
    double all = 0.0;
    for (int64_t i = 0; i < rank; i++)
        all += square[i] = dot(b + i * k, b + i * k, k);
    const double limit = small * all / (double)(rank * rank);
    for (int sweep = 0, turned = 1; turned && sweep < 30; sweep++) {
        turned = 0;
        for (int64_t i = 0; i < rank; i++)
            for (int64_t j = i + 1; j < rank; j++) {
                double *x = b + i * k, *y = b + j * k;
                const double product = dot(x, y, k), least = square[i] < square[j] ? square[i] : square[j];
                if (product * product <= limit * least)
                    continue;
                turned = 1;
                const double theta = 0.5 * (square[j] - square[i]) / product;
                const double t = (theta < 0.0 ? -1.0 : 1.0) / (fabs(theta) + sqrt(theta * theta + 1.0));
                const double c = 1.0 / sqrt(t * t + 1.0), n = t * c;
                for (int64_t l = 0; l < k; l++) {
                    const double one = x[l], other = y[l];
                    x[l] = c * one - n * other;
                    y[l] = n * one + c * other;
                }
                square[i] = dot(x, x, k);
                square[j] = dot(y, y, k);
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
    double left;
    const double square = tolerance * tolerance;
    const int64_t found = root_of(k, p, s, 0.01 * square, y, values, &left);
    orthogonal(found, k, 0.01 * square, y, values);
    double all = left;
    for (int64_t i = 0; i < found; i++)
        all += values[i];
    /* from the largest down: a selection by repeated search is nothing beside the rest */
    int64_t rank = 0;
    left = all;
    while (rank < found && left > square * all) {
        int64_t best = 0;
        for (int64_t i = 1; i < found; i++)
            if (values[i] > values[best])
                best = i;
        if (values[best] <= 0.0)
            break;
        left -= values[best];
        const double over = 1.0 / sqrt(values[best]);
        values[best] = -1.0;
        double *right = w->gram_u + rank * p; /* later: left and right change places */
        for (int64_t i = 0; i < k; i++)
            right[i] = over * y[best * k + i];
        rank++;
    }
    /* rows of Y now: left coefficients Y Lᵀ in s, right ones Y L⁻¹ in place */
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

enum { HEAD = sizeof(float) / sizeof(int16_t), FULL = 16 }; /* room of the scale before whole numbers */

INLINE int64_t filled(int64_t n)
{
    return (n + FULL - 1) / FULL * FULL;
}

/* Numbers that n values, and q beside them, take in a store. */
INLINE int64_t length(int64_t n, int64_t q, int64_t width)
{
    return filled(n) + filled(q) + (width == 2 ? HEAD : 0);
}

INLINE void store_some(const double *values, int64_t n, double over, int64_t width, char *out)
{
    const double shift = 6755399441055744.0; /* 1.5·2^52 rounds */
    memset(out + n * width, 0, (filled(n) - n) * width);
    if (width == 8)
        memcpy(out, values, n * sizeof(double));
    else if (width == 4)
        for (int64_t j = 0; j < n; j++)
            ((float *)out)[j] = (float)values[j];
    else
        for (int64_t j = 0; j < n; j++)
            ((int16_t *)out)[j] = (int16_t)(int32_t)((values[j] * over + shift) - shift);
}

/* n values, and q beside them, into a store. */
INLINE void store(const double *values, int64_t n, int64_t q, int64_t width, char *out)
{
    double over = 1.0;
    if (width == 2) {
        double most = 0.0;
        for (int64_t j = 0; j < n + q; j++)
            most = fabs(values[j]) > most ? fabs(values[j]) : most;
        const float scale = (float)(most / 32766.0);
        over = scale > 0.0f ? 1.0 / scale : 0.0;
        memcpy(out, &scale, sizeof scale);
        out += sizeof scale;
    }
    store_some(values, n, over, width, out);
    store_some(values + n, q, over, width, out + filled(n) * width);
}

/* rank combinations of k rows of n numbers, and q beside them, into a store. */
INLINE void combine(int64_t rank, int64_t k, const double *coefficients, int64_t stride, const double *rows, int64_t n,
                    int64_t q, double *line, int64_t width, char *out)
{
    for (int64_t r = 0; r < rank; r++) {
        memset(line, 0, (n + q) * sizeof(double));
        subtract_rows(k, coefficients + r * stride, 1, rows, n + q, line);
        for (int64_t j = 0; j < n + q; j++)
            line[j] = -line[j];
        store(line, n, q, width, out + r * length(n, q, width) * width);
    }
}

/* Builds blocks one after another until one may not fit any more; returns through `done` how many were built and the numbers
   used. A block is five numbers (first row node, their number, first column node, their number, kind: 0 dense, 1 of low
   rank); its result the rank, -1 where it is kept whole, or -2 where the crosses do not do and it has to be divided. Blocks
   of low rank are kept as rank rows of U and rank rows of V, whole ones column after column. Those of low rank with at most
   `whole` entries are known whole, too. */
DISPATCHED void petcontact_hmatrix_build(const Operator *a, const Work *w, int64_t whole, int64_t count,
                                         const int64_t *blocks, const Store *to, int64_t *done)
{
    const int64_t d = a->d, most = w->most, width = to->width;
    int64_t used = 0, i = 0;
    for (; i < count; i++) {
        const int64_t *g = blocks + 5 * i;
        Block b = {g[0], g[2], g[1], g[3], d * g[1], d * g[3], d * g[3] + a->beside[g[2] + g[3]] - a->beside[g[2]], 0};
        const int64_t both = b.rows + b.columns, all = b.rows * b.columns, column = length(b.rows, 0, width),
                      row = length(b.in, b.columns - b.in, width), whole_size = b.columns * column;
        char *out = (char *)to->values + used * width;
        if (used + (g[4] && most * both < all ? most * (column + row) : whole_size) > to->capacity)
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
                if (rank * (column + row) < whole_size) {
                    to->ranks[i] = rank;
                    combine(rank, k, w->gram_u, most, w->u, b.rows, 0, w->row, width, out);
                    combine(rank, k, w->gram_v, most, w->v, b.in, b.columns - b.in, w->row, width,
                            out + rank * column * width);
                    used += rank * (column + row);
                }
            }
        }
        if (to->ranks[i] == -1) {
            for (int64_t j = 0; j < b.columns; j++)
                store(b.dense + j * b.rows, b.rows, 0, width, out + j * column * width);
            used += whole_size;
        }
    }
    done[0] = i;
    done[1] = used;
}

INLINE double unscaled(const void *row)
{
    (void)row;
    return 1.0;
}

INLINE double scale_of(const void *row)
{
    float scale;
    memcpy(&scale, row, sizeof scale);
    return scale;
}

enum {
    TILE = 256, /* numbers that are widened at a time: compilers do that well in a loop of its own only */
    LINE = 64,
    AHEAD = 2048 /* bytes: rows are too short for the processor to see where memory is read next */
};

INLINE void fetch_ahead(const void *at, size_t bytes)
{
    for (size_t j = 0; j < bytes; j += LINE)
        __builtin_prefetch((const char *)at + j + AHEAD);
}

/* Sums over eight interleaved partial sums, whatever the width of the processor's vectors; n are multiples of FULL. */
#define PRODUCTS(NAME, TYPE, ROOM, SCALE)                                                                                   \
    INLINE double NAME##_dot(const TYPE *a, const double *x, int64_t n)                                                     \
    {                                                                                                                       \
        Quad sums[4] = {{0.0}};                                                                                             \
        double wide[TILE];                                                                                                  \
        for (int64_t first = 0; first < n; first += TILE) {                                                                 \
            const int64_t some = n - first < TILE ? n - first : TILE;                                                       \
            fetch_ahead(a + first, some * sizeof(TYPE));                                                                    \
            for (int64_t j = 0; j < some / FULL * FULL; j++)                                                                              \
                wide[j] = a[first + j];                                                                                     \
            for (int64_t j = 0; j < some; j += 16) {                                                                        \
                add_products(wide + j, x + first + j, sums);                                                                \
                add_products(wide + j + 8, x + first + j + 8, sums + 2);                                                    \
            }                                                                                                               \
        }                                                                                                                   \
        sums[0] += sums[2];                                                                                                 \
        sums[1] += sums[3];                                                                                                 \
        return total(sums);                                                                                                 \
    }                                                                                                                       \
    /* y += Σ factor[l] a[l, :], four rows at a time */                                                                     \
    INLINE void NAME##_add(const TYPE *a, int64_t k, const double *factor, int64_t n, double *restrict y)                   \
    {                                                                                                                       \
        const int64_t stride = n + ROOM;                                                                                    \
        int64_t l = 0;                                                                                                      \
        for (; l + 4 <= k; l += 4, a += 4 * stride) {                                                                       \
            fetch_ahead(a, 4 * stride * sizeof(TYPE));                                                                      \
            const TYPE *a0 = a + ROOM, *a1 = a0 + stride, *a2 = a1 + stride, *a3 = a2 + stride;                             \
            const double f0 = factor[l] * SCALE(a), f1 = factor[l + 1] * SCALE(a + stride),                                 \
                         f2 = factor[l + 2] * SCALE(a + 2 * stride), f3 = factor[l + 3] * SCALE(a + 3 * stride);            \
            for (int64_t j = 0; j < n / FULL * FULL; j++)                                                                                 \
                y[j] += (f0 * a0[j] + f1 * a1[j]) + (f2 * a2[j] + f3 * a3[j]);                                              \
        }                                                                                                                   \
        for (; l < k; l++, a += stride) {                                                                                   \
            const double f = factor[l] * SCALE(a);                                                                          \
            for (int64_t j = 0; j < n / FULL * FULL; j++)                                                                                 \
                y[j] += f * a[ROOM + j];                                                                                    \
        }                                                                                                                   \
    }                                                                                                                       \
    INLINE void NAME##_block(const int64_t *g, const TYPE *a, const double *x, double *y, double *work)                     \
    {                                                                                                                       \
        const int64_t m = filled(g[1]), n = filled(g[3]), q = filled(g[5]), rank = g[6];                                    \
        const double *x_n = x + g[2], *x_q = x + g[4];                                                                      \
        if (rank < 0) {                                                                                                     \
            NAME##_add(a, g[3], x_n, m, y + g[0]);                                                                          \
            NAME##_add(a + g[3] * (m + ROOM), g[5], x_q, m, y + g[0]);                                                      \
            return;                                                                                                         \
        }                                                                                                                   \
        const TYPE *v = a + rank * (m + ROOM);                                                                              \
        for (int64_t l = 0; l < rank; l++, v += n + q + ROOM)                                                               \
            work[l] = SCALE(v) * (NAME##_dot(v + ROOM, x_n, n) + NAME##_dot(v + ROOM + n, x_q, q));                         \
        NAME##_add(a, rank, work, m, y + g[0]);                                                                             \
    }

PRODUCTS(double, double, 0, unscaled)
PRODUCTS(single, float, 0, unscaled)
PRODUCTS(short, int16_t, HEAD, scale_of)

/* y += A x over blocks: first row, rows, first column, columns of nodes, first column beside, number beside, rank (-1 for
   whole ones), and the address of the numbers. `work` has room for the largest rank, x and y for
   FULL numbers more. */
DISPATCHED void petcontact_hmatrix_multiply(int64_t count, const int64_t *table, int64_t width, const double *x, double *y,
                                            double *work)
{
    for (int64_t i = 0; i < count; i++) {
        const int64_t *g = table + 8 * i;
        const void *a = (const void *)(intptr_t)g[7];
        if (width == 8)
            double_block(g, a, x, y, work);
        else if (width == 4)
            single_block(g, a, x, y, work);
        else
            short_block(g, a, x, y, work);
    }
}

/* Sums of n numbers by group: the groups met are listed, their sums held in `sums` (zero before, and to be zeroed after). */
INLINE int64_t grouped(const char *values, int64_t width, double scale, const int64_t *group, int64_t n, double *sums,
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
        sums[h] += scale * (width == 8   ? ((const double *)values)[j]
                            : width == 4 ? (double)((const float *)values)[j]
                                         : (double)((const int16_t *)values)[j]);
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
DISPATCHED void petcontact_hmatrix_coarse(int64_t count, const int64_t *table, int64_t width, const Grouping *w,
                                          double *coarse)
{
    const int64_t head = length(0, 0, width) * width;
    for (int64_t i = 0; i < count; i++) {
        const int64_t *g = table + 8 * i;
        const char *u = (const char *)(intptr_t)g[7];
        const int64_t m = g[1], n = g[3], q = g[5], terms = g[6] < 0 ? n + q : g[6];
        const char *v = u + terms * length(m, 0, width) * width;
        for (int64_t l = 0; l < terms; l++, u += length(m, 0, width) * width) {
            const int64_t rows = grouped(u + head, width, head ? scale_of(u) : 1.0, w->row_group + g[0], m, w->row_sums,
                                         w->rows_met, 0, w->row_seen);
            int64_t columns = 0;
            if (g[6] < 0) {
                const int64_t at = l < n ? g[2] + l : g[4] + l - n, h = w->column_group[at];
                if (h >= 0) {
                    w->column_sums[h] = 1.0;
                    w->columns_met[columns++] = h;
                }
            } else {
                const double scale = head ? scale_of(v) : 1.0;
                const int64_t *group = w->column_group;
                columns = grouped(v + head, width, scale, group + g[2], n, w->column_sums, w->columns_met, 0, w->column_seen);
                columns = grouped(v + head + filled(n) * width, width, scale, group + g[4], q, w->column_sums, w->columns_met, columns,
                                  w->column_seen);
                v += length(n, q, width) * width;
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

/* y[its rows] = block i times x[its columns], for blocks of numbers in single precision, row after row, filled up: a block is
   the address of its rows' numbers, their count, the address of its columns' numbers, their count, and its address. `work` has
   room for the columns, filled up. */
DISPATCHED void petcontact_patches_multiply(int64_t count, const int64_t *table, const double *x, double *y, double *work)
{
    for (int64_t i = 0; i < count; i++) {
        const int64_t *g = table + 5 * i, *rows = (const int64_t *)(intptr_t)g[0];
        const int64_t *columns = (const int64_t *)(intptr_t)g[2], n = filled(g[3]);
        const float *a = (const float *)(intptr_t)g[4];
        for (int64_t j = 0; j < g[3]; j++)
            work[j] = x[columns[j]];
        for (int64_t j = g[3]; j < n; j++)
            work[j] = 0.0;
        for (int64_t r = 0; r < g[1]; r++)
            y[rows[r]] = single_dot(a + r * n, work, n);
    }
}
