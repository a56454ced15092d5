/* A small digital twin: lane keeping, distance keeping, and a drive train with a lag.
 * The source is for FMI 2.0 and 3.0 (-DFMI=2, -DFMI=3). build.py compiles it and writes the model description. */
#include <math.h>
#include <stdlib.h>

#if FMI == 2
#include "fmi2FunctionTypes.h"
#else
#include "fmi3FunctionTypes.h"
#endif
#define EXPORT __attribute__((visibility("default")))

/* Value references, in the order of VARIABLES in build.py. */
enum { SPEED, OVER_LIMIT, TURNED, LEFT, SEEN, AHEAD, BESIDE, CLOSING, ACCELERATION, STEERING, TIME_GAP, LAG, COUNT };

typedef struct {
    double value[COUNT];
} Twin;

static Twin *new_twin(void) {
    Twin *twin = calloc(1, sizeof *twin);
    if (twin) {
        twin->value[TIME_GAP] = 1.5;
        twin->value[LAG] = 0.3;
    }
    return twin;
}

static void step(Twin *twin, double step_s) {
    double *v = twin->value;
    double wanted = fmin(fmax(-8.0 * v[OVER_LIMIT], -3.0), 2.0);
    if (v[SEEN] > 0.5 && v[AHEAD] > 0.0 && fabs(v[BESIDE]) < 2.2) {
        double gap = v[AHEAD] - 4.6;
        wanted = fmin(wanted, 0.3 * (gap - 2.0 - v[TIME_GAP] * v[SPEED]) + 0.9 * v[CLOSING]);
    }
    v[ACCELERATION] += (fmax(wanted, -8.0) - v[ACCELERATION]) * fmin(step_s / v[LAG], 1.0);
    v[STEERING] = 0.5 * v[TURNED] + 0.5 * atan2(v[LEFT], 4.0 + v[SPEED]);
}

static int copy_out(const Twin *twin, const unsigned refs[], size_t count, double values[]) {
    for (size_t k = 0; k < count; k++) {
        if (refs[k] >= COUNT) return 3;
        values[k] = twin->value[refs[k]];
    }
    return 0;
}

static int copy_in(Twin *twin, const unsigned refs[], size_t count, const double values[]) {
    for (size_t k = 0; k < count; k++) {
        if (refs[k] >= COUNT) return 3;
        twin->value[refs[k]] = values[k];
    }
    return 0;
}

/* An FMU must have every function of the standard. Those that this one does not need return an error. */
#define UNUSED(name) EXPORT int name(void) { return 3; }

#if FMI == 2
EXPORT const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
EXPORT const char *fmi2GetVersion(void) { return "2.0"; }
EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                     const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging) {
    return type == fmi2CoSimulation ? new_twin() : NULL;
}
EXPORT void fmi2FreeInstance(fmi2Component twin) { free(twin); }
EXPORT fmi2Status fmi2SetupExperiment(fmi2Component twin, fmi2Boolean has_tolerance, fmi2Real tolerance, fmi2Real start,
                                      fmi2Boolean has_stop, fmi2Real stop) { return fmi2OK; }
EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component twin) { return fmi2OK; }
EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component twin) { return fmi2OK; }
EXPORT fmi2Status fmi2Terminate(fmi2Component twin) { return fmi2OK; }
EXPORT fmi2Status fmi2GetReal(fmi2Component twin, const fmi2ValueReference refs[], size_t count, fmi2Real values[]) {
    return copy_out(twin, refs, count, values);
}
EXPORT fmi2Status fmi2SetReal(fmi2Component twin, const fmi2ValueReference refs[], size_t count,
                              const fmi2Real values[]) { return copy_in(twin, refs, count, values); }
