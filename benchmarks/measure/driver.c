/* Runs one peer: `driver check ROWS` writes every output of one pass, `driver count ROWS PASSES` only runs,
 * `driver time ROWS PASSES` prints nanoseconds a step. WIDTH inputs and OUTPUTS outputs a step. */
#define _POSIX_C_SOURCE 199309L
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#ifdef __cplusplus
extern "C" {
#endif
void peer_start(const double *row);
void peer_run(const double *rows, long samples, long passes, double *record);
#ifdef __cplusplus
}
#endif

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t); /* on a shared machine, others do not count */
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

int main(int count, char **words)
{
    if (count < 3) return 2;
    FILE *file = fopen(words[2], "rb");
    if (!file) return 3;
    fseek(file, 0, SEEK_END);
    const long samples = ftell(file) / (long)(WIDTH * sizeof(double));
    double *rows = (double *)malloc((size_t)samples * WIDTH * sizeof(double));
    rewind(file);
    if (fread(rows, sizeof(double) * WIDTH, (size_t)samples, file) != (size_t)samples) return 4;
    fclose(file);
    const long passes = count > 3 ? atol(words[3]) : 1;
    peer_start(rows);
    if (!strcmp(words[1], "check")) {
        double *record = (double *)calloc((size_t)samples * OUTPUTS, sizeof(double));
        peer_run(rows, samples, 1, record);
        fwrite(record, sizeof(double) * OUTPUTS, (size_t)samples, stdout);
    } else if (!strcmp(words[1], "count")) {
        peer_run(rows, samples, passes, 0);
    } else {
        peer_run(rows, samples, 1, 0);
        const double start = now();
        peer_run(rows, samples, passes, 0);
        printf("%.6f\n", 1e9 * (now() - start) / (double)(passes * samples));
    }
    return 0;
}
