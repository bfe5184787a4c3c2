/* Both kernels of space over flat panels of order 0 to 3: petcontact.bem.kelvin3d.integrals in C, with the same formulas and
   the same choice of Gauss points from afar; see there. */

#include "moments.h"

enum {
    CHUNK = 64,                            /* targets at a time */
    LANES = 8,
    NODES = 16,                            /* of a panel, at most */
    RULES = 12,                            /* numbers of points in one direction that are used, */
    LONGEST = 24,                          /* the greatest of them, */
    POINTS = 144,                          /* and of both */
    G = 6, H = 9, ALL = G + H,
    FEW = 3                                /* targets below which a vector holds points of a rule instead */
};

typedef double Vector __attribute__((vector_size(8 * LANES)));

typedef struct {                           /* as numpy fills it: bem.kelvin3d.compiled.rules */
    double most[HIGHEST + 1];              /* points of far panels by order */
    double least[HIGHEST + 1][RULES];      /* least half sum of the distances from both foci, in their half distance */
    double count[RULES], xi[RULES][LONGEST], weight[RULES][LONGEST];
} Rules;

typedef struct {
    const double *centre, *frame, *polygon, *coefficients;
    double size, half[2], middle[2];
    int corners, order, nodes, degree, rectangular;
} Panel;

