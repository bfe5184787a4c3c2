/* Both kernels of space over flat panels of order 0 to 3: petcontact.bem.kelvin3d.integrals in C, with the same formulas and
   the same choice of Gauss points from afar; see there. */

#include "near.h"

/* r r/r³ (6), and w r r/r⁵ (6), r/r³ (3) at vectors r. */
INLINE void products_of(const Vector *r, const double *normal, int wants_g, int wants_h, Vector *out)
{
    const Vector x = r[0], y = r[1], z = r[2], square = x * x + y * y + z * z;
    Vector over = {0.0};
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

/* Integrals of the products against basis functions to 2µU (6, upper triangle) and T (9), in their place. */
INLINE void kernels_of(Vector *sums, const double *normal, double nu, double factor, int wants_g, int wants_h)
{
    const double scale = factor / (8.0 * PI * (1.0 - nu)), one_2nu = 1.0 - 2.0 * nu;
    if (wants_g) {
        const Vector part = (3.0 - 4.0 * nu) * (sums[0] + sums[3] + sums[5]);
        for (int c = 0; c < G; c++)
            sums[c] = scale * (c == 0 || c == 3 || c == 5 ? sums[c] + part : sums[c]);
    }
    if (wants_h) {
        Vector d[6], f[3];
        memcpy(d, sums + G, sizeof d);
        memcpy(f, sums + 2 * G, sizeof f);
        const Vector part = one_2nu * (d[0] + d[3] + d[5]);
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++) {
                const Vector value = one_2nu * (f[i] * normal[j] - f[j] * normal[i]) - 3.0 * d[PLACE[i][j]];
                sums[G + 3 * i + j] = scale * (i == j ? value - part : value);
            }
    }
}

/* A rule's points as sources for some targets of a chunk: the same sums in the same order whatever the vectors hold. */
INLINE void far(const Panel *p, const Rule *rule, double nu, Group group, Wanted wanted, double *values)
{
    const int wants_g = wanted.g, wants_h = wanted.h, node = wanted.node, last_node = wanted.last;
    const int count = group.count, *target = group.target, width = group.targets->width;
    const double(*x)[CHUNK] = group.targets->x, *normal = p->frame + 6;
    const int low = wants_g ? 0 : G, high = wants_h ? ALL : G;
    Vector k[4][ALL];
    for (int first = 0; first < count; first += LANES) {
        const int some = count - first < LANES ? count - first : LANES;
        if (some < FEW) {
            for (int i = first; i < first + some; i++) {
                const int t = target[i], wide = (p->nodes + LANES - 1) / LANES;
                Vector sums[NODES / LANES][ALL];
                for (int n = 0; n < wide; n++)
                    for (int c = low; c < high; c++)
                        sums[n][c] = (Vector){0.0};
                for (int q = 0; q < rule->count; q += LANES) {
                    Vector r[3];
                    for (int c = 0; c < 3; c++) {
                        memcpy(r + c, rule->x[c] + q, sizeof(Vector));
                        r[c] -= x[c][t];
                    }
                    products_of(r, normal, wants_g, wants_h, k[0]);
                    if (rule->nodal) {
                        Vector weight = {0.0};
                        for (int l = 0; l < LANES && q + l < p->nodes; l++)
                            weight[l] = rule->weight[q + l][q + l];
                        for (int c = low; c < high; c++)
                            sums[q / LANES][c] = weight * k[0][c];
                        continue;
                    }
                    for (int n = 0; n < wide; n++) {
                        Vector weight[LANES];
                        for (int l = 0; l < LANES; l++)
                            memcpy(weight + l, rule->weight[q + l] + n * LANES, sizeof(Vector));
                        for (int c = low; c < high; c++) {
                            Vector sum = sums[n][c];
                            for (int l = 0; l < LANES; l++)
                                sum += weight[l] * k[0][c][l];
                            sums[n][c] = sum;
                        }
                    }
                }
                for (int n = 0; n < wide; n++) {
                    kernels_of(sums[n], normal, nu, rule->scale, wants_g, wants_h);
                    for (int l = 0; l < LANES && n * LANES + l < p->nodes; l++)
                        for (int c = low; c < high; c++)
                            values[((n * LANES + l) * ALL + c) * width + t] = sums[n][c][l];
                }
            }
            continue;
        }
        const int together = some == LANES && target[first + LANES - 1] == target[first] + LANES - 1;
        Vector at[3] = {{0.0}}, sums[NODES][ALL];
        for (int c = 0; c < 3; c++)
            for (int l = 0; l < LANES; l++)
                at[c][l] = x[c][target[first + (l < some ? l : some - 1)]];
        for (int n = node; n < last_node; n++) {
            for (int c = low; c < high; c++)
                sums[n][c] = (Vector){0.0};
            if (rule->nodal) {
                const Vector r[3] = {rule->x[0][n] - at[0], rule->x[1][n] - at[1], rule->x[2][n] - at[2]};
                products_of(r, normal, wants_g, wants_h, k[0]);
                for (int c = low; c < high; c++)
                    sums[n][c] = rule->weight[n][n] * k[0][c];
            }
        }
        for (int q = 0; !rule->nodal && q < rule->count; q += 4) {
            for (int j = 0; j < 4; j++) {
                const Vector r[3] = {rule->x[0][q + j] - at[0], rule->x[1][q + j] - at[1], rule->x[2][q + j] - at[2]};
                products_of(r, normal, wants_g, wants_h, k[j]);
            }
            for (int c = low; c < high; c++) {
                const Vector k0 = k[0][c], k1 = k[1][c], k2 = k[2][c], k3 = k[3][c];
                for (int n = node; n < last_node; n++) {
                    Vector sum = sums[n][c] + rule->weight[q][n] * k0;
                    sum += rule->weight[q + 1][n] * k1;
                    sum += rule->weight[q + 2][n] * k2;
                    sums[n][c] = sum + rule->weight[q + 3][n] * k3;
                }
            }
        }
        for (int n = node; n < last_node; n++) {
            double *out = values + n * ALL * width;
            kernels_of(sums[n], normal, nu, rule->scale, wants_g, wants_h);
            for (int c = low; c < high; c++)
                if (together)
                    memcpy(out + c * width + target[first], &sums[n][c], sizeof(Vector));
                else
                    for (int l = 0; l < some; l++)
                        out[c * width + target[first + l]] = sums[n][c][l];
        }
    }
}

