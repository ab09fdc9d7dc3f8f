/* What runs a block in place of Simulink: samples from standard input, one a line; two calls of mdlOutputs a sample. */
#include <stdio.h>

int main(void)
{
    static SimStruct block;
    SimStruct *S = &block;

    mdlInitializeSizes(S);
    mdlInitializeSampleTimes(S);
    if (S->work_width > WORK || S->works != 1) {
        return 2;
    }
    mdlInitializeConditions(S);
    for (;;) {
        for (int k = 0; k < S->inputs; k++) {
            for (int i = 0; i < S->input_width[k]; i++) {
                if (scanf("%lf", &S->input[k][i]) != 1) {
                    mdlTerminate(S);
                    return 0;
                }
            }
        }
        mdlOutputs(S, 0);
        mdlOutputs(S, 0);
        mdlUpdate(S, 0);
        for (int k = 0; k < S->outputs; k++) {
            for (int i = 0; i < S->output_width[k]; i++) {
                printf("%.17g ", S->output[k][i]);
            }
        }
        printf("\n");
    }
}
