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
INLINE void far(const Panel *p, const Rule *rule, double nu, int count, const int *target, double (*x)[CHUNK], int wants_g,
                int wants_h, int node, int last_node, double *values, int width)
{
    const double *normal = p->frame + 6;
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

/* Values (nodes, 15, width) of one panel at the targets of a chunk, of the nodes from `node` to before `last_node`. */
DISPATCHED void petcontact_panel(const double *record, int64_t kind, const Rules *rules, const double *weights, double nu,
                                 int64_t count, double (*x)[CHUNK], int wants_g, int wants_h, int node, int last_node,
                                 double *values, int width)
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
        if (!p.upright)
            place[0] = place[1] = place[0] > place[1] ? place[0] : place[1];
        int too_many = place[0] >= RULES || place[1] >= RULES
                       || rules->count[place[0]] * rules->count[place[1]] > rules->most[p.order];
        code[t] = too_many ? -1 : place[0] * RULES + place[1];
    }
    Rule rule;
    double room[POINTS][NODES];
    for (int t = 0; t < count; t++) {
        const int own = code[t];
        if (own == -1) {
            double w = fabs(local[2][t]) <= FLAT ? 0.0 : -local[2][t];
            near(&p, local[0][t], local[1][t], w, nu, wants_g, wants_h, node, last_node, values + t, width);
        }
        if (own < 0)
            continue;
        int alike = 0;
        for (int s = t; s < count; s++)
            if (code[s] == own) {
                together[alike++] = s;
                code[s] = -2;
            }
        rule_of(&p, rules, weights, own / RULES, own % RULES, room, &rule);
        far(&p, &rule, nu, alike, together, x, wants_g, wants_h, node, last_node, values, width);
    }
}

static void load_targets(int count, const double *points, const int64_t *rows, double (*x)[CHUNK])
{
    for (int t = 0; t < count; t++)
        for (int c = 0; c < 3; c++)
            x[c][t] = points[3 * (rows ? rows[t] : t) + c];
}

/* G and H, (3, 3, n, nodes, m) each or null, of n panels of one kind at m points. */
void petcontact_panels(int64_t n, const double *records, int64_t stride, int64_t kind, const Rules *rules,
                       const double *weights, double nu, int64_t m, const double *points, double *g, double *h)
{
    const int order = (int)(kind & 3), nodes = kind < 4 ? (order + 1) * (order + 1) : (order + 1) * (order + 2) / 2;
    const int64_t plane = n * nodes * m;
    double x[3][CHUNK], values[NODES * ALL * CHUNK];
    for (int64_t first = 0; first < m; first += CHUNK) {
        const int count = m - first < CHUNK ? (int)(m - first) : CHUNK;
        const int width = (count + LANES - 1) / LANES * LANES;
        load_targets(count, points + 3 * first, 0, x);
        for (int64_t e = 0; e < n; e++) {
            petcontact_panel(records + e * stride, kind, rules, weights, nu, count, x, g != 0, h != 0, 0, nodes, values, width);
            for (int b = 0; b < nodes; b++)
                for (int i = 0; i < 9; i++) {
                    const double *from = values + b * ALL * width;
                    const int64_t to = i * plane + (e * nodes + b) * m + first;
                    if (g)
                        memcpy(g + to, from + PLACE[i / 3][i % 3] * width, count * sizeof(double));
                    if (h)
                        memcpy(h + to, from + (G + i) * width, count * sizeof(double));
                }
        }
    }
}

/* Three interleaved components a target: one node's values of G or of H times a vector; added, or instead. */
INLINE void contract(int count, const double *values, int width, int is_h, double x, double y, double z, int adds, double *out)
{
    for (int i = 0; i < 3; i++) {
        const double *k[3];
        for (int j = 0; j < 3; j++)
            k[j] = values + (is_h ? G + 3 * i + j : PLACE[i][j]) * width;
        if (count == 1)
            out[i] = (adds ? out[i] : 0.0) + (k[0][0] * x + k[1][0] * y + k[2][0] * z);
        else if (adds)
            for (int t = 0; t < count; t++)
                out[3 * t + i] += k[0][t] * x + k[1][t] * y + k[2][t] * z;
        else
            for (int t = 0; t < count; t++)
                out[3 * t + i] = k[0][t] * x + k[1][t] * y + k[2][t] * z;
    }
}