/* Values (nodes, 15, width) of one panel at the targets of a chunk, of the nodes that are wanted. */
DISPATCHED void petcontact_panel(const double *record, const Family *family, const Targets *targets, Wanted wanted,
                                 double *values)
{
    const Panel p = panel_of(record, family->kind);
    const Rules *rules = family->rules;
    const int count = targets->count;
    double local[3][CHUNK];
    int code[CHUNK], together[CHUNK];
    choose(&p, rules, targets, local, code);
    Rule rule;
    double room[POINTS][NODES];
    for (int t = 0; t < count; t++) {
        const int own = code[t];
        if (own == -1) {
            const double place[3] = {local[0][t], local[1][t], fabs(local[2][t]) <= FLAT ? 0.0 : -local[2][t]};
            near(&p, place, family->nu, wanted, values + t, targets->width);
        }
        if (own < 0)
            continue;
        int alike = 0;
        for (int s = t; s < count; s++)
            if (code[s] == own) {
                together[alike++] = s;
                code[s] = -2;
            }
        rule_of(&p, rules, family->weights, own / RULES, own % RULES, room, &rule);
        far(&p, &rule, family->nu, (Group){alike, together, targets}, wanted, values);
    }
}

/* G and H, (3, 3, n, nodes, m) each or null, of n panels of one kind at m points. */
void petcontact_panels(const Family *family, int64_t n, const double *records, int64_t stride, int64_t m,
                       const double *points, double *g, double *h)
{
    const int nodes = nodes_of(family->kind);
    const int64_t plane = n * nodes * m;
    const Wanted w = {g != 0, h != 0, 0, nodes};
    Targets t;
    double values[NODES * ALL * CHUNK];
    for (int64_t first = 0; first < m; first += CHUNK) {
        load_targets(m - first < CHUNK ? (int)(m - first) : CHUNK, points + 3 * first, 0, &t);
        for (int64_t e = 0; e < n; e++) {
            petcontact_panel(records + e * stride, family, &t, w, values);
            for (int b = 0; b < nodes; b++)
                for (int i = 0; i < 9; i++) {
                    const double *from = values + b * ALL * t.width;
                    const int64_t to = i * plane + (e * nodes + b) * m + first;
                    if (g)
                        memcpy(g + to, from + PLACE[i / 3][i % 3] * t.width, t.count * sizeof(double));
                    if (h)
                        memcpy(h + to, from + (G + i) * t.width, t.count * sizeof(double));
                }
        }
    }
}

/* Three interleaved components a target: one node's values of G or of H times a vector; added, or instead. */
INLINE void contract(const Targets *t, const double *values, int is_h, const double *v, int adds, double *out)
{
    for (int i = 0; i < 3; i++) {
        const double *k[3];
        for (int j = 0; j < 3; j++)
            k[j] = values + (is_h ? G + 3 * i + j : PLACE[i][j]) * t->width;
        if (t->count == 1)
            out[i] = (adds ? out[i] : 0.0) + (k[0][0] * v[0] + k[1][0] * v[1] + k[2][0] * v[2]);
        else if (adds)
            for (int n = 0; n < t->count; n++)
                out[3 * n + i] += k[0][n] * v[0] + k[1][n] * v[1] + k[2][n] * v[2];
        else
            for (int n = 0; n < t->count; n++)
                out[3 * n + i] = k[0][n] * v[0] + k[1][n] * v[1] + k[2][n] * v[2];
    }
}

