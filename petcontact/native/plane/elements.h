/* Elements, targets and values of the plane: what the kernels over straight elements and arcs share. */

#ifndef PETCONTACT_ELEMENTS_H
#define PETCONTACT_ELEMENTS_H

#include "../elementary.h"

enum {
    CHUNK = 64,           /* targets at a time: what lies between two loops stays in the first cache */
    LANES = 4,            /* targets in one vector, see Quad */
    ROOM = CHUNK + LANES, /* a vector that begins at a target may reach beyond the last one */
    NODES = 6,            /* of an element, at most */
    POINTS = 24,          /* of a Gauss rule, at most */
    TIERS = 8             /* Gauss rules by distance, at most */
};

typedef double Vector __attribute__((vector_size(8 * LANES)));
/* The same among other numbers in memory. Variables are no such: GCC 12 reads what it has not aligned by instructions for
   aligned ones. */
typedef double Unaligned __attribute__((vector_size(8 * LANES), aligned(8), may_alias));

typedef struct { /* points, and weights times the basis there */
    double s[POINTS], product[NODES][POINTS];
} Gauss;

typedef struct {      /* of elements of one order; bem.kelvin2d.compiled fills it, numbers all double */
    double close_sum; /* |z+1| + |z-1| below which targets take the closed form */
    double tiers, points[TIERS], radius_2[TIERS]; /* Gauss points, and |z|² from which on they are enough */
    double weight[NODES], to_basis[NODES][NODES]; /* ∫ of each function, and its Legendre coefficients */
    Gauss gauss[POINTS + 1];                      /* by number of points */
} Rule;

enum { SERIES = 48 };

typedef struct {                            /* of one arc; bem.kelvin2d.compiled fills it, numbers all double */
    double middle[2], tangent[2];           /* there */
    double angle, half, curvature, turn[2]; /* α, half the length, and exp(iα) */
    double reach_2;                         /* squared distance from which on targets are far */
    double far, rest, terms;                /* Gauss points from afar and for the remainders, terms of the series for them */
    double wave_re[NODES], wave_im[NODES];  /* ∫ L exp(-iαs) */
} Arc;

typedef struct {                         /* elements of a mesh, or some of them */
    const double *start, *end;           /* (e, 2) */
    const int64_t *order, *line, *index; /* (e,); lines are -1 on none */
    const Rule *const *rules;            /* by order */
    const Arc *arcs;                     /* (e,), of angle 0 where elements are straight; null where all are */
    const double (*series)[SERIES];      /* of the remainders of arcs: coefficients of powers of (x/π)² */
    double nu, length, unit;             /* the logarithm's unit, and what G comes in */
} Elements;

typedef struct { /* points that may be nodes: (n, 2), (n,) ... */
    const double *x, *xi;
    const int64_t *line, *element; /* -1 on none */
    const int64_t *before, *after; /* constant arcs of the same shape before and after the node's own, -2 for none */
} Points;

typedef struct { /* one element */
    const double *start, *end;
    double tx, ty, half; /* unit tangent, at the middle of an arc, and half the length */
    int64_t line, index; /* the line is -2 on none */
    int order;
    const Rule *rule;
    const Arc *arc; /* or null */
    const double (*series)[SERIES];
} Element;

typedef struct {
    double scale, factor, nu, unit, log_length; /* 1/(4π(1-ν)), 3-4ν */
} Constants;

typedef struct { /* the targets of a chunk */
    int count;
    double x[CHUNK], y[CHUNK], xi[CHUNK];
    int64_t line[CHUNK], element[CHUNK], before[CHUNK], after[CHUNK];
} Targets;

typedef struct { /* of one node of an element at each target of a chunk */
    double g00[ROOM], g01[ROOM], g11[ROOM], h00[ROOM], h01[ROOM], h10[ROOM], h11[ROOM];
} Values;

typedef struct { /* targets of a chunk in an element's own coordinates, and the rule for each */
    double left[ROOM], right[ROOM], h[ROOM], on_line[ROOM]; /* ξ+1, ξ-1 */
    int rule[ROOM];                                         /* 0 for the closed form, else 1 more than the tier */
} Local;

typedef struct { /* kernels, and nodes of an element from `node` to before `last` */
    int g, h, node, last;
} Wanted;

INLINE Element element_of(const Elements *all, int64_t e)
{
    const double *start = all->start + 2 * e, *end = all->end + 2 * e;
    const double dx = end[0] - start[0], dy = end[1] - start[1], half = 0.5 * sqrt(dx * dx + dy * dy);
    const Arc *arc = all->arcs && all->arcs[e].angle != 0.0 ? all->arcs + e : 0;
    return (Element){
        .start = start,
        .end = end,
        .tx = arc ? arc->tangent[0] : 0.5 * dx / half,
        .ty = arc ? arc->tangent[1] : 0.5 * dy / half,
        .half = arc ? arc->half : half,
        .line = all->line[e] < 0 ? -2 : all->line[e],
        .index = all->index[e],
        .order = (int)all->order[e],
        .rule = all->rules[all->order[e]],
        .arc = arc,
        .series = all->series,
    };
}

INLINE Constants constants_of(const Elements *all)
{
    const double nu = all->nu;
    return (Constants){1.0 / (4.0 * PI * (1.0 - nu)), 3.0 - 4.0 * nu, nu, all->unit, logarithm(all->length)};
}

/* Targets `first` to `first + count - 1` out of rows, or of all points where there are no rows. */
INLINE void load_targets(const Points *points, const int64_t *rows, int64_t first, int count, Targets *t)
{
    t->count = count;
    for (int i = 0; i < count; i++) {
        const int64_t row = rows ? rows[first + i] : first + i;
        t->x[i] = points->x[2 * row];
        t->y[i] = points->x[2 * row + 1];
        t->xi[i] = points->xi[row];
        t->line[i] = points->line[row];
        t->element[i] = points->element[row];
        t->before[i] = points->before ? points->before[row] : -2;
        t->after[i] = points->after ? points->after[row] : -2;
    }
}

/* |z+1| + |z-1| of a target in an element's own coordinate. */
INLINE double sum_of(double left, double right, double h)
{
    return sqrt(left * left + h * h) + sqrt(right * right + h * h);
}

#endif
