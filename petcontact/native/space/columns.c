/* Both kernels of space over panels of order 0 to 3: petcontact.bem.kelvin3d.integrals in C, with the same formulas and the
   same choice of Gauss points from afar; see there. */

#include "curved.h"
#include "sources.h"

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
        if (own == -1 && p.shape)
            petcontact_near_curved(&p, family, targets, t, wanted, values);
        else if (own == -1) {
            const double place[3] = {local[0][t], local[1][t], fabs(local[2][t]) <= FLAT ? 0.0 : -local[2][t]};
            petcontact_near(&p, place, family->nu, wanted, values + t, targets->width);
        }
        if (own < 0)
            continue;
        int alike = 0;
        for (int s = t; s < count; s++)
            if (code[s] == own) {
                together[alike++] = s;
                code[s] = -2;
            }
        const Group group = {alike, together, targets};
        if (p.shape) {
            curved_rule_of(&p, family, own / RULES, own % RULES, &rule);
            far(&p, &rule, family->nu, group, wanted, 1, values);
        } else {
            rule_of(&p, rules, family->weights, own / RULES, own % RULES, room, &rule);
            far(&p, &rule, family->nu, group, wanted, 0, values);
        }
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
    const Rules *const *rules; /* both by kind */
    const double *const *weights;
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

/* Columns of the boundary operators of a mesh of panels, a `Filler` (hmatrix.c): where they are not null, system
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
            const Family family = {a->kind[e], a->rules[a->kind[e]], a->weights[a->kind[e]], a->nu};
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
