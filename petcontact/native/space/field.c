/* Displacement and stress inside a body: petcontact.bem.kelvin3d.stress in C, with the same formulas, contracted with the
   boundary data at the Gauss points; pairs of a flat panel and a point that are too near for these are left to the caller but
   for their displacement. */

#include "curved.h"
#include "polar.h"

enum { FIELD = 10 }; /* u (3), σ (xx, yy, zz, xy, xz, yz), and the share of the solid angle */

typedef struct { /* what a rule's points are loaded with: weighted traction, displacement, the weight itself, and the normal */
    double force[POINTS][3], jump[POINTS][3], weight[POINTS], normal[POINTS][3];
} Sources;

/* `data` are traction (3) and displacement (3) of the panel's nodes. */
INLINE void sources_of(const Panel *p, const Rule *rule, const double *data, Sources *s)
{
    for (int q = 0; q < rule->count; q++) {
        double sum[6] = {0.0}, all = 0.0;
        for (int n = 0; n < p->nodes; n++) {
            double weight = rule->scale * (rule->nodal && n != q ? 0.0 : rule->weight[q][n]);
            weight = p->shape ? weight * rule->area[q] : weight;
            all += weight;
            for (int c = 0; c < 6; c++)
                sum[c] += weight * data[6 * n + c];
        }
        memcpy(s->force[q], sum, sizeof s->force[q]);
        memcpy(s->jump[q], sum + 3, sizeof s->jump[q]);
        s->weight[q] = all;
        for (int c = 0; c < 3; c++)
            s->normal[q][c] = p->shape ? rule->normal[c][q] / rule->area[q] : p->frame[6 + c];
    }
}

/* One point's force f and displacement jump u on a plane of normal n, at targets r away. */
INLINE void add_source(const Vector *r, const double *n, const double *f, const double *u, double weight, double nu,
                       Vector *out)
{
    const double one_2nu = 1.0 - 2.0 * nu, nu_ = n[0] * u[0] + n[1] * u[1] + n[2] * u[2];
    const Vector square = r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
    Vector over = {0.0};
    for (int l = 0; l < LANES; l++)
        over[l] = sqrt(square[l]);
    over = 1.0 / over;
    const Vector over_2 = over * over, cube = over * over_2, fifth = cube * over_2;
    const Vector rn = r[0] * n[0] + r[1] * n[1] + r[2] * n[2];
    const Vector rf = r[0] * f[0] + r[1] * f[1] + r[2] * f[2], ru = r[0] * u[0] + r[1] * u[1] + r[2] * u[2];
    /* G f - T u */
    const Vector straight = (3.0 - 4.0 * nu) * over, turned = one_2nu * cube * rn;
    const Vector along = rf * cube + 3.0 * rn * ru * fifth - (one_2nu * nu_) * cube, across = one_2nu * ru * cube;
    for (int i = 0; i < 3; i++)
        out[i] += straight * f[i] + turned * u[i] + along * r[i] + across * n[i];
    /* D f + S u */
    const Vector force = one_2nu * cube,
                 bulk = -force * rf - 3.0 * one_2nu * fifth * rn * ru + ((1.0 - 4.0 * nu) * nu_) * cube;
    const Vector pair = 3.0 * (rf * fifth + 5.0 * rn * ru * fifth * over_2 - (one_2nu * nu_) * fifth);
    const Vector shear = -3.0 * nu * fifth * rn, bend = -3.0 * nu * fifth * ru;
    Vector with_r[3], with_n[3];
    for (int i = 0; i < 3; i++) {
        with_r[i] = force * f[i] + shear * u[i] + bend * n[i];
        with_n[i] = -force * u[i];
    }
    static const int I[6] = {0, 1, 2, 0, 0, 1}, J[6] = {0, 1, 2, 1, 2, 2};
    for (int c = 0; c < 6; c++) {
        const int i = I[c], j = J[c];
        const Vector both = with_r[i] * r[j] + with_r[j] * r[i] + with_n[i] * n[j] + with_n[j] * n[i] + pair * r[i] * r[j];
        out[3 + c] += c < 3 ? both + bulk : both;
    }
    out[9] += (2.0 * (1.0 - nu) * weight) * rn * cube;
}

INLINE void far_field(const Rule *rule, const Sources *s, double nu, Group group, double (*field)[CHUNK])
{
    const double scale = 1.0 / (8.0 * PI * (1.0 - nu));
    for (int first = 0; first < group.count; first += LANES) {
        const int some = group.count - first < LANES ? group.count - first : LANES;
        Vector at[3] = {{0.0}}, sum[FIELD];
        for (int c = 0; c < 3; c++)
            for (int l = 0; l < LANES; l++)
                at[c][l] = group.targets->x[c][group.target[first + (l < some ? l : some - 1)]];
        for (int c = 0; c < FIELD; c++)
            sum[c] = (Vector){0.0};
        for (int q = 0; q < rule->count; q++) {
            const Vector r[3] = {rule->x[0][q] - at[0], rule->x[1][q] - at[1], rule->x[2][q] - at[2]};
            add_source(r, s->normal[q], s->force[q], s->jump[q], s->weight[q], nu, sum);
        }
        for (int c = 0; c < FIELD; c++)
            for (int l = 0; l < some; l++)
                field[c][group.target[first + l]] += scale * sum[c][l];
    }
}

