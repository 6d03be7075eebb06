/* AC1A on a round-rotor machine with its breaker open, as one would write it for one study:
   Runge-Kutta of order four, held and clamped limits, one output per step. What does not change
   during a run is computed before it. All per unit and s. */

#include <math.h>

#define SHORTEST 1e-4

struct data { /* the order is that of exfit's parameters */
    double TR, TB, TC, KA, TA, VAMAX, VAMIN, VRMAX, VRMIN, TE, KF, TF, KC, KD, KE, E1, SE1, E2, SE2;
    double Tpd0, Tppd0, Tpq0, Tppq0, H, D, Xd, Xq, Xpd, Xpq, Xppd, Xl, S10, S12;
    double vt0;
};

struct curve { double knee, gain; };

struct unit {
    struct data p;
    struct curve exciter, machine;
    double share, coupling;                       /* of the machine's fluxes */
    double wR, wB, wA, wE, wF, wd0, wdd0;         /* rates of the blocks, 0 for a bypass */
};

struct state { double eq, psi, vc, vl, va, ve, vf; };

static double rate(double T) { return T < SHORTEST ? 0.0 : 1.0 / T; }

static struct curve through(double e1, double s1, double e2, double s2)
{
    double low = fmin(e1, e2), high = fmax(e1, e2);
    double vlow = e1 < e2 ? e1 * s1 : e2 * s2, vhigh = e1 < e2 ? e2 * s2 : e1 * s1;
    double q = vhigh > 0.0 ? sqrt(vlow / vhigh) : 0.0;
    struct curve c;
    c.knee = (low - q * high) / (1.0 - q);
    c.gain = vhigh / ((high - c.knee) * (high - c.knee));
    return c;
}

static inline double saturation(const struct curve *c, double e)
{
    double above = e - c->knee;
    return above > 0.0 ? c->gain * above * above : 0.0;
}

static inline double rectifier(double ve, double load)
{
    const double root3 = sqrt(3.0);
    if (load <= 0.0)
        return ve;
    if (load <= root3 / 4.0 * ve)
        return ve - load * (1.0 / root3);
    if (load < 0.75 * ve)
        return sqrt(0.75 * ve * ve - load * load);
    return ve > load ? root3 * (ve - load) : 0.0;
}

static double supply(double efd, double load)
{
    const double root3 = sqrt(3.0);
    double first = efd + load / root3, second = sqrt((efd * efd + load * load) / 0.75);
    if (load <= 0.0)
        return efd;
    if (load <= root3 / 4.0 * first)
        return first;
    return load < 0.75 * second ? second : efd / root3 + load;
}

static inline double held(double slope, double x, double low, double high)
{
    return (x >= high && slope > 0.0) || (x <= low && slope < 0.0) ? 0.0 : slope;
}

static inline double within(double x, double low, double high)
{
    return x < low ? low : x > high ? high : x;
}

static inline double voltage(const struct unit *u, const struct state *s)
{
    double psi = u->wdd0 > 0.0 ? s->psi : s->eq;
    return u->share * s->eq + (1.0 - u->share) * psi;
}

static inline struct state slopes(const struct unit *u, const struct state *s, double vref)
{
    const struct data *p = &u->p;
    double psi = u->wdd0 > 0.0 ? s->psi : s->eq;
    double vt = voltage(u, s);
    double ifd = s->eq + u->coupling * (s->eq - psi) + saturation(&u->machine, vt);
    double vfe = p->KE * s->ve + saturation(&u->exciter, s->ve) + p->KD * ifd;
    struct state d;
    double vc = u->wR > 0.0 ? s->vc : vt;
    d.vc = (vt - s->vc) * u->wR;
    d.vf = (vfe - s->vf) * u->wF;
    double error = vref - vc - p->KF * d.vf;
    d.vl = (error - s->vl) * u->wB;
    double vl = u->wB > 0.0 ? s->vl + p->TC * d.vl : error;
    double va = within(u->wA > 0.0 ? s->va : p->KA * vl, p->VAMIN, p->VAMAX);
    d.va = held((p->KA * vl - s->va) * u->wA, s->va, p->VAMIN, p->VAMAX);
    double vr = within(va, p->VRMIN, p->VRMAX);
    d.ve = held((vr - vfe) * u->wE, s->ve, 0.0, INFINITY);
    double efd = rectifier(s->ve > 0.0 ? s->ve : 0.0, p->KC * ifd);
    d.eq = (efd - ifd) * u->wd0;
    d.psi = (s->eq - s->psi) * u->wdd0;
    return d;
}

static inline struct state moved(const struct state *s, double h, const struct state *d)
{
    struct state x = {
        s->eq + h * d->eq, s->psi + h * d->psi, s->vc + h * d->vc, s->vl + h * d->vl,
        s->va + h * d->va, s->ve + h * d->ve, s->vf + h * d->vf,
    };
    return x;
}

static inline void step(const struct unit *u, struct state *s, double vref, double h)
{
    struct state k1 = slopes(u, s, vref), at = moved(s, h / 2, &k1);
    struct state k2 = slopes(u, &at, vref);
    at = moved(s, h / 2, &k2);
    struct state k3 = slopes(u, &at, vref);
    at = moved(s, h, &k3);
    struct state k4 = slopes(u, &at, vref);
    at = moved(s, h / 6, &k1);
    at = moved(&at, h / 3, &k2);
    at = moved(&at, h / 3, &k3);
    *s = moved(&at, h / 6, &k4);
    s->va = within(s->va, u->p.VAMIN, u->p.VAMAX);
    s->ve = s->ve > 0.0 ? s->ve : 0.0;
}

static double start(struct unit *u, struct state *s)
{
    const struct data *p = &u->p;
    double inner = p->Xpd - p->Xl, v = p->vt0;
    u->share = (p->Xppd - p->Xl) / inner;
    u->coupling = (p->Xd - p->Xpd) * (p->Xpd - p->Xppd) / (inner * inner);
    u->machine = through(1.0, p->S10, 1.2, p->S12);
    u->exciter = through(p->E1, p->SE1, p->E2, p->SE2);
    u->wR = rate(p->TR), u->wB = rate(p->TB), u->wA = rate(p->TA), u->wE = 1.0 / p->TE;
    u->wF = rate(p->TF), u->wd0 = 1.0 / p->Tpd0, u->wdd0 = rate(p->Tppd0);
    double ifd = v + saturation(&u->machine, v);
    double ve = supply(ifd, p->KC * ifd);
    double vfe = p->KE * ve + saturation(&u->exciter, ve) + p->KD * ifd;
    struct state rest = {v, v, v, vfe / p->KA, vfe, ve, vfe};
    *s = rest;
    return v + vfe / p->KA;
}

/* Write vt at the n + 1 points of the grid; the reference rises by `rise` at point `at`. */
void simulate(const struct data *p, double h, long n, long at, double rise, double *vt)
{
    struct unit u = {.p = *p};
    struct state s;
    double vref = start(&u, &s);
    for (long k = 0; k < n; k++) {
        vt[k] = voltage(&u, &s);
        step(&u, &s, k < at ? vref : vref + rise, h);
    }
    vt[n] = voltage(&u, &s);
}
