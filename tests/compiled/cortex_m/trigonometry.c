/*
 * sinf and cosf for both sides of a comparison: the host's and the target's libm round differently, so their bits say
 * nothing about the observer. Same operations everywhere, about 1e-6 near; beyond 1e4 there is no reduction worth the name.
 */
float sinf(float x);
float cosf(float x);
void sincosf(float x, float *s, float *c);

static float turned(float x, int quarters)
{
    if (!(x <= 1e4f && x >= -1e4f)) {
        return x - x; /* 0, or NaN for what is not finite */
    }
    const float turns = x * 0.636619747f;
    const int n = (int)(turns < 0.0f ? turns - 0.5f : turns + 0.5f);
    const float r = ((x - (float)n * 1.5703125f) - (float)n * 4.83751297e-4f) - (float)n * 7.54978942e-8f;
    const float q = r * r;
    const float s = r + r * q * (-1.66666552e-1f + q * (8.33216087e-3f - q * 1.95152959e-4f));
    const float c = 1.0f - 0.5f * q + q * q * (4.16666457e-2f + q * (-1.38873162e-3f + q * 2.44331571e-5f));
    switch ((n + quarters) & 3) {
    case 0:
        return s;
    case 1:
        return c;
    case 2:
        return -s;
    default:
        return -c;
    }
}

float sinf(float x)
{
    return turned(x, 0);
}

float cosf(float x)
{
    return turned(x, 1);
}

void sincosf(float x, float *s, float *c)
{
    *s = turned(x, 0);
    *c = turned(x, 1);
}