/* A target near a curved panel, or on it: points in polar coordinates about its foot. */
INLINE void near_field(const Panel *p, const Family *family, const Targets *targets, int t, const double *data, Rule *rule,
                       Sources *sources, double (*room)[NODES], double (*field)[CHUNK])
{
    const double x[3] = {targets->x[0][t], targets->x[1][t], targets->x[2][t]};
    const Near *near = near_of(family);
    Rays rays;
    Four rho[MOST], weight[MOST];
    double xi[POINTS], eta[POINTS];
    petcontact_rays(p, near, x, &rays);
    for (int first = 0; first < rays.count; first += 4) {
        const int count = points_along(&rays, near, first, rho, weight);
        for (int k = 0, q = 0; k < count; k++) {
            for (int l = 0; l < 4; l++, q++) {
                double power[NODES];
                xi[q] = rays.foot[0] + rho[k][l] * rays.xi[first + l];
                eta[q] = rays.foot[1] + rho[k][l] * rays.eta[first + l];
                monomials(p, xi[q], eta[q], power);
                for (int n = 0; n < p->nodes; n++) {
                    room[q][n] = 0.0;
                    for (int m = 0; m < p->nodes; m++)
                        room[q][n] += weight[k][l] * near->coefficients[m][n] * power[m];
                }
            }
            if (q < POINTS && k < count - 1)
                continue;
            points_of(p, xi, eta, q, rule);
            rule->weight = (const double(*)[NODES])room;
            rule->nodal = q = 0;
            sources_of(p, rule, data, sources);
            far_field(rule, sources, family->nu, (Group){1, &t, targets}, field);
        }
    }
}

/* One pair in closed form: the displacement, and the solid angle. */
INLINE void near_displacement(const Panel *p, const double *place, double nu, const double *data, double (*field)[CHUNK],
                              int t)
{
    double values[NODES * ALL];
    petcontact_near(p, place, nu, (Wanted){1, 1, 0, p->nodes}, values, 1);
    for (int n = 0; n < p->nodes; n++) {
        const double *g = values + n * ALL, *h = g + G, *f = data + 6 * n, *u = f + 3;
        for (int i = 0; i < 3; i++) {
            for (int j = 0; j < 3; j++)
                field[i][t] += g[PLACE[i][j]] * f[j] - h[3 * i + j] * u[j];
            field[9][t] -= h[4 * i] / 3.0;
        }
    }
}

/* field (m, 10) of n panels of one kind at m points: 2µ u [traction · length] and the stress from tractions and displacements
   over 1/2µ, data (n nodes, 6), and the share of the solid angle that the panels take; `close` (n, m) becomes 1 for the
   pairs whose stress is missing. */
DISPATCHED void petcontact_panel_field(const Family *family, int64_t n, const double *records, int64_t stride, int64_t m,
                                       const double *points, const double *data, double *field, char *close)
{
    const int nodes = nodes_of(family->kind);
    Targets t;
    Rule rule;
    Sources sources;
    double local[3][CHUNK], room[POINTS][NODES], sums[FIELD][CHUNK];
    int code[CHUNK], together[CHUNK];
    for (int64_t first = 0; first < m; first += CHUNK) {
        load_targets(m - first < CHUNK ? (int)(m - first) : CHUNK, points + 3 * first, 0, &t);
        memset(sums, 0, sizeof sums);
        for (int64_t e = 0; e < n; e++) {
            const Panel p = panel_of(records + e * stride, family->kind);
            const double *own_data = data + 6 * nodes * e;
            choose(&p, family->rules, &t, local, code);
            for (int i = 0; i < t.count; i++) {
                const int own = code[i];
                if (own > -2)
                    close[e * m + first + i] = own == -1 && !p.shape;
                if (own == -1 && p.shape)
                    near_field(&p, family, &t, i, own_data, &rule, &sources, room, sums);
                else if (own == -1) {
                    const double place[3] = {local[0][i], local[1][i], fabs(local[2][i]) <= FLAT ? 0.0 : -local[2][i]};
                    near_displacement(&p, place, family->nu, own_data, sums, i);
                }
                if (own < 0)
                    continue;
                int alike = 0;
                for (int s = i; s < t.count; s++)
                    if (code[s] == own) {
                        together[alike++] = s;
                        code[s] = -2;
                    }
                if (p.shape)
                    curved_rule_of(&p, family, own / RULES, own % RULES, &rule);
                else
                    rule_of(&p, family->rules, family->weights, own / RULES, own % RULES, room, &rule);
                sources_of(&p, &rule, own_data, &sources);
                far_field(&rule, &sources, family->nu, (Group){alike, together, &t}, sums);
            }
        }
        for (int i = 0; i < t.count; i++)
            for (int c = 0; c < FIELD; c++)
                field[FIELD * (first + i) + c] = sums[c][i];
    }
}
