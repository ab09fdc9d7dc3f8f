/* A stand-in for Simulink's header of the same name: as much of its interface as our block uses. */
#ifndef SIMSTRUC_H
#define SIMSTRUC_H

#include <stddef.h>

typedef double real_T;
typedef int int_T;

enum { PORTS = 64, WIDEST = 64, WORK = 4096, SS_DOUBLE = 0, SS_OPTION_EXCEPTION_FREE_CODE = 1 };

typedef struct {
    int parameters, inputs, outputs, works, work_width;
    int input_width[PORTS], output_width[PORTS], feedthrough[PORTS], contiguous[PORTS];
    real_T input[PORTS][WIDEST], output[PORTS][WIDEST], work[WORK], sample_time, offset;
} SimStruct;

#define ssSetNumSFcnParams(S, n) ((S)->parameters = (n))
#define ssGetNumSFcnParams(S) ((S)->parameters)
#define ssGetSFcnParamsCount(S) ((void)(S), 0)
#define ssSetNumContStates(S, n) ((void)(S), (void)(n))
#define ssSetNumDiscStates(S, n) ((void)(S), (void)(n))
#define ssSetNumInputPorts(S, n) ((S)->inputs = (n), 1)
#define ssSetNumOutputPorts(S, n) ((S)->outputs = (n), 1)
#define ssSetInputPortWidth(S, k, n) ((S)->input_width[k] = (n))
#define ssSetOutputPortWidth(S, k, n) ((S)->output_width[k] = (n))
#define ssSetInputPortDirectFeedThrough(S, k, n) ((S)->feedthrough[k] = (n))
#define ssSetInputPortRequiredContiguous(S, k, n) ((S)->contiguous[k] = (n))
#define ssGetInputPortRealSignal(S, k) ((const real_T *)(S)->input[k])
#define ssGetOutputPortRealSignal(S, k) ((S)->output[k])
#define ssSetNumSampleTimes(S, n) ((void)(S), (void)(n))
#define ssSetSampleTime(S, k, t) ((S)->sample_time = (t))
#define ssSetOffsetTime(S, k, t) ((S)->offset = (t))
#define ssSetNumDWork(S, n) ((S)->works = (n))
#define ssSetDWorkWidth(S, k, n) ((S)->work_width = (n))
#define ssSetDWorkDataType(S, k, t) ((void)(S), (void)(t))
#define ssGetDWork(S, k) ((void *)(S)->work)
#define ssSetOptions(S, o) ((void)(S), (void)(o))

#endif