/* A panel's numbers: centre 3, frame 9, size 1, polygon 8 and coefficients nodes²; kind: order, and 4 more for triangles. */
INLINE Panel panel_of(const double *record, int64_t kind)
{
    Panel p = {.centre = record, .frame = record + 3, .polygon = record + 13, .coefficients = record + 21, .size = record[12]};
    p.corners = kind < 4 ? 4 : 3;
    p.order = (int)(kind & 3);
    p.nodes = p.corners == 4 ? (p.order + 1) * (p.order + 1) : (p.order + 1) * (p.order + 2) / 2;
    p.degree = p.corners == 4 ? 2 * p.order : p.order;
    double area = 0.0, box = 1.0;
    for (int c = 0; c < 2; c++) {
        double low = p.polygon[c], high = low;
        for (int k = 1; k < p.corners; k++) {
            double value = p.polygon[2 * k + c];
            low = value < low ? value : low;
            high = value > high ? value : high;
        }
        p.half[c] = 0.5 * (high - low);
        p.middle[c] = 0.5 * (high + low);
        box *= high - low;
    }
    for (int k = 0; k < p.corners; k++) {
        const double *a = p.polygon + 2 * k, *b = p.polygon + 2 * (k + 1 < p.corners ? k + 1 : 0);
        area += a[0] * b[1] - a[1] * b[0];
    }
    p.rectangular = area >= 1.8 * box;
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

typedef struct {                           /* Gauss points; more without weight fill the last vector */
    int count;
    double x[3][POINTS], weight[POINTS][NODES];
} Rule;

INLINE void rule_of(const Panel *p, const Rules *rules, int first, int second, Rule *rule)
{
    const int nx = (int)rules->count[first], ny = (int)rules->count[second];
    const double *a = p->polygon, *b = a + 2, *c = b + 2, *d = p->corners == 4 ? c + 2 : c;
    int q = 0;
    for (int i = 0; i < nx; i++)
        for (int j = 0; j < ny; j++, q++) {
            double s = rules->xi[first][i], t = rules->xi[second][j], local[2], along[2], up[2], power[NODES];
            for (int k = 0; k < 2; k++) {
                local[k] = 0.25 * ((1 - s) * (1 - t) * a[k] + (1 + s) * (1 - t) * b[k] + (1 + s) * (1 + t) * c[k]
                                   + (1 - s) * (1 + t) * d[k]);
                along[k] = 0.25 * ((1 - t) * (b[k] - a[k]) + (1 + t) * (c[k] - d[k]));
                up[k] = 0.25 * ((1 - s) * (d[k] - a[k]) + (1 + s) * (c[k] - b[k]));
            }
            double area = (along[0] * up[1] - along[1] * up[0]) * rules->weight[first][i] * rules->weight[second][j];
            for (int k = 0; k < 3; k++)
                rule->x[k][q] = p->centre[k] + p->size * (local[0] * p->frame[k] + local[1] * p->frame[3 + k]);
            monomials(p, local[0], local[1], power);
            area *= p->size * p->size;
            for (int n = 0; n < NODES; n++)
                rule->weight[q][n] = 0.0;
            for (int n = 0; n < p->nodes; n++) {
                double value = 0.0;
                for (int m = 0; m < p->nodes; m++)
                    value += p->coefficients[n * p->nodes + m] * power[m];
                rule->weight[q][n] = area * value;
            }
        }
    for (; q % LANES; q++) {
        for (int k = 0; k < 3; k++)
            rule->x[k][q] = rule->x[k][q - 1];
        for (int n = 0; n < NODES; n++)
            rule->weight[q][n] = 0.0;
    }
    rule->count = q;
}

/* r r/r³ (6), and w r r/r⁵ (6), r/r³ (3) at vectors r = (x, y, z). */
INLINE void products_of(Vector x, Vector y, Vector z, const double *normal, int wants_g, int wants_h, Vector *out)
{
    Vector square = x * x + y * y + z * z, over;
    for (int l = 0; l < LANES; l++)
        over[l] = sqrt(square[l]);
    over = 1.0 / over;
    Vector cube = over * over * over, xx = x * x, yy = y * y, zz = z * z, xy = x * y, xz = x * z, yz = y * z;
    if (wants_g) {
        out[0] = xx * cube;
        out[1] = xy * cube;
        out[2] = xz * cube;
        out[3] = yy * cube;
        out[4] = yz * cube;
        out[5] = zz * cube;
    }
    if (wants_h) {
        Vector fifth = (x * normal[0] + y * normal[1] + z * normal[2]) * (cube * over * over);
        out[6] = xx * fifth;
        out[7] = xy * fifth;
        out[8] = xz * fifth;
        out[9] = yy * fifth;
        out[10] = yz * fifth;
        out[11] = zz * fifth;
        out[12] = x * cube;
        out[13] = y * cube;
        out[14] = z * cube;
    }
}

/* One target's integrals of the products against one basis function: 2µU (6, upper triangle) and T (9), at `stride`. */
INLINE void kernels_of(const double *sums, const double *normal, double nu, int wants_g, int wants_h, double *out, int64_t stride)
{
    const double scale = 1.0 / (8.0 * PI * (1.0 - nu)), one_2nu = 1.0 - 2.0 * nu;
    static const int place[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
    if (wants_g) {
        double part = (3.0 - 4.0 * nu) * (sums[0] + sums[3] + sums[5]);
        for (int c = 0; c < G; c++)
            out[c * stride] = scale * (sums[c] + (c == 0 || c == 3 || c == 5 ? part : 0.0));
    }
    if (wants_h) {
        const double *d = sums + G, *f = sums + 2 * G;
        double part = one_2nu * (d[0] + d[3] + d[5]);
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++) {
                double twist = one_2nu * (f[i] * normal[j] - f[j] * normal[i]);
                out[(G + 3 * i + j) * stride] = scale * (twist - 3.0 * d[place[i][j]] - (i == j ? part : 0.0));
            }
    }
}

/* A rule's points as sources for some targets of a chunk: the same sums in the same order whatever the vectors hold. */
INLINE void far(const Panel *p, const Rule *rule, double nu, int count, const int *target, double (*x)[CHUNK], int wants_g,
                int wants_h, double *values)
{
    const double *normal = p->frame + 6;
    const int low = wants_g ? 0 : G, high = wants_h ? ALL : G;
    Vector k[4][ALL];
    for (int first = 0; first < count; first += LANES) {
        const int some = count - first < LANES ? count - first : LANES;
        if (some < FEW) {
            for (int i = first; i < first + some; i++) {
                const int t = target[i];
                Vector sums[ALL][NODES / LANES];
                const int wide = (p->nodes + LANES - 1) / LANES;
                for (int c = low; c < high; c++)
                    for (int n = 0; n < wide; n++)
                        sums[c][n] = (Vector){0.0};
                for (int q = 0; q < rule->count; q += LANES) {
                    Vector r[3];
                    for (int c = 0; c < 3; c++) {
                        memcpy(r + c, rule->x[c] + q, sizeof(Vector));
                        r[c] -= x[c][t];
                    }
                    products_of(r[0], r[1], r[2], normal, wants_g, wants_h, k[0]);
                    for (int n = 0; n < wide; n++)
                        for (int l = 0; l < LANES; l++) {
                            Vector weight;
                            memcpy(&weight, rule->weight[q + l] + n * LANES, sizeof weight);
                            for (int c = low; c < high; c++)
                                sums[c][n] += weight * k[0][c][l];
                        }
                }
                for (int n = 0; n < p->nodes; n++) {
                    double own[ALL];
                    for (int c = low; c < high; c++)
                        own[c] = sums[c][n / LANES][n % LANES];
                    kernels_of(own, normal, nu, wants_g, wants_h, values + n * ALL * CHUNK + t, CHUNK);
                }
            }
            continue;
        }
        Vector at[3] = {{0.0}}, sums[NODES][ALL];
        for (int c = 0; c < 3; c++)
            for (int l = 0; l < LANES; l++)
                at[c][l] = x[c][target[first + (l < some ? l : some - 1)]];
        for (int n = 0; n < p->nodes; n++)
            for (int c = low; c < high; c++)
                sums[n][c] = (Vector){0.0};
        for (int q = 0; q < rule->count; q += 4) {
            for (int j = 0; j < 4; j++)
                products_of(rule->x[0][q + j] - at[0], rule->x[1][q + j] - at[1], rule->x[2][q + j] - at[2], normal, wants_g,
                            wants_h, k[j]);
            for (int c = low; c < high; c++) {
                const Vector k0 = k[0][c], k1 = k[1][c], k2 = k[2][c], k3 = k[3][c];
                for (int n = 0; n < p->nodes; n++) {
                    Vector sum = sums[n][c] + rule->weight[q][n] * k0;
                    sum += rule->weight[q + 1][n] * k1;
                    sum += rule->weight[q + 2][n] * k2;
                    sums[n][c] = sum + rule->weight[q + 3][n] * k3;
                }
            }
        }
        for (int n = 0; n < p->nodes; n++)
            for (int l = 0; l < some; l++) {
                double own[ALL];
                for (int c = low; c < high; c++)
                    own[c] = sums[n][c][l];
                kernels_of(own, normal, nu, wants_g, wants_h, values + n * ALL * CHUNK + target[first + l], CHUNK);
            }
    }
}

/* From monomials about (x, y) to those about the origin of local coordinates, one sum for each. */
INLINE void shift(const Panel *p, double x, double y, double (*sums)[HIGHEST + 1])
{
    for (int b = 0; b <= p->order; b++) {
        int last = p->corners == 4 ? p->order : p->order - b;
        for (int step = 0; step < last; step++)
            for (int a = last; a > step; a--)
                sums[a][b] += x * sums[a - 1][b];
    }
    for (int a = 0; a <= p->order; a++) {
        int last = p->corners == 4 ? p->order : p->order - a;
        for (int step = 0; step < last; step++)
            for (int b = last; b > step; b--)
                sums[a][b] += y * sums[a][b - 1];
    }
}

/* One pair in closed form; (x, y) the target in local coordinates, its plane by w above it. */
INLINE void near(const Panel *p, double x, double y, double w, double nu, int wants_g, int wants_h, double *values)
{
    enum { LOCAL = 14 };                   /* U: 6, T: 6 of its symmetric part and 2 of the other */
    const double one_2nu = 1.0 - 2.0 * nu, scale = 1.0 / (8.0 * PI * (1.0 - nu));
    Moments m;
    moments_of(p->polygon, p->corners, x, y, w, p->order, p->degree, wants_h, &m);
    double local[LOCAL][HIGHEST + 1][HIGHEST + 1];
    for (int a = 0; a <= p->order; a++)
        for (int b = 0; b <= (p->corners == 4 ? p->order : p->order - a); b++) {
            if (wants_g) {
                double part = (3.0 - 4.0 * nu) * m.m_1[a][b];
                local[0][a][b] = part + m.m_3[a + 2][b];
                local[1][a][b] = m.m_3[a + 1][b + 1];
                local[2][a][b] = m.p[a + 1][b];
                local[3][a][b] = part + m.m_3[a][b + 2];
                local[4][a][b] = m.p[a][b + 1];
                local[5][a][b] = part + w * m.p[a][b];
            }
            if (wants_h) {
                double part = one_2nu * m.p[a][b];
                local[6][a][b] = part + m.q[a + 2][b];
                local[7][a][b] = m.q[a + 1][b + 1];
                local[8][a][b] = w * m.q[a + 1][b];
                local[9][a][b] = part + m.q[a][b + 2];
                local[10][a][b] = w * m.q[a][b + 1];
                local[11][a][b] = part + (a + b ? w * w * m.q[a][b] : m.w_q);
                local[12][a][b] = one_2nu * m.m_3[a + 1][b];
                local[13][a][b] = one_2nu * m.m_3[a][b + 1];
            }
        }
    const double *f = p->frame;
    const int low = wants_g ? 0 : G, high = wants_h ? LOCAL : G;
    static const int place[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};
    for (int c = low; c < high; c++)
        shift(p, x, y, local[c]);
    for (int n = 0; n < p->nodes; n++) {
        double nodal[LOCAL], *out = values + n * ALL * CHUNK;
        const double *coefficients = p->coefficients + n * p->nodes;
        for (int c = low; c < high; c++) {
            double sum = 0.0;
            for (int a = 0, k = 0; a <= p->order; a++)
                for (int b = 0; b <= (p->corners == 4 ? p->order : p->order - a); b++)
                    sum += coefficients[k++] * local[c][a][b];
            nodal[c] = sum;
        }
        for (int part = wants_g ? 0 : 1; part < (wants_h ? 2 : 1); part++) {
            const double *t = nodal + G * part;
            double half[3][3], turn[3];
            for (int i = 0; i < 3; i++)
                for (int b = 0; b < 3; b++)
                    half[i][b] = f[i] * t[place[0][b]] + f[3 + i] * t[place[1][b]] + f[6 + i] * t[place[2][b]];
            if (part)
                for (int i = 0; i < 3; i++)
                    turn[i] = f[i] * nodal[12] + f[3 + i] * nodal[13];
            for (int i = 0; i < 3; i++)
                for (int j = part ? 0 : i; j < 3; j++) {
                    double value = half[i][0] * f[j] + half[i][1] * f[3 + j] + half[i][2] * f[6 + j];
                    if (part)
                        out[(G + 3 * i + j) * CHUNK] = scale * ((turn[i] * f[6 + j] - turn[j] * f[6 + i]) - value);
                    else
                        out[place[i][j] * CHUNK] = scale * p->size * value;
                }
        }
    }
}

/* Values (nodes, 15, CHUNK) of one panel at the targets of a chunk. */
DISPATCHED void petcontact_panel(const double *record, int64_t kind, const Rules *rules, double nu, int64_t count,
                                 double (*x)[CHUNK], int wants_g, int wants_h, double *values)
{
    const Panel p = panel_of(record, kind);
    const double *least = rules->least[p.order], over = 1.0 / p.size;
    double local[3][CHUNK];
    int code[CHUNK], together[CHUNK];
    for (int t = 0; t < count; t++) {
        double r[3], beyond[2];
        int place[2];
        for (int c = 0; c < 3; c++)
            r[c] = x[c][t] - p.centre[c];
        for (int c = 0; c < 3; c++)
            local[c][t] = (p.frame[3 * c] * r[0] + p.frame[3 * c + 1] * r[1] + p.frame[3 * c + 2] * r[2]) * over;
        for (int c = 0; c < 2; c++) {
            beyond[c] = fabs(local[c][t] - p.middle[c]) - p.half[c];
            beyond[c] = beyond[c] > 0.0 ? beyond[c] : 0.0;
        }
        for (int c = 0; c < 2; c++) {
            double along = fabs(local[c][t] - p.middle[c]), z = local[2][t], half = p.half[c];
            double across = beyond[1 - c] * beyond[1 - c] + z * z;
            double mean = (0.5 / half) * (sqrt((along - half) * (along - half) + across)
                                          + sqrt((along + half) * (along + half) + across));
            place[c] = 0;
            for (int n = 0; n < RULES; n++)
                place[c] += mean < least[n];
        }
        if (!p.rectangular)
            place[0] = place[1] = place[0] > place[1] ? place[0] : place[1];
        int too_many = place[0] >= RULES || place[1] >= RULES
                       || rules->count[place[0]] * rules->count[place[1]] > rules->most[p.order];
        code[t] = too_many ? -1 : place[0] * RULES + place[1];
    }
    Rule rule;
    for (int t = 0; t < count; t++) {
        const int own = code[t];
        if (own == -1) {
            double w = fabs(local[2][t]) <= FLAT ? 0.0 : -local[2][t];
            near(&p, local[0][t], local[1][t], w, nu, wants_g, wants_h, values + t);
        }
        if (own < 0)
            continue;
        int alike = 0;
        for (int s = t; s < count; s++)
            if (code[s] == own) {
                together[alike++] = s;
                code[s] = -2;
            }
        rule_of(&p, rules, own / RULES, own % RULES, &rule);
        far(&p, &rule, nu, alike, together, x, wants_g, wants_h, values);
    }
}

static const int PLACE[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};

static void load_targets(int count, const double *points, const int64_t *rows, double (*x)[CHUNK])
{
    for (int t = 0; t < count; t++)
        for (int c = 0; c < 3; c++)
            x[c][t] = points[3 * (rows ? rows[t] : t) + c];
}

/* G and H, (3, 3, n, nodes, m) each or null, of n panels of one kind at m points. */
void petcontact_panels(int64_t n, const double *records, int64_t stride, int64_t kind, const Rules *rules, double nu, int64_t m,
                       const double *points, double *g, double *h)
{
    const int order = (int)(kind & 3), nodes = kind < 4 ? (order + 1) * (order + 1) : (order + 1) * (order + 2) / 2;
    const int64_t plane = n * nodes * m;
    double x[3][CHUNK], values[NODES * ALL * CHUNK];
    for (int64_t first = 0; first < m; first += CHUNK) {
        const int count = m - first < CHUNK ? (int)(m - first) : CHUNK;
        load_targets(count, points + 3 * first, 0, x);
        for (int64_t e = 0; e < n; e++) {
            petcontact_panel(records + e * stride, kind, rules, nu, count, x, g != 0, h != 0, values);
            for (int b = 0; b < nodes; b++)
                for (int i = 0; i < 9; i++) {
                    const double *from = values + b * ALL * CHUNK;
                    const int64_t to = i * plane + (e * nodes + b) * m + first;
                    if (g)
                        memcpy(g + to, from + PLACE[i / 3][i % 3] * CHUNK, count * sizeof(double));
                    if (h)
                        memcpy(h + to, from + (G + i) * CHUNK, count * sizeof(double));
                }
        }
    }
}

/* Three interleaved components a target: one node's values of G or of H times a vector. */
DISPATCHED void petcontact_contract(int64_t count, const double *values, int is_h, double x, double y, double z, double *out)
{
    const double *k[3][3];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            k[i][j] = values + (is_h ? G + 3 * i + j : PLACE[i][j]) * CHUNK;
    for (int i = 0; i < 3; i++)
        for (int t = 0; t < count; t++)
            out[3 * t + i] += k[i][0][t] * x + k[i][1][t] * y + k[i][2][t] * z;
}

/* Columns of the boundary operators of a mesh of flat panels.

   points (n, 3), element (n,), known (n, 3) and frame (n, 3, 3) are those of the whole mesh's nodes, first_node and kind of
   its panels, which have their numbers at record[e]; node i has the right-hand sides rhs_first[i] to rhs_first[i+1]-1,
   each G times a traction less (½ + H) times a displacement. Filled are, where not null, system (k, 3, m, 3) and beside
   (number of the columns' right-hand sides, m, 3), G in units of the length. */
void petcontact_panel_columns(
    int64_t m, const int64_t *rows, int64_t k, const int64_t *columns, const double *points, const int64_t *element,
    const int64_t *first_node, const int64_t *kind, const double *records, const int64_t *record, const Rules *rules,
    const int64_t *known, const double *frame, const int64_t *rhs_first, const double *rhs_traction,
    const double *rhs_displacement, double nu, double length, double *system, double *beside)
{
    const double unit = 1.0 / length;
    double x[3][CHUNK], values[NODES * ALL * CHUNK];
    for (int64_t first = 0; first < m; first += CHUNK) {
        const int count = m - first < CHUNK ? (int)(m - first) : CHUNK;
        const int64_t *row = rows + first;
        int64_t rhs = 0;
        load_targets(count, points, row, x);
        for (int64_t j = 0, last; j < k; j = last) {
            const int64_t e = element[columns[j]];
            int needs_g = 0, needs_h = 0;
            for (last = j; last < k && element[columns[last]] == e; last++) {
                const int64_t node = columns[last], *is_known = known + 3 * node;
                needs_g |= system && !(is_known[0] && is_known[1] && is_known[2]);
                needs_h |= system && (is_known[0] || is_known[1] || is_known[2]);
                for (int64_t q = 3 * rhs_first[node]; beside && q < 3 * rhs_first[node + 1]; q++) {
                    needs_g |= rhs_traction[q] != 0.0;
                    needs_h |= rhs_displacement[q] != 0.0;
                }
            }
            if (needs_g || needs_h)
                petcontact_panel(records + record[e], kind[e], rules, nu, count, x, needs_g, needs_h, values);
            for (int64_t i = j; i < last; i++) {
                const int64_t node = columns[i];
                const double *own_values = values + (node - first_node[e]) * ALL * CHUNK;
                int own = count;                               /* place of the node among the targets */
                if (row[0] <= node && node <= row[count - 1])
                    for (own = 0; own < count && row[own] != node;)
                        own++;
                for (int d = 0; system && d < 3; d++) {
                    const double *f = frame + 9 * node + 3 * d;
                    const double s = known[3 * node + d] ? 1.0 : -unit;
                    double *out = system + ((3 * i + d) * m + first) * 3;
                    memset(out, 0, 3 * count * sizeof(double));
                    petcontact_contract(count, own_values, known[3 * node + d] != 0, s * f[0], s * f[1], s * f[2], out);
                    for (int c = 0; known[3 * node + d] && own < count && c < 3; c++)
                        out[3 * own + c] += 0.5 * f[c];
                }
                for (int64_t q = rhs_first[node]; beside && q < rhs_first[node + 1]; q++, rhs++) {
                    const double *t = rhs_traction + 3 * q, *u = rhs_displacement + 3 * q;
                    double *out = beside + (rhs * m + first) * 3;
                    memset(out, 0, 3 * count * sizeof(double));
                    if (t[0] != 0.0 || t[1] != 0.0 || t[2] != 0.0)
                        petcontact_contract(count, own_values, 0, unit * t[0], unit * t[1], unit * t[2], out);
                    if (u[0] != 0.0 || u[1] != 0.0 || u[2] != 0.0)
                        petcontact_contract(count, own_values, 1, -u[0], -u[1], -u[2], out);
                    for (int c = 0; own < count && c < 3; c++)
                        out[3 * own + c] -= 0.5 * u[c];
                }
            }
        }
    }
}
