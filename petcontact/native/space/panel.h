/* Panels and the Gauss points that stand for them from afar: petcontact.bem.kelvin3d.rules in C. */

#ifndef PETCONTACT_PANEL_H
#define PETCONTACT_PANEL_H

#include "moments.h"

enum {
    CHUNK = 64, /* targets at a time */
    LANES = 4, /* see Quad */
    NODES = 16,   /* of a panel, at most */
    RULES = 12,   /* numbers of points in one direction that are used, */
    LONGEST = 24, /* the greatest of them, */
    POINTS = 256, /* and of both */
    G = 6,
    H = 9,
    ALL = G + H,
    TRIANGLE = 4, /* are added to the order: the kind of a panel */
    CURVED = 8,
    FEW = 3 /* targets below which a vector holds points of a rule instead */
};

typedef double Vector __attribute__((vector_size(8 * LANES)));
typedef double Four __attribute__((vector_size(8 * 4)));

typedef struct {                          /* as numpy fills it: bem.kelvin3d.compiled.rules */
    double most[HIGHEST + 1];             /* points of far panels by order */
    double least[2 * HIGHEST + 2][RULES]; /* by degree: half the sum of the distances from both foci, over the half length */
    double count[RULES], xi[RULES][LONGEST], weight[RULES][LONGEST];
} Rules;

typedef struct {
    const double *centre, *frame, *polygon, *coefficients;
    double size, half[2], middle[2], area; /* area of the polygon in local coordinates */
    double length[2];                      /* half the longest line of Gauss points */
    int corners, order, nodes, degree;
    int along[2];         /* degree of basis times area in both directions of Gauss points: rules.degrees */
    const double *shape, *nodes_at; /* of curved panels: ξ^i η^j (9, 3), and the nodes (nodes, 3); else null */
    double warp;                    /* digits near a curved panel over those near a flat one: polar.warp */
    int fewest;                     /* place of the least number of points of a curved panel: rules.fewest */
    double lift, depth;          /* middle and half of the extent over the frame's plane, zero of flat panels */
    int upright, regular; /* whether lines of Gauss points run along the frame; whether the table of weights holds */
} Panel;

typedef struct { /* what panels of one kind share */
    int64_t kind;
    const Rules *rules;
    const double *weights; /* of a panel of area 1, if curved of the reference element, at each pair of numbers of points */
    double nu;
} Family;

typedef struct { /* the targets of a chunk, and their number filled up to whole vectors */
    int count, width;
    double x[3][CHUNK];
} Targets;

INLINE void load_targets(int count, const double *points, const int64_t *rows, Targets *t)
{
    t->count = count;
    t->width = (count + LANES - 1) / LANES * LANES;
    for (int i = 0; i < count; i++)
        for (int c = 0; c < 3; c++)
            t->x[c][i] = points[3 * (rows ? rows[i] : i) + c];
}

typedef struct { /* targets of a chunk that take one rule */
    int count;
    const int *target;
    const Targets *targets;
} Group;

typedef struct { /* kernels, and nodes of a panel from `node` to before `last` */
    int g, h, node, last;
} Wanted;

/* Both kernels over a panel that is near: near.c, curved.c. */
void petcontact_near(const Panel *p, const double *place, double nu, Wanted wanted, double *values, int width);
void petcontact_near_curved(const Panel *p, const Family *family, const Targets *targets, int t, Wanted wanted,
                            double *values);

INLINE int nodes_of(int64_t kind)
{
    const int order = (int)(kind & 3);
    return kind & TRIANGLE ? (order + 1) * (order + 2) / 2 : (order + 1) * (order + 1);
}

/* A panel's numbers: centre 3, frame 9, size 1, polygon 8, degrees 2; of flat ones coefficients nodes², of curved ones, whose
   frame and polygon are those of their corners, warp, fewest points, least and largest local coordinates 6, shape 27 and
   nodes. */