/* Columns of the boundary operators of a mesh of flat panels.

   points (n, 3), element (n,), known (n, 3) and frame (n, 3, 3) are those of the whole mesh's nodes, first_node and kind of
   its panels, which have their numbers at record[e]; node i has the right-hand sides rhs_first[i] to rhs_first[i+1]-1,
   each G times a traction less (½ + H) times a displacement. Filled are, where not null, system (k, 3, m, 3) and beside
   (number of the columns' right-hand sides, m, 3), G in units of the length. */
DISPATCHED void petcontact_panel_columns(
    int64_t m, const int64_t *rows, int64_t k, const int64_t *columns, const double *points, const int64_t *element,
    const int64_t *first_node, const int64_t *kind, const double *records, const int64_t *record, const Rules *rules,
    const double *const *weights, const int64_t *known, const double *frame, const int64_t *rhs_first, const double *rhs_traction,
    const double *rhs_displacement, double nu, double length, double *system, double *beside)
{
    const double unit = 1.0 / length;
    double x[3][CHUNK], values[NODES * ALL * CHUNK];
    for (int64_t first = 0; first < m; first += CHUNK) {
        const int count = m - first < CHUNK ? (int)(m - first) : CHUNK;
        const int64_t *row = rows + first;
        const int width = (count + LANES - 1) / LANES * LANES;
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
                petcontact_panel(records + record[e], kind[e], rules, weights[kind[e]], nu, count, x, needs_g, needs_h,
                                 (int)(columns[j] - first_node[e]), (int)(columns[last - 1] - first_node[e]) + 1, values, width);
            for (int64_t i = j; i < last; i++) {
                const int64_t node = columns[i];
                const double *own_values = values + (node - first_node[e]) * ALL * width;
                int own = count;                               /* place of the node among the targets */
                if (row[0] <= node && node <= row[count - 1])
                    for (own = 0; own < count && row[own] != node;)
                        own++;
                for (int d = 0; system && d < 3; d++) {
                    const double *f = frame + 9 * node + 3 * d;
                    const int is_h = known[3 * node + d] != 0;
                    const double s = is_h ? 1.0 : -unit;
                    double *out = system + ((3 * i + d) * m + first) * 3;
                    contract(count, own_values, width, is_h, s * f[0], s * f[1], s * f[2], 0, out);
                    for (int c = 0; is_h && own < count && c < 3; c++)
                        out[3 * own + c] += 0.5 * f[c];
                }
                for (int64_t q = rhs_first[node]; beside && q < rhs_first[node + 1]; q++, rhs++) {
                    const double *t = rhs_traction + 3 * q, *u = rhs_displacement + 3 * q;
                    double *out = beside + (rhs * m + first) * 3;
                    const int pushed = t[0] != 0.0 || t[1] != 0.0 || t[2] != 0.0;
                    if (pushed)
                        contract(count, own_values, width, 0, unit * t[0], unit * t[1], unit * t[2], 0, out);
                    else
                        memset(out, 0, 3 * count * sizeof(double));
                    if (u[0] != 0.0 || u[1] != 0.0 || u[2] != 0.0)
                        contract(count, own_values, width, 1, -u[0], -u[1], -u[2], 1, out);
                    for (int c = 0; own < count && c < 3; c++)
                        out[3 * own + c] -= 0.5 * u[c];
                }
            }
        }
    }
}

/* The same as a function of one context: what is the mesh's, in the order of `petcontact_panel_columns`. */
typedef struct {
    const double *points;
    const int64_t *element, *first_node, *kind;
    const double *records;
    const int64_t *record;
    const Rules *rules;
    const double *const *weights;
    const int64_t *known;
    const double *frame;
    const int64_t *rhs_first;
    const double *rhs_traction, *rhs_displacement;
    double nu, length;
} Mesh;

void petcontact_panel_filler(const void *context, int64_t m, const int64_t *rows, int64_t k, const int64_t *columns,
                             double *system, double *beside)
{
    const Mesh *a = context;
    petcontact_panel_columns(m, rows, k, columns, a->points, a->element, a->first_node, a->kind, a->records, a->record, a->rules,
                             a->weights, a->known, a->frame, a->rhs_first, a->rhs_traction, a->rhs_displacement, a->nu,
                             a->length, system, beside);
}