typedef struct {                                /* a mesh and what makes columns of G and H: bem.kernel.ColumnData */
    const double *points;                       /* (n, 3) */
    const int64_t *element, *first_node, *kind; /* (n,), (e + 1,), (e,) */
    const double *records;                      /* the numbers of panel e begin at record[e] */
    const int64_t *record;
    const Rules *rules;
    const double *const *weights; /* by kind */
    double nu, length;
    const int64_t *known;                          /* (n, 3) */
    const double *frame;                           /* (n, 3, 3) */
    const int64_t *rhs_first;                      /* (n + 1,) */
    const double *rhs_traction, *rhs_displacement; /* (q, 3) */
} Mesh;

/* Kernels and nodes that consecutive columns of one panel ask for. */
INLINE Wanted wanted_by(const Mesh *a, const int64_t *columns, int64_t count, int64_t first_node, int system, int beside)
{
    Wanted w = {0, 0, (int)(columns[0] - first_node), (int)(columns[count - 1] - first_node) + 1};
    for (int64_t j = 0; j < count; j++) {
        const int64_t node = columns[j], *known = a->known + 3 * node;
        w.g |= system && !(known[0] && known[1] && known[2]);
        w.h |= system && (known[0] || known[1] || known[2]);
        for (int64_t q = 3 * a->rhs_first[node]; beside && q < 3 * a->rhs_first[node + 1]; q++) {
            w.g |= a->rhs_traction[q] != 0.0;
            w.h |= a->rhs_displacement[q] != 0.0;
        }
    }
    return w;
}

/* Columns of the boundary operators of a mesh of flat panels, a `Filler` (hmatrix.c): where they are not null, system
   (k, 3, m, 3) and beside (number of the columns' right-hand sides, m, 3), G in units of the length; each right-hand side is
   G times a traction less (½ + H) times a displacement. */
DISPATCHED void petcontact_panel_columns(const void *mesh, int64_t m, const int64_t *rows, int64_t k, const int64_t *columns,
                                         double *system, double *beside)
{
    const Mesh *a = mesh;
    const double unit = 1.0 / a->length;
    Targets t;
    double values[NODES * ALL * CHUNK];
    for (int64_t first = 0; first < m; first += CHUNK) {
        const int64_t *row = rows + first;
        double *rhs = beside ? beside + 3 * first : 0;
        load_targets(m - first < CHUNK ? (int)(m - first) : CHUNK, a->points, row, &t);
        for (int64_t j = 0, last; j < k; j = last) {
            const int64_t e = a->element[columns[j]], first_node = a->first_node[e];
            for (last = j + 1; last < k && a->element[columns[last]] == e;)
                last++;
            const Wanted w = wanted_by(a, columns + j, last - j, first_node, system != 0, beside != 0);
            const Family family = {a->kind[e], a->rules, a->weights[a->kind[e]], a->nu};
            if (w.g || w.h)
                petcontact_panel(a->records + a->record[e], &family, &t, w, values);
            for (int64_t i = j; i < last; i++) {
                const int64_t node = columns[i], *known = a->known + 3 * node;
                const double *own_values = values + (node - first_node) * ALL * t.width;
                int own = t.count; /* place of the node among the targets */
                if (row[0] <= node && node <= row[t.count - 1])
                    for (own = 0; own < t.count && row[own] != node;)
                        own++;
                for (int d = 0; system && d < 3; d++) {
                    const double *f = a->frame + 9 * node + 3 * d, s = known[d] ? 1.0 : -unit;
                    const double vector[3] = {s * f[0], s * f[1], s * f[2]};
                    double *out = system + ((3 * i + d) * m + first) * 3;
                    contract(&t, own_values, known[d] != 0, vector, 0, out);
                    for (int c = 0; known[d] && own < t.count && c < 3; c++)
                        out[3 * own + c] += 0.5 * f[c];
                }
                for (int64_t q = a->rhs_first[node]; beside && q < a->rhs_first[node + 1]; q++, rhs += 3 * m) {
                    const double *f = a->rhs_traction + 3 * q, *u = a->rhs_displacement + 3 * q;
                    const double pushed[3] = {unit * f[0], unit * f[1], unit * f[2]}, moved[3] = {-u[0], -u[1], -u[2]};
                    if (f[0] != 0.0 || f[1] != 0.0 || f[2] != 0.0)
                        contract(&t, own_values, 0, pushed, 0, rhs);
                    else
                        memset(rhs, 0, 3 * t.count * sizeof(double));
                    if (u[0] != 0.0 || u[1] != 0.0 || u[2] != 0.0)
                        contract(&t, own_values, 1, moved, 1, rhs);
                    for (int c = 0; own < t.count && c < 3; c++)
                        rhs[3 * own + c] -= 0.5 * u[c];
                }
            }
        }
    }
}