INLINE Panel panel_of(const double *record, int64_t kind)
{
    Panel p = {
        .centre = record, .frame = record + 3, .polygon = record + 13, .coefficients = record + 23, .size = record[12]};
    p.corners = kind & TRIANGLE ? 3 : 4;
    const double *extent = 0;
    if (kind & CURVED) {
        p.warp = *p.coefficients;
        p.fewest = (int)p.coefficients[1];
        extent = p.coefficients + 2;
        p.shape = extent + 6;
        p.nodes_at = p.shape + 27;
        p.lift = 0.5 * (extent[5] + extent[2]);
        p.depth = 0.5 * (extent[5] - extent[2]);
    }
    p.order = (int)(kind & 3);
    p.nodes = nodes_of(kind);
    p.degree = p.corners == 4 ? 2 * p.order : p.order;
    p.along[0] = (int)record[21];
    p.along[1] = (int)record[22];
    double area = 0.0, box = 1.0, longest = 0.0;
    for (int c = 0; c < 2; c++) {
        double low = p.polygon[c], high = low;
        for (int k = 1; k < p.corners; k++) {
            double value = p.polygon[2 * k + c];
            low = value < low ? value : low;
            high = value > high ? value : high;
        }
        low = extent ? extent[c] : low;
        high = extent ? extent[3 + c] : high;
        p.half[c] = 0.5 * (high - low);
        p.middle[c] = 0.5 * (high + low);
        box *= high - low;
    }
    for (int k = 0; k < p.corners; k++) {
        const double *a = p.polygon + 2 * k, *b = p.polygon + 2 * (k + 1 < p.corners ? k + 1 : 0);
        const double edge = 0.5 * sqrt((b[0] - a[0]) * (b[0] - a[0]) + (b[1] - a[1]) * (b[1] - a[1]));
        area += 0.5 * (a[0] * b[1] - a[1] * b[0]);
        longest = edge > longest ? edge : longest;
    }
    p.area = area;
    p.upright = area >= 0.9 * box;
    for (int c = 0; c < 2; c++)
        p.length[c] = p.upright || longest < p.half[c] ? p.half[c] : longest;
    p.regular = p.corners == 3 || area >= (1.0 - 1e-14) * box;
    return p;
}

/* u^a v^b in the order of the basis, about the origin of local coordinates. */
INLINE void monomials(const Panel *p, double x, double y, double *out)
{
    double power = 1.0;
    for (int a = 0, m = 0; a <= p->order; a++) {
        double value = power;
        for (int b = 0; b <= (p->corners == 4 ? p->order : p->order - a); b++) {
            out[m++] = value;
            value *= y;
        }
        power *= x;
    }
}

/* Targets in local coordinates, and the pair of rules that each takes: first · RULES + second, or -1 for the closed form. */
INLINE void choose(const Panel *p, const Rules *rules, const Targets *targets, double (*local)[CHUNK], int *code)
{
    const double over = 1.0 / p->size;
    for (int t = 0; t < targets->count; t++) {
        double r[3], beyond[2];
        int place[2];
        for (int c = 0; c < 3; c++)
            r[c] = targets->x[c][t] - p->centre[c];
        for (int c = 0; c < 3; c++)
            local[c][t] = (p->frame[3 * c] * r[0] + p->frame[3 * c + 1] * r[1] + p->frame[3 * c + 2] * r[2]) * over;
        for (int c = 0; c < 2; c++) {
            beyond[c] = fabs(local[c][t] - p->middle[c]) - p->half[c];
            beyond[c] = beyond[c] > 0.0 ? beyond[c] : 0.0;
        }
        for (int c = 0; c < 2; c++) {
            double along = fabs(local[c][t] - p->middle[c]), half = p->half[c];
            double z = fabs(local[2][t] - p->lift) - p->depth;
            z = z > 0.0 ? z : 0.0;
            double across = beyond[1 - c] * beyond[1 - c] + z * z;
            double mean = (0.5 / p->length[c]) *
                          (sqrt((along - half) * (along - half) + across) + sqrt((along + half) * (along + half) + across));
            place[c] = 0;
            for (int n = 0; n < RULES; n++)
                place[c] += mean < rules->least[p->along[c]][n];
            place[c] = place[c] > p->fewest ? place[c] : p->fewest;
        }
        if (!p->upright)
            place[0] = place[1] = place[0] > place[1] ? place[0] : place[1];
        int too_many = place[0] >= RULES || place[1] >= RULES ||
                       rules->count[place[0]] * rules->count[place[1]] > rules->most[p->order];
        code[t] = too_many ? -1 : place[0] * RULES + place[1];
    }
}

