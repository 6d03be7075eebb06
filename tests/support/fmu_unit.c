/* SEXS on a machine of one axis on open circuit, as the machine code of an FMU.
 *
 * FMI is 2 or 3. It prints to the standard output, which a program may do, and ends its process
 * where TE is below SHORTEST. Its input vref is the change of the reference, which is held over a
 * step of a co-simulation. What drives the lag TE is limited by EMAX.
 */
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { VREF, VT, EFD, LEAD, D_VT, D_EFD, D_LEAD, K, TATB, TB, TE, TPD0, VT0, EMAX, OVER, COUNT };

typedef struct { double time, v[COUNT]; bool limited, by_events; } Unit;

static void reset(Unit *u) {
    static const double start[COUNT] = {0, 1, 1, 0, 0, 0, 0, 100, 0.1, 10, 0.05, 6, 1, 100, -1};
    u->time = 0.0;
    u->limited = u->by_events = false;
    memcpy(u->v, start, sizeof start);
}

static void begin(Unit *u) {
    if (u->v[TE] < SHORTEST) abort();
    u->v[VT] = u->v[EFD] = u->v[VT0];
    u->v[LEAD] = u->v[VT0] / u->v[K];
}

static void slopes(Unit *u) {
    double *v = u->v, error = v[VT0] + v[VT0] / v[K] + v[VREF] - v[VT];
    double out = v[LEAD] + v[TATB] * (error - v[LEAD]);
    v[D_VT] = (v[EFD] - v[VT]) / v[TPD0];
    v[OVER] = v[K] * out - v[EMAX];
    if (!u->by_events) u->limited = v[OVER] > 0.0;
    v[D_EFD] = ((u->limited ? v[EMAX] : v[K] * out) - v[EFD]) / v[TE];
    v[D_LEAD] = (error - v[LEAD]) / v[TB];
}

static void advance(Unit *u, double h) {
    static const double at[3] = {0.5, 0.5, 1.0}, weight[4] = {1, 2, 2, 1};
    double first[3], sum[3] = {0, 0, 0};
    memcpy(first, u->v + VT, sizeof first);
    for (int stage = 0; stage < 4; stage++) {
        slopes(u);
        for (int i = 0; i < 3; i++) {
            sum[i] += weight[stage] * u->v[D_VT + i] / 6.0;
            u->v[VT + i] = first[i] + (stage < 3 ? at[stage] * h * u->v[D_VT + i] : h * sum[i]);
        }
    }
}

static void step(Unit *u, double h) {
    int parts = (int)ceil(h / 5e-4);
    for (int part = 0; part < parts; part++) advance(u, h / parts);
    u->time += h;
}

/* In a model exchange the limit begins and ends at events alone. */
static void event(Unit *u) {
    u->by_events = false;
    slopes(u);
    u->by_events = true;
}

static Unit *made(void) {
    printf("a unit is made\n");
    fflush(stdout);
    Unit *u = malloc(sizeof *u);
    reset(u);
    return u;
}

static int get(Unit *u, const unsigned *refs, size_t n, double *values) {
    slopes(u);
    for (size_t i = 0; i < n; i++) values[i] = u->v[refs[i]];
    return 0;
}

static int set(Unit *u, const unsigned *refs, size_t n, const double *values) {
    for (size_t i = 0; i < n; i++) u->v[refs[i]] = values[i];
    return 0;
}