EXPORT fmi2Status fmi2DoStep(fmi2Component twin, fmi2Real now_s, fmi2Real step_s, fmi2Boolean no_return) {
    step(twin, step_s);
    return fmi2OK;
}
UNUSED(fmi2SetDebugLogging) UNUSED(fmi2Reset) UNUSED(fmi2GetInteger) UNUSED(fmi2GetBoolean) UNUSED(fmi2GetString)
UNUSED(fmi2SetInteger) UNUSED(fmi2SetBoolean) UNUSED(fmi2SetString) UNUSED(fmi2GetFMUstate) UNUSED(fmi2SetFMUstate)
UNUSED(fmi2FreeFMUstate) UNUSED(fmi2SerializedFMUstateSize) UNUSED(fmi2SerializeFMUstate)
UNUSED(fmi2DeSerializeFMUstate) UNUSED(fmi2GetDirectionalDerivative) UNUSED(fmi2SetRealInputDerivatives)
UNUSED(fmi2GetRealOutputDerivatives) UNUSED(fmi2CancelStep) UNUSED(fmi2GetStatus) UNUSED(fmi2GetRealStatus)
UNUSED(fmi2GetIntegerStatus) UNUSED(fmi2GetBooleanStatus) UNUSED(fmi2GetStringStatus)
#else
EXPORT const char *fmi3GetVersion(void) { return "3.0"; }
EXPORT fmi3Instance fmi3InstantiateCoSimulation(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible, fmi3Boolean logging,
    fmi3Boolean event_mode, fmi3Boolean early_return, const fmi3ValueReference intermediate[], size_t intermediates,
    fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update) {
    return new_twin();
}
EXPORT void fmi3FreeInstance(fmi3Instance twin) { free(twin); }
EXPORT fmi3Status fmi3EnterInitializationMode(fmi3Instance twin, fmi3Boolean has_tolerance, fmi3Float64 tolerance,
                                              fmi3Float64 start, fmi3Boolean has_stop, fmi3Float64 stop) {
    return fmi3OK;
}
EXPORT fmi3Status fmi3ExitInitializationMode(fmi3Instance twin) { return fmi3OK; }
EXPORT fmi3Status fmi3Terminate(fmi3Instance twin) { return fmi3OK; }
EXPORT fmi3Status fmi3GetFloat64(fmi3Instance twin, const fmi3ValueReference refs[], size_t count, fmi3Float64 values[],
                                 size_t value_count) { return copy_out(twin, refs, count, values); }
EXPORT fmi3Status fmi3SetFloat64(fmi3Instance twin, const fmi3ValueReference refs[], size_t count,
                                 const fmi3Float64 values[], size_t value_count) {
    return copy_in(twin, refs, count, values);
}
EXPORT fmi3Status fmi3DoStep(fmi3Instance twin, fmi3Float64 now_s, fmi3Float64 step_s, fmi3Boolean no_return,
                             fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *last_s) {
    step(twin, step_s);
    *event = *terminate = *early = 0;
    *last_s = now_s + step_s;
    return fmi3OK;
}
#define PAIR(type) UNUSED(fmi3Get##type) UNUSED(fmi3Set##type)
PAIR(Float32) PAIR(Int8) PAIR(UInt8) PAIR(Int16) PAIR(UInt16) PAIR(Int32) PAIR(UInt32) PAIR(Int64) PAIR(UInt64)
PAIR(Boolean) PAIR(String) PAIR(Binary) PAIR(Clock) PAIR(IntervalDecimal) PAIR(IntervalFraction) PAIR(ShiftDecimal)
PAIR(ShiftFraction) PAIR(FMUState)
UNUSED(fmi3SetDebugLogging) UNUSED(fmi3InstantiateModelExchange) UNUSED(fmi3InstantiateScheduledExecution)
UNUSED(fmi3EnterEventMode) UNUSED(fmi3Reset) UNUSED(fmi3GetNumberOfVariableDependencies)
UNUSED(fmi3GetVariableDependencies) UNUSED(fmi3FreeFMUState) UNUSED(fmi3SerializedFMUStateSize)
UNUSED(fmi3SerializeFMUState) UNUSED(fmi3DeserializeFMUState) UNUSED(fmi3GetDirectionalDerivative)
UNUSED(fmi3GetAdjointDerivative) UNUSED(fmi3EnterConfigurationMode) UNUSED(fmi3ExitConfigurationMode)
UNUSED(fmi3EvaluateDiscreteStates) UNUSED(fmi3UpdateDiscreteStates) UNUSED(fmi3EnterContinuousTimeMode)
UNUSED(fmi3CompletedIntegratorStep) UNUSED(fmi3SetTime) UNUSED(fmi3SetContinuousStates)
UNUSED(fmi3GetContinuousStateDerivatives) UNUSED(fmi3GetEventIndicators) UNUSED(fmi3GetContinuousStates)
UNUSED(fmi3GetNominalsOfContinuousStates) UNUSED(fmi3GetNumberOfEventIndicators)
UNUSED(fmi3GetNumberOfContinuousStates) UNUSED(fmi3EnterStepMode) UNUSED(fmi3GetOutputDerivatives)
UNUSED(fmi3ActivateModelPartition)
#endif