typedef struct {      /* Gauss points; more without weight fill the last vector */
    int count, nodal; /* whether the points are the nodes, each of weight in its own function only */
    double scale, x[3][POINTS];
    double normal[3][POINTS], area[POINTS]; /* of curved panels: normals times area, and the area factor */
    const double (*weight)[NODES]; /* over the scale */
} Rule;

/* `weights` are those of a panel of area 1 at each pair of numbers of points, `room` for those of another. */
INLINE void rule_of(const Panel *p, const Rules *rules, const double *weights, int first, int second, double (*room)[NODES],
                    Rule *rule)
{
    const int nx = (int)rules->count[first], ny = (int)rules->count[second];
    const double *a = p->polygon, *b = a + 2, *c = b + 2, *d = p->corners == 4 ? c + 2 : c;
    double local[4][2], global[4][3]; /* times 1, s, t and s t: bilinear, two corners of triangles in one */
    for (int k = 0; k < 2; k++) {
        local[0][k] = 0.25 * ((a[k] + b[k]) + (c[k] + d[k]));
        local[1][k] = 0.25 * ((b[k] - a[k]) + (c[k] - d[k]));
        local[2][k] = 0.25 * ((d[k] - a[k]) + (c[k] - b[k]));
        local[3][k] = 0.25 * ((a[k] - b[k]) + (c[k] - d[k]));
    }
    for (int i = 0; i < 4; i++)
        for (int k = 0; k < 3; k++)
            global[i][k] = (i ? 0.0 : p->centre[k]) + p->size * (local[i][0] * p->frame[k] + local[i][1] * p->frame[3 + k]);
    rule->weight = p->regular ? (const double(*)[NODES])(weights + (first * RULES + second) * POINTS * NODES) : room;
    rule->scale = p->size * p->size * (p->regular ? p->area : 1.0);
    rule->nodal = p->regular && p->corners == 4 && nx == p->order + 1 && ny == nx;
    int q = 0;
    for (int i = 0; i < nx; i++) {
        const double s = rules->xi[first][i], *xi = rules->xi[second];
        for (int k = 0; k < 3; k++) {
            const double along = global[0][k] + s * global[1][k], up = global[2][k] + s * global[3][k];
            for (int j = 0; j < ny; j++)
                rule->x[k][q + j] = along + xi[j] * up;
        }
        for (int j = 0; !p->regular && j < ny; j++) {
            double at[2], along[2], up[2], power[NODES];
            for (int k = 0; k < 2; k++) {
                along[k] = local[1][k] + xi[j] * local[3][k];
                up[k] = local[2][k] + s * local[3][k];
                at[k] = local[0][k] + s * local[1][k] + xi[j] * up[k];
            }
            const double area = (along[0] * up[1] - along[1] * up[0]) * rules->weight[first][i] * rules->weight[second][j];
            monomials(p, at[0], at[1], power);
            for (int n = 0; n < NODES; n++) {
                double value = 0.0;
                for (int m = 0; n < p->nodes && m < p->nodes; m++)
                    value += p->coefficients[n * p->nodes + m] * power[m];
                room[q + j][n] = area * value;
            }
        }
        q += ny;
    }
    for (; q % LANES; q++) {
        for (int k = 0; k < 3; k++)
            rule->x[k][q] = rule->x[k][q - 1];
        for (int n = 0; !p->regular && n < NODES; n++)
            room[q][n] = 0.0;
    }
    rule->count = q;
}

static const int PLACE[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};

#endif