/* what every FMU has, and no run here asks for */
#define X(name) int F(name)(void) { return 3; }
#define OK { (void)u; return 0; }
#if FMI == 2
#define F(name) fmi2##name
void *F(Instantiate)(const char *n, int type, const char *g, const char *r, const void *f, int v, int l) { return made(); }
int F(SetupExperiment)(Unit *u, int d, double tolerance, double start, int e, double stop) OK
int F(EnterInitializationMode)(Unit *u) OK
int F(GetReal)(Unit *u, const unsigned *refs, size_t n, double *values) { return get(u, refs, n, values); }
int F(SetReal)(Unit *u, const unsigned *refs, size_t n, const double *values) { return set(u, refs, n, values); }
int F(DoStep)(Unit *u, double t, double h, int keep) { step(u, h); return 0; }
int F(GetDerivatives)(Unit *u, double *dx, size_t n) { slopes(u); memcpy(dx, u->v + D_VT, n * sizeof *dx); return 0; }
int F(CompletedIntegratorStep)(Unit *u, int keep, int *event, int *end) { *event = *end = 0; return 0; }
typedef struct { int again, end, nominals, values, timed; double next; } Events;
int F(NewDiscreteStates)(Unit *u, Events *e) { event(u); memset(e, 0, sizeof *e); return 0; }
X(CancelStep) X(DeSerializeFMUstate) X(FreeFMUstate) X(GetBoolean) X(GetBooleanStatus)
X(GetDirectionalDerivative) X(GetFMUstate) X(GetInteger) X(GetIntegerStatus)
X(GetRealOutputDerivatives) X(GetRealStatus) X(GetStatus) X(GetString) X(GetStringStatus)
X(GetTypesPlatform) X(GetVersion) X(SerializeFMUstate) X(SerializedFMUstateSize) X(SetBoolean)
X(SetDebugLogging) X(SetFMUstate) X(SetInteger) X(SetRealInputDerivatives) X(SetString)
#else
#define F(name) fmi3##name
void *F(InstantiateCoSimulation)(const char *n, const char *g, const char *r, bool v, bool l, bool e, bool early, const unsigned *refs, size_t count, void *own, void *log, void *update) { return made(); }
void *F(InstantiateModelExchange)(const char *n, const char *g, const char *r, bool v, bool l, void *own, void *log) { return made(); }
int F(EnterInitializationMode)(Unit *u, bool d, double tolerance, double start, bool e, double stop) OK
int F(GetFloat64)(Unit *u, const unsigned *refs, size_t n, double *values, size_t m) { return get(u, refs, n, values); }
int F(SetFloat64)(Unit *u, const unsigned *refs, size_t n, const double *values, size_t m) { return set(u, refs, n, values); }
int F(DoStep)(Unit *u, double t, double h, bool keep, bool *event, bool *end, bool *early, double *last) {
    step(u, h);
    *event = *end = *early = false;
    *last = u->time;
    return 0;
}
int F(GetContinuousStateDerivatives)(Unit *u, double *dx, size_t n) { slopes(u); memcpy(dx, u->v + D_VT, n * sizeof *dx); return 0; }
int F(GetNumberOfContinuousStates)(Unit *u, size_t *n) { *n = 3; return 0; }
int F(GetNumberOfEventIndicators)(Unit *u, size_t *n) { *n = 1; return 0; }
int F(CompletedIntegratorStep)(Unit *u, bool keep, bool *event, bool *end) { *event = *end = false; return 0; }
int F(UpdateDiscreteStates)(Unit *u, bool *again, bool *end, bool *nominals, bool *values, bool *timed, double *next) {
    event(u);
    *again = *end = *nominals = *values = *timed = false;
    *next = 0.0;
    return 0;
}
X(ActivateModelPartition) X(DeserializeFMUState) X(EnterConfigurationMode) X(EnterStepMode)
X(EvaluateDiscreteStates) X(ExitConfigurationMode) X(FreeFMUState) X(GetAdjointDerivative)
X(GetBinary) X(GetBoolean) X(GetClock) X(GetDirectionalDerivative) X(GetFMUState) X(GetFloat32)
X(GetInt16) X(GetInt32) X(GetInt64) X(GetInt8) X(GetIntervalDecimal) X(GetIntervalFraction)
X(GetNumberOfVariableDependencies) X(GetOutputDerivatives) X(GetShiftDecimal) X(GetShiftFraction)
X(GetString) X(GetUInt16) X(GetUInt32) X(GetUInt64) X(GetUInt8) X(GetVariableDependencies)
X(GetVersion) X(InstantiateScheduledExecution) X(SerializeFMUState) X(SerializedFMUStateSize)
X(SetBinary) X(SetBoolean) X(SetClock) X(SetDebugLogging) X(SetFMUState) X(SetFloat32) X(SetInt16)
X(SetInt32) X(SetInt64) X(SetInt8) X(SetIntervalDecimal) X(SetIntervalFraction) X(SetShiftDecimal)
X(SetShiftFraction) X(SetString) X(SetUInt16) X(SetUInt32) X(SetUInt64) X(SetUInt8)
#endif
void F(FreeInstance)(Unit *u) { free(u); }
int F(ExitInitializationMode)(Unit *u) { begin(u); return 0; }
int F(Terminate)(Unit *u) OK
int F(Reset)(Unit *u) { reset(u); return 0; }
int F(SetTime)(Unit *u, double time) { u->time = time; return 0; }
int F(EnterEventMode)(Unit *u) OK
int F(EnterContinuousTimeMode)(Unit *u) OK
int F(GetContinuousStates)(Unit *u, double *x, size_t n) { memcpy(x, u->v + VT, n * sizeof *x); return 0; }
int F(SetContinuousStates)(Unit *u, const double *x, size_t n) { memcpy(u->v + VT, x, n * sizeof *x); return 0; }
int F(GetNominalsOfContinuousStates)(Unit *u, double *x, size_t n) { for (size_t i = 0; i < n; i++) x[i] = 1.0; return 0; }
int F(GetEventIndicators)(Unit *u, double *z, size_t n) { slopes(u); z[0] = u->v[OVER]; return 0; }
